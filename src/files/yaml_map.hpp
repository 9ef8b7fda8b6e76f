#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "files/yaml_reader.hpp"
#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/base/decimal.hpp"
#include "spindle/base/enum_table.hpp"

namespace spindle::files {

enum class Need : std::uint8_t { optional, required };

/// First and last number of "1..15".
struct NumberRange {
  std::uint64_t from = 0;
  std::uint64_t to = 0;
};

// ---- one value: the finding says what was expected; empty when it is not that ----

std::optional<std::string> to_text(const YamlNode& node, Diagnostics& findings);
std::optional<std::uint64_t> to_unsigned(const YamlNode& node, std::uint64_t maximum,
                                         Diagnostics& findings);
/// "5" is 5..5.
std::optional<NumberRange> to_range(const YamlNode& node, std::uint64_t maximum,
                                    Diagnostics& findings);
bool expect(const YamlNode& node, YamlNode::Kind kind, Diagnostics& findings);
/// The words of the value, each of which is to be a byte of two hexadecimal digits; no byte at all
/// where one of them is not.
Bytes to_bytes(const YamlNode& node, const std::vector<std::string_view>& words,
               Diagnostics& findings);

/// A whole integer with an optional minus sign, such as the key of a label.
std::optional<std::int64_t> parse_integer(std::string_view text);

/// "unknown WHAT 'TEXT', did you mean …" for a word out of a fixed list.
std::string unknown_word(std::string_view what, std::string_view text,
                         const std::vector<std::string>& words);

/// Reads a map key by key. Every key asked for is a known one; finish() reports the others.
class YamlMap {
 public:
  /// `defaults` is asked for keys that are not in the map itself; may be null.
  YamlMap(const YamlNode& map, Diagnostics& findings, const YamlNode* defaults = nullptr);

  /// The value; null when it is not there, with a finding when it is required.
  const YamlNode* get(std::string_view key, Need need = Need::optional);

  std::optional<std::string> text(std::string_view key, Need need = Need::optional);
  std::optional<Decimal> decimal(std::string_view key);
  std::optional<Duration> duration(std::string_view key);
  std::optional<bool> flag(std::string_view key);
  std::optional<NumberRange> range(std::string_view key, std::uint64_t maximum,
                                   Need need = Need::optional);

  template <typename Number>
  std::optional<Number> number(std::string_view key, Need need = Need::optional) {
    const auto read = number_up_to(key, std::numeric_limits<Number>::max(), need);
    if (!read) return std::nullopt;
    return static_cast<Number>(*read);
  }

  /// A word of the table; `what` it is, for the finding about another one.
  template <typename Meaning, std::size_t count>
  std::optional<Meaning> word(std::string_view key, std::string_view what,
                              const EnumTable<Meaning, count>& words, Need need = Need::optional) {
    const YamlNode* node = get(key, need);
    if (node == nullptr) return std::nullopt;
    const auto read = to_text(*node, findings_);
    if (!read) return std::nullopt;
    const auto meant = words.find(*read);
    if (!meant) findings_.add(node->at, unknown_word(what, *read, words.words()));
    return meant;
  }

  /// Marks a key as known that is read elsewhere.
  void allow(std::string_view key) { known_.push_back(key); }

  /// Reports the keys that were not asked for.
  void finish();

  [[nodiscard]] const YamlNode& node() const { return map_; }
  [[nodiscard]] Diagnostics& findings() const { return findings_; }

 private:
  std::optional<std::uint64_t> number_up_to(std::string_view key, std::uint64_t maximum, Need need);

  const YamlNode& map_;
  const YamlNode* defaults_;
  Diagnostics& findings_;
  std::vector<std::string_view> known_;
};

/// Overwrites the target only when there is a value: how a profile overrides its base.
template <typename Target, typename Source>
void assign(Target& target, std::optional<Source>&& source) {
  if (source) target = std::move(*source);
}

}  // namespace spindle::files
