#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "files/profile_rules.hpp"
#include "files/yaml_text.hpp"
#include "spindle/files/register_map.hpp"

namespace spindle::files {
namespace {

constexpr std::string_view no_parameters =
    "  # - {name: speed, register: 0, encoding: u16, scale: 0.1, unit: rpm, access: r, evidence: "
    "manual,\n"
    "  #    source: \"manual p.1\", title: \"Speed of the motor\"}\n"
    "  - {name: example, register: 0, encoding: u16, access: r, evidence: inferred, source: "
    "\"none\", title: \"An example: replace it\"}\n";

/// Values that end with these digits have two registers, or four.
std::uint32_t count_registers(const MapEntry& entry) {
  constexpr std::uint32_t bytes = 2;
  constexpr std::uint32_t digits = 4;
  if (entry.length > 0) {
    const std::uint32_t in_one = entry.encoding == "bcd" ? digits : bytes;
    return (entry.length + in_one - 1) / in_one;
  }
  if (entry.encoding.ends_with("32")) return 2;
  return entry.encoding.ends_with("64") ? 4 : 1;
}

/// The registers that stand in more than one entry.
class Shared {
 public:
  explicit Shared(const std::vector<MapEntry>& entries) {
    for (const MapEntry& entry : entries) {
      for (std::uint32_t at = 0; at < count_registers(entry); ++at) {
        const std::pair place(entry.table, entry.address + at);
        if (!once_.insert(place).second) twice_.insert(place);
      }
    }
  }

  [[nodiscard]] bool has(const MapEntry& entry) const {
    for (std::uint32_t at = 0; at < count_registers(entry); ++at) {
      if (twice_.contains({entry.table, entry.address + at})) return true;
    }
    return false;
  }

 private:
  std::set<std::pair<modbus::RegisterTable, std::uint32_t>> once_ = {};
  std::set<std::pair<modbus::RegisterTable, std::uint32_t>> twice_ = {};
};

std::string line_of(const MapEntry& entry, bool is_shared, const std::string& source) {
  std::string line = fmt::format("  - {{name: {}, ", scalar(entry.name));
  if (entry.table != modbus::RegisterTable::holding) {
    line += fmt::format("table: {}, ", modbus::to_text(entry.table));
  }
  line += fmt::format("register: {}, encoding: {}, ", entry.address, scalar(entry.encoding));
  if (entry.length > 0) line += fmt::format("length: {}, ", entry.length);
  if (!entry.scale.empty()) line += fmt::format("scale: {}, ", entry.scale);
  if (!entry.unit.empty()) line += fmt::format("unit: {}, ", quoted(entry.unit));
  if (is_shared) line += "overlaps: true, ";
  return line + fmt::format("access: {}, evidence: {}, source: {}, title: {}}}\n",
                            entry.is_writable ? "rw" : "r", entry.evidence, quoted(source),
                            quoted(entry.title));
}

}  // namespace

bool may_name_profile(std::string_view text) { return is_catalogue_name(text); }

std::string render_profile(const std::string& id, const RegisterMap& map,
                           const std::string& source) {
  std::string text = fmt::format(
      "# A profile: what the registers of one product mean. To be completed by hand:\n"
      "# 'man spindle-profile' explains every key, 'spindle profile check ./{0}.yaml' finds "
      "faults.\n"
      "format: 1\n"
      "id: {0}\n"
      "title: {1}\n"
      "# maker: \"Maker\"\n"
      "# series: \"Series\"\n"
      "\n"
      "# How the product is reached. On a serial line, for example:\n"
      "#   framing: rtu\n"
      "#   serial: {{baud: 9600, parity: even, stop: 1}}\n"
      "link:\n"
      "  framing: tcp\n"
      "  port: 502\n"
      "  unit: 1\n"
      "  max-read: 16  # registers in one request; the manual may allow up to 125\n"
      "  answer: 1s\n"
      "\n"
      "# Evidence is where an entry comes from: manual, transcribed, sibling or inferred. Never "
      "more "
      "than is true.\n"
      "parameters:\n",
      id, quoted(id));
  if (map.entries.empty()) return text + std::string(no_parameters);
  const Shared shared(map.entries);
  for (const MapEntry& entry : map.entries) text += line_of(entry, shared.has(entry), source);
  return text;
}

}  // namespace spindle::files
