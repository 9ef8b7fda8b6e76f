#include "spindle/files/dump_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "files/document_form.hpp"
#include "files/fields.hpp"
#include "files/identity_lines.hpp"
#include "files/known_keys.hpp"
#include "files/yaml_reader.hpp"
#include "files/yaml_text.hpp"

namespace spindle::files {
namespace {

constexpr std::string_view kind = "spindle-dump";
constexpr std::size_t values_a_line = 16;
constexpr std::size_t all_registers = 0x10000;

// ---- writing ----

/// Long runs have a line for every few values, so that two files can be compared by line.
std::string line_of(const DumpRun& run) {
  const Registers& values = run.values;
  std::string line =
      fmt::format("  - {{table: {}, from: {}, values: [", modbus::to_text(run.table), run.from);
  for (std::size_t at = 0; at < values.size(); ++at) {
    const bool begins_line = values.size() > values_a_line && at % values_a_line == 0;
    if (begins_line) {
      line += at == 0 ? "\n      " : ",\n      ";
    } else if (at > 0) {
      line += ", ";
    }
    line += std::to_string(values[at]);
  }
  return line + "]}\n";
}

std::size_t count_registers(const std::vector<DumpRun>& runs) {
  std::size_t registers = 0;
  for (const DumpRun& run : runs) registers += run.values.size();
  return registers;
}

// ---- reading ----

void read_run_values(const YamlNode& node, DumpRun& run, const Asked& asked) {
  if (!expect(node, YamlNode::Kind::sequence, asked.findings)) return;
  if (node.items.empty()) asked.findings.add(node.at, "a run has one value or more");
  if (node.items.size() > all_registers) {
    asked.findings.add(node.at, "there are not so many registers");
    return;
  }
  for (const YamlNode& item : node.items) {
    const auto value = to_unsigned(item, std::numeric_limits<std::uint16_t>::max(), asked.findings);
    if (!value) return;
    run.values.push_back(static_cast<std::uint16_t>(*value));
  }
}

constexpr Field<DumpRun> run_fields[] = {
    word<modbus::table_words, &DumpRun::table>("table", Need::required),
    field<&DumpRun::from>("from", Need::required),
    custom("values", Need::required, "list of numbers 0..65535", read_run_values),
};

/// How much was written.
struct Counts {
  std::optional<std::uint32_t> runs = std::nullopt;
  std::optional<std::uint32_t> registers = std::nullopt;
};

constexpr Field<Counts> count_fields[] = {
    field<&Counts::runs>("runs", Need::required),
    field<&Counts::registers>("registers", Need::required),
};

struct DumpDocument {
  Dump dump = {};
  const YamlNode* runs = nullptr;
  const YamlNode* end = nullptr;
};

void skip(const YamlNode&, DumpDocument&, const Asked&) {}

constexpr Field<DumpDocument> document_fields[] = {
    // Both were checked before anything else is read.
    custom("format", Need::required, "1", skip),
    custom("kind", Need::required, kind, skip),
    field<&DumpDocument::dump, &Dump::time>("time", Need::required),
    field<&DumpDocument::dump, &Dump::version>("spindle", Need::required),
    field<&DumpDocument::dump, &Dump::target>("target", Need::required),
    field<&DumpDocument::dump, &Dump::profile>("profile"),
    map_of<identity_fields, &DumpDocument::dump, &Dump::identity>("identity"),
    field<&DumpDocument::runs>("runs", Need::required).with(keys_of<run_fields>),
    field<&DumpDocument::end>("end", Need::required).with(keys_of<count_fields>),
};

void check_count(const YamlNode& end, std::string_view key, std::optional<std::uint32_t> written,
                 std::size_t there, Diagnostics& findings) {
  if (!written || *written == there) return;
  findings.add(end.find(key)->at,
               fmt::format("{} {} were written, but {} are there", *written, key, there));
}

void read_runs(const YamlNode& list, Dump& dump, Diagnostics& findings) {
  if (list.kind == YamlNode::Kind::nothing) return;
  if (!expect(list, YamlNode::Kind::sequence, findings)) return;
  std::set<std::pair<modbus::RegisterTable, std::size_t>> known;
  for (const YamlNode& node : list.items) {
    DumpRun run;
    read_map(run_fields, node, run, findings);
    for (std::size_t at = run.from; at < run.from + run.values.size(); ++at) {
      if (at < all_registers && known.emplace(run.table, at).second) continue;
      findings.add(node.at, at < all_registers
                                ? fmt::format("register {} stands here and in a run before", at)
                                : "the run goes on behind register 65535");
      break;
    }
    dump.runs.push_back(std::move(run));
  }
}

Dump read_document(const YamlNode& document, Diagnostics& findings) {
  if (!has_form(document, "dump", findings)) return {};
  if (document.find("end") == nullptr) {
    findings.add(document.at, "the end marker is missing: the file is cut off; take another dump");
    return {};
  }
  DumpDocument parts;
  read_map(document_fields, document, parts, findings);
  if (parts.runs == nullptr || parts.end == nullptr) return {};
  read_runs(*parts.runs, parts.dump, findings);
  Counts counts;
  read_map(count_fields, *parts.end, counts, findings);
  check_count(*parts.end, "runs", counts.runs, parts.dump.runs.size(), findings);
  check_count(*parts.end, "registers", counts.registers, count_registers(parts.dump.runs),
              findings);
  return std::move(parts.dump);
}

}  // namespace

std::string render_dump(const Dump& dump) {
  std::string text =
      fmt::format("format: {}\nkind: {}\ntime: {}\nspindle: {}\ntarget: {}\n", known_format, kind,
                  quoted(dump.time), quoted(dump.version), quoted(dump.target));
  if (!dump.profile.empty()) text += fmt::format("profile: {}\n", scalar(dump.profile));
  if (dump.identity) text += line_of(*dump.identity);
  text += dump.runs.empty() ? "runs: []\n" : "runs:\n";
  for (const DumpRun& run : dump.runs) text += line_of(run);
  return text + fmt::format("end: {{runs: {}, registers: {}}}\n", dump.runs.size(),
                            count_registers(dump.runs));
}

bool is_dump(std::string_view text) {
  const std::string line = fmt::format("\nkind: {}", kind);
  return text.find(line) != std::string_view::npos || text.starts_with(line.substr(1));
}

Result<Dump> read_dump(std::string_view text, const std::string& path) {
  Diagnostics findings;
  const std::size_t number = findings.add_file(path);
  const std::vector<YamlNode> documents = parse_yaml(text, number, Documents::all, findings);
  Dump dump;
  if (findings.empty() && documents.size() != 1) {
    findings.add({number, 1, 1},
                 documents.empty() ? "the file is empty" : "a second document has no meaning here");
  }
  if (findings.empty()) dump = read_document(documents.front(), findings);
  if (!findings.empty()) return tl::unexpected(findings.error());
  return dump;
}

std::vector<KeyList> dump_keys() { return {{"document", keys_of<document_fields>()}}; }

}  // namespace spindle::files
