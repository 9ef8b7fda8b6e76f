#include "spindle/files/register_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "files/csv_reader.hpp"
#include "spindle/base/decimal.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/parameter.hpp"

namespace spindle::files {
namespace {

/// More parameters than any profile that can be loaded has.
constexpr std::size_t most_rows = 5'000;
constexpr std::size_t most_warnings = 20;
constexpr std::size_t longest_title = 200;
constexpr std::size_t longest_name = 60;
constexpr std::size_t longest_unit = 12;
constexpr std::uint64_t last_register = 0xFFFF;

enum class Column : std::uint8_t {
  address,
  name,
  type,
  scale,
  unit,
  access,
  title,
  table,
  evidence,
};

constexpr std::array<std::pair<std::string_view, Column>, 22> headings = {{
    {"register", Column::address},  {"address", Column::address},   {"reg", Column::address},
    {"addr", Column::address},      {"name", Column::name},         {"parameter", Column::name},
    {"type", Column::type},         {"encoding", Column::type},     {"data type", Column::type},
    {"datatype", Column::type},     {"scale", Column::scale},       {"factor", Column::scale},
    {"unit", Column::unit},         {"units", Column::unit},        {"access", Column::access},
    {"r/w", Column::access},        {"description", Column::title}, {"title", Column::title},
    {"meaning", Column::title},     {"comment", Column::title},     {"table", Column::table},
    {"evidence", Column::evidence},
}};

/// Words of other people for the encodings of a profile.
constexpr std::array<std::pair<std::string_view, std::string_view>, 26> type_words = {{
    {"uint16", "u16"},  {"word", "u16"},    {"ushort", "u16"}, {"unsigned16", "u16"},
    {"int16", "i16"},   {"short", "i16"},   {"s16", "i16"},    {"sint16", "i16"},
    {"uint32", "u32"},  {"dword", "u32"},   {"ulong", "u32"},  {"int32", "i32"},
    {"s32", "i32"},     {"sint32", "i32"},  {"long", "i32"},   {"float", "f32"},
    {"float32", "f32"}, {"real", "f32"},    {"uint64", "u64"}, {"int64", "i64"},
    {"double", "f64"},  {"float64", "f64"}, {"bool", "bit"},   {"boolean", "bit"},
    {"coil", "bit"},    {"string", "text"},
}};

constexpr std::array<std::pair<std::string_view, bool>, 12> access_words = {{
    {"", false},
    {"r", false},
    {"ro", false},
    {"read", false},
    {"read-only", false},
    {"rw", true},
    {"r/w", true},
    {"w", true},
    {"wo", true},
    {"write", true},
    {"read/write", true},
    {"read-write", true},
}};

template <typename Value, std::size_t count>
std::optional<Value> look_up(const std::array<std::pair<std::string_view, Value>, count>& words,
                             std::string_view word) {
  const auto found = std::find_if(words.begin(), words.end(),
                                  [&](const auto& entry) { return entry.first == word; });
  return found == words.end() ? std::nullopt : std::optional(found->second);
}

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool is_letter_or_digit(char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); }

std::string lower_case(std::string_view text) {
  std::string lowered(text);
  std::transform(lowered.begin(), lowered.end(), lowered.begin(), lower);
  return lowered;
}

/// "Motor Speed (max.)" becomes "motor-speed-max"; points between words stay.
std::string catalogue_name(std::string_view text) {
  std::string name;
  char joint = 0;
  for (const char written : text) {
    const char c = lower(written);
    if (!is_letter_or_digit(c)) {
      joint = c == '.' && joint != '-' ? '.' : '-';
      continue;
    }
    if (name.size() >= longest_name) break;
    if (joint != 0 && !name.empty()) name += joint;
    joint = 0;
    name += c;
  }
  return name;
}

/// At most so many bytes, on one line, and no half character.
std::string shortened(std::string text, std::size_t longest) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  if (text.size() <= longest) return text;
  const auto is_inside = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; };
  while (longest > 0 && is_inside(text[longest])) --longest;
  return text.substr(0, longest);
}

using Fault = std::optional<std::string>;

/// Reads the rows behind a header.
class MapReader {
 public:
  MapReader(const CsvRow& header, Numbering numbering) : numbering_(numbering) {
    for (std::size_t at = 0; at < header.fields.size(); ++at) {
      const auto column = look_up(headings, lower_case(header.fields[at]));
      if (column) columns_.emplace(*column, at);
    }
  }

