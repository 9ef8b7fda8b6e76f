#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/decimal.hpp"

namespace spindle::report {

using Words = std::vector<std::uint16_t>;
using Numbers = std::vector<std::optional<Decimal>>;  ///< empty: null
using Texts = std::vector<std::string>;
using Pairs = std::vector<std::pair<std::string, std::string>>;

/// Who a fact is for: tables, CSV and JSON, or only those with columns (a text made of other
/// facts).
enum class Audience : std::uint8_t { everyone, columns };

/// What colour says beside the words, where there is colour.
enum class Tone : std::uint8_t { plain, good, bad };

/// One fact of a record: null, number, text, truth, words, numbers, texts, or an object of texts.
using Cell = std::variant<std::monostate, Decimal, std::string, bool, Words, Numbers, Texts, Pairs>;

/// Null where the text is empty.
Cell text_or_null(std::string text);
Cell number(std::int64_t value);
/// How many things there are, or which of them.
Cell count(std::size_t things);

struct Field {
  std::string key;  ///< snake_case, as in the contract's table of record types
  Cell cell;
  std::string shown = {};  ///< what people see instead, in tables; empty: the cell itself
  Audience audience = Audience::everyone;
  Tone tone = Tone::plain;
};

/// What commands produce. Renderers decide how it looks.
struct Record {
  std::string type;    ///< "value", "identity", "summary", …
  std::string target;  ///< empty: null in JSON
  WallTime time;
  std::vector<Field> fields;

  [[nodiscard]] const Field* find(std::string_view key) const;
};

/// "2026-11-22T10:15:30.123Z".
std::string to_text(WallTime time);

/// The record as one JSON object, as it stands in JSON Lines.
std::string to_json(const Record& record);

/// The record that to_json() made this of; its time is told by who kept it. Empty for what it makes
/// of no record.
std::optional<Record> record_of(std::string_view json, WallTime time);
/// The same of a line that tells its time itself: it is the field `time`, a text.
std::optional<Record> record_of(std::string_view json);

/// Plain text of a cell, as in CSV: null is empty, words are separated by single spaces.
std::string to_text(const Cell& cell);

}  // namespace spindle::report
