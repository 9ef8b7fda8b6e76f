#include <algorithm>
#include <utility>

#include "spindle/base/text.hpp"
#include "spindle/report/record.hpp"

namespace spindle::report {
namespace {

void append_utf8(std::string& out, std::uint32_t value) {
  const auto append = [&out](std::uint32_t byte) { out += static_cast<char>(byte); };
  if (value < 0x80) return append(value);
  if (value < 0x800) {
    append(0xC0U | (value >> 6U));
  } else if (value < 0x10000) {
    append(0xE0U | (value >> 12U));
    append(0x80U | ((value >> 6U) & 0x3FU));
  } else {
    append(0xF0U | (value >> 18U));
    append(0x80U | ((value >> 12U) & 0x3FU));
    append(0x80U | ((value >> 6U) & 0x3FU));
  }
  append(0x80U | (value & 0x3FU));
}

/// Reads what append_json() writes, and no more: one object without blanks. The first fault ends
/// it.
class JsonReader {
 public:
  explicit JsonReader(std::string_view text) : rest_(text) {}

  /// Where no time is given, that of the record is a field.
  std::optional<Record> read(std::optional<WallTime> time) {
    keeps_time_ = !time;
    Record record{.type = {}, .target = {}, .time = time.value_or(WallTime()), .fields = {}};
    expect('{');
    do {
      std::string key = text();
      expect(':');
      Cell value = cell();
      add(record, std::move(key), std::move(value));
    } while (take(','));
    expect('}');
    if (is_wrong_ || !rest_.empty() || record.type.empty()) return std::nullopt;
    return record;
  }

 private:
  void add(Record& record, std::string key, Cell value) const {
    const auto* words = std::get_if<std::string>(&value);
    if (key == "schema" || (key == "time" && !keeps_time_)) return;
    if (key == "type") {
      if (words != nullptr) record.type = *words;
    } else if (key == "target") {
      if (words != nullptr) record.target = *words;
    } else {
      record.fields.push_back({std::move(key), std::move(value)});
    }
  }

  bool take(char wanted) {
    if (is_wrong_ || rest_.empty() || rest_.front() != wanted) return false;
    rest_.remove_prefix(1);
    return true;
  }

  void expect(char wanted) {
    if (!take(wanted)) is_wrong_ = true;
  }

  bool take(std::string_view word) {
    if (!rest_.starts_with(word)) return false;
    rest_.remove_prefix(word.size());
    return true;
  }

  Cell cell() {
    if (take("null")) return {};
    if (take("true")) return true;
    if (take("false")) return false;
    if (rest_.starts_with('"')) return text();
    if (take('[')) return list();
    if (take('{')) return object();
    return number();
  }

  Decimal number() {
    const std::size_t end = std::min(rest_.find_first_not_of("-.0123456789"), rest_.size());
    const auto value = Decimal::parse(rest_.substr(0, end));
    if (!value) is_wrong_ = true;
    rest_.remove_prefix(end);
    return value.value_or(Decimal());
  }

  Cell list() {
    if (take(']')) return Words();
    if (rest_.starts_with('"')) {
      Texts texts;
      do {
        texts.push_back(text());
      } while (take(','));
      expect(']');
      return texts;
    }
    Numbers numbers;
    do {
      numbers.push_back(take("null") ? std::nullopt : std::optional(number()));
    } while (take(','));
    expect(']');
    return numbers;
  }

  Cell object() {
    Pairs pairs;
    if (take('}')) return pairs;
    do {
      std::string key = text();
      expect(':');
      pairs.emplace_back(std::move(key), text());
    } while (take(','));
    expect('}');
    return pairs;
  }

  std::string text() {
    std::string read;
    expect('"');
    while (!is_wrong_ && !take('"')) {
      if (take('\\')) {
        read_escape(read);
      } else if (rest_.empty()) {
        is_wrong_ = true;
      } else {
        read += rest_.front();
        rest_.remove_prefix(1);
      }
    }
    return read;
  }

  void read_escape(std::string& read) {
    constexpr std::string_view names = "\"\\/bfnrt";
    constexpr std::string_view meant = "\"\\/\b\f\n\r\t";
    if (take('u')) return append_utf8(read, escaped_character());
    const std::size_t at = rest_.empty() ? std::string_view::npos : names.find(rest_.front());
    if (at == std::string_view::npos) {
      is_wrong_ = true;
      return;
    }
    read += meant[at];
    rest_.remove_prefix(1);
  }

  /// Of one UTF-16 unit, or of two.
  std::uint32_t escaped_character() {
    const std::uint32_t first = unit();
    const bool has_second = first >= 0xD800 && first < 0xDC00 && take("\\u");
    return has_second ? 0x10000 + ((first - 0xD800) << 10U) + (unit() - 0xDC00) : first;
  }

  std::uint32_t unit() {
    constexpr std::size_t digits = 4;
    const auto value = parse_unsigned("0x" + std::string(rest_.substr(0, digits)), 0xFFFF);
    if (!value || rest_.size() < digits) is_wrong_ = true;
    rest_.remove_prefix(std::min(digits, rest_.size()));
    return static_cast<std::uint32_t>(value.value_or(0));
  }

  std::string_view rest_;
  bool keeps_time_ = false;
  bool is_wrong_ = false;
};

}  // namespace

std::optional<Record> record_of(std::string_view json, WallTime time) {
  return JsonReader(json).read(time);
}

std::optional<Record> record_of(std::string_view json) { return JsonReader(json).read({}); }

}  // namespace spindle::report
