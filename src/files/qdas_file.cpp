#include "spindle/files/qdas_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "spindle/base/utf8.hpp"

namespace spindle::files {
namespace {

constexpr std::string_view line_end = "\r\n";
constexpr char between_fields = '\x14';
constexpr char between_characteristics = '\x0f';

/// Attributes of values (K0002).
constexpr int valid = 0;
constexpr int not_evaluated = 255;
constexpr int missing = 256;

std::string latin(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const CodePoint character = first_code_point(text);
    const bool is_control =
        character.value < 0x20 || (character.value >= 0x7F && character.value < 0xA0);
    if (is_control) {
      out += ' ';
    } else {
      out += character.value <= 0xFF ? static_cast<char>(character.value) : '?';
    }
    text.remove_prefix(character.length);
  }
  return out;
}

class Writer {
 public:
  void key(std::string_view key, std::size_t of, const std::string& value) {
    if (value.empty()) return;
    text_ += fmt::format("{}/{} {}{}", key, of, latin(value), line_end);
  }
  void key(std::string_view key, std::size_t of, const std::optional<Decimal>& value) {
    if (value) this->key(key, of, value->to_string());
  }
  void add(std::string_view text) { text_ += text; }
  void add(char text) { text_ += text; }
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

/// As many as the value with the most has.
int decimals_of(const QdasPart& part, std::size_t index) {
  int decimals = 0;
  for (const QdasRow& row : part.rows) {
    if (row.values[index]) decimals = std::max(decimals, -row.values[index]->exponent());
  }
  return decimals;
}

void write_characteristic(Writer& out, const QdasPart& part, std::size_t index) {
  const QdasCharacteristic& characteristic = part.characteristics[index];
  const std::size_t of = index + 1;
  const auto kind = [](const auto& limit) { return std::string(limit ? "1" : "0"); };
  out.key("K2001", of, std::to_string(of));
  out.key("K2002", of, characteristic.name);
  out.key("K2004", of, "0");
  out.key("K2022", of, std::to_string(decimals_of(part, index)));
  out.key("K2101", of, characteristic.nominal);
  out.key("K2110", of, characteristic.lower);
  out.key("K2111", of, characteristic.upper);
  out.key("K2120", of, kind(characteristic.lower));
  out.key("K2121", of, kind(characteristic.upper));
  out.key("K2142", of, characteristic.unit);
  out.key("K2900", of, characteristic.remark);
}

/// "30.11.2026/14:00:05"
std::string time_of(WallTime shown) {
  const auto day = std::chrono::floor<std::chrono::days>(shown);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(std::chrono::floor<std::chrono::seconds>(shown) - day);
  return fmt::format("{:02}.{:02}.{:04}/{:02}:{:02}:{:02}", static_cast<unsigned>(date.day()),
                     static_cast<unsigned>(date.month()), static_cast<int>(date.year()),
                     clock.hours().count(), clock.minutes().count(), clock.seconds().count());
}

void write_row(Writer& out, const QdasRow& row) {
  const std::string time = time_of(row.shown);
  const int attribute = row.use == QdasUse::evaluated ? valid : not_evaluated;
  for (std::size_t index = 0; index < row.values.size(); ++index) {
    if (index != 0) out.add(between_characteristics);
    const auto& value = row.values[index];
    out.add(value ? value->to_string() : "0");
    out.add(between_fields);
    out.add(std::to_string(value ? attribute : missing));
    out.add(between_fields);
    out.add(time);
  }
  out.add(line_end);
}

}  // namespace

std::string render_qdas(const QdasPart& part) {
  Writer out;
  out.add(fmt::format("K0100 {}{}", part.characteristics.size(), line_end));
  out.key("K1001", 1, part.number);
  out.key("K1002", 1, part.name);
  out.key("K1900", 1, part.remark);
  for (std::size_t index = 0; index < part.characteristics.size(); ++index) {
    write_characteristic(out, part, index);
  }
  for (const QdasRow& row : part.rows) write_row(out, row);
  return out.take();
}

}  // namespace spindle::files