  [[nodiscard]] bool knows_registers() const { return columns_.contains(Column::address); }

  void read(const CsvRow& row) {
    row_ = &row;
    MapEntry entry;
    if (auto fault = read_entry(entry)) {
      ++map_.faulty;
      if (map_.warnings.size() < most_warnings) {
        map_.warnings.push_back({row.line, std::move(*fault)});
      }
      return;
    }
    entry.name = unique(entry.name);
    if (entry.title.empty()) entry.title = entry.name;
    map_.entries.push_back(std::move(entry));
  }

  RegisterMap take() {
    if (looks_modicon_) {
      map_.hint =
          "registers such as 40001 are taken as they stand; with --numbering modicon 40001 is "
          "holding register 0";
    }
    return std::move(map_);
  }

 private:
  [[nodiscard]] std::string field(Column column) const {
    const auto at = columns_.find(column);
    if (at == columns_.end() || at->second >= row_->fields.size()) return {};
    return row_->fields[at->second];
  }

  Fault read_entry(MapEntry& entry) {
    for (const auto read : {&MapReader::read_table, &MapReader::read_address, &MapReader::read_type,
                            &MapReader::read_scale, &MapReader::read_words}) {
      if (auto fault = (this->*read)(entry)) return fault;
    }
    if (entry.is_writable && !modbus::is_writable(entry.table)) {
      return fmt::format("table {} cannot be written", modbus::to_text(entry.table));
    }
    return read_name(entry);
  }

  Fault read_table(MapEntry& entry) {
    const std::string word = lower_case(field(Column::table));
    const auto table = modbus::table_words.find(word.empty() ? "holding" : word);
    if (!table) return fmt::format("unknown table '{}'", word);
    entry.table = *table;
    return std::nullopt;
  }

  Fault read_address(MapEntry& entry) {
    const std::string text = field(Column::address);
    if (numbering_ == Numbering::modicon) return read_modicon(text, entry);
    constexpr std::uint64_t longest_number = 499'999;
    const auto number = parse_unsigned(text, longest_number);
    const bool looks_modicon = number && ((*number > 30'000 && *number < 50'000) ||
                                          (*number > 300'000 && *number <= 465'536));
    looks_modicon_ = looks_modicon_ || looks_modicon;
    if (text.empty()) return "the register is missing";
    if (!number || *number > last_register) {
      return fmt::format("'{}' is no register from 0 to 65535", shortened(text, longest_title));
    }
    entry.address = static_cast<std::uint16_t>(*number);
    return std::nullopt;
  }

  /// A digit for the table, then four or five that count from 1.
  static Fault read_modicon(const std::string& text, MapEntry& entry) {
    constexpr std::array<std::pair<std::string_view, std::string_view>, 4> tables = {
        {{"0", "coil"}, {"1", "discrete"}, {"3", "input"}, {"4", "holding"}}};
    const bool fits =
        (text.size() == 5 || text.size() == 6) &&
        std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
    const auto word = fits ? look_up(tables, text.substr(0, 1)) : std::nullopt;
    const auto number = fits ? parse_unsigned(text.substr(1), last_register + 1) : std::nullopt;
    if (!word || !number || *number == 0) {
      return fmt::format("'{}' is no number such as 40001", shortened(text, longest_title));
    }
    const auto table = modbus::table_words.find(*word);
    if (!table) return fmt::format("{} is in table {}, which no profile has", text, *word);
    entry.table = *table;
    entry.address = static_cast<std::uint16_t>(*number - 1);
    return std::nullopt;
  }

  Fault read_type(MapEntry& entry) {
    const std::string type = lower_case(field(Column::type));
    if (modbus::holds_bits(entry.table)) {
      const bool is_bit = type.empty() || type == "bit" || look_up(type_words, type) == "bit";
      if (!is_bit) return fmt::format("table {} holds bits", modbus::to_text(entry.table));
      entry.encoding = "bit";
      return std::nullopt;
    }
    if (type.empty()) return std::nullopt;
    if (const auto has_length = read_length(type, entry)) return *has_length;
    entry.encoding = look_up(type_words, type).value_or(type);
    const bool is_word = entry.encoding.size() <= longest_unit &&
                         std::all_of(entry.encoding.begin(), entry.encoding.end(),
                                     [](char c) { return is_letter_or_digit(c) || c == '-'; });
    if (is_word) return std::nullopt;
    return fmt::format("'{}' is no type", shortened(type, longest_title));
  }

  /// Of "text16", "string16" or "bcd4"; nothing: the type has no length.
  static std::optional<Fault> read_length(std::string_view type, MapEntry& entry) {
    for (const std::string_view word : {"text", "string", "bcd"}) {
      if (!type.starts_with(word)) continue;
      constexpr std::uint64_t longest_text = 250;
      const auto length = parse_unsigned(type.substr(word.size()), longest_text);
      if (!length || *length == 0) {
        return fmt::format("'{}' needs a length, such as {}8",
                           shortened(std::string(type), longest_title), word);
      }
      entry.encoding = look_up(type_words, word).value_or(word);
      entry.length = static_cast<std::uint16_t>(*length);
      return Fault();
    }
    return std::nullopt;
  }

  Fault read_scale(MapEntry& entry) {
    std::string text = field(Column::scale);
    std::replace(text.begin(), text.end(), ',', '.');
    if (text.empty()) return std::nullopt;
    const auto scale = Decimal::parse(text);
    if (!scale || *scale == Decimal(0)) {
      return fmt::format("'{}' is no scale", shortened(text, longest_title));
    }
    if (*scale != Decimal(1)) entry.scale = scale->to_string();
    return std::nullopt;
  }

  Fault read_words(MapEntry& entry) {
    entry.unit = field(Column::unit);
    std::erase(entry.unit, ' ');
    const bool is_unit = entry.unit.size() <= longest_unit &&
                         std::all_of(entry.unit.begin(), entry.unit.end(),
                                     [](unsigned char c) { return c > ' ' && c != 0x7F; });
    if (!is_unit) return fmt::format("a unit is one word of at most {} bytes", longest_unit);
    const auto access = look_up(access_words, lower_case(field(Column::access)));
    if (!access)
      return fmt::format("'{}' is neither r nor rw",
                         shortened(field(Column::access), longest_title));
    entry.is_writable = *access;
    if (const std::string evidence = lower_case(field(Column::evidence)); !evidence.empty()) {
      if (!catalogue::evidence_words.find(evidence)) {
        return fmt::format("unknown evidence '{}'", shortened(evidence, longest_title));
      }
      entry.evidence = evidence;
    }
    return std::nullopt;
  }

  Fault read_name(MapEntry& entry) {
    entry.title = shortened(field(Column::title), longest_title);
    entry.name = catalogue_name(field(Column::name));
    if (entry.name.empty()) entry.name = catalogue_name(entry.title);
    if (entry.name.empty()) entry.name = fmt::format("register-{}", entry.address);
    return std::nullopt;
  }

  /// The name, or with a number behind it where it is taken.
  std::string unique(const std::string& name) {
    std::string free = name;
    while (!taken_.emplace(free, 1).second) free = fmt::format("{}-{}", name, ++taken_[name]);
    return free;
  }

  Numbering numbering_;
  std::map<Column, std::size_t> columns_ = {};
  const CsvRow* row_ = nullptr;
  RegisterMap map_ = {};
  std::map<std::string, std::size_t> taken_ = {};  ///< and how often it was asked for
  bool looks_modicon_ = false;
};

}  // namespace

Result<RegisterMap> read_register_map(std::string_view text, const std::string& path,
                                      Numbering numbering) {
  TRY_LET(const auto rows, read_csv(text, path, most_rows + 1));
  const auto refuse = [&](std::size_t line, std::string_view message) {
    return tl::unexpected(
        Error{.code = Errc::bad_file,
              .message = fmt::format("{}:{}: {}", path, line, message),
              .hint = "the first row names the columns: register, name, type, scale, unit, access, "
                      "description"});
  };
  if (rows.empty()) return refuse(1, "the file is empty");
  MapReader reader(rows.front(), numbering);
  if (!reader.knows_registers()) {
    return refuse(rows.front().line, "no column is called 'register' or 'address'");
  }
  for (std::size_t at = 1; at < rows.size(); ++at) reader.read(rows[at]);
  return reader.take();
}

}  // namespace spindle::files
