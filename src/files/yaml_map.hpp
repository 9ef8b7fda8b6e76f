#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "files/yaml_reader.hpp"
#include "spindle/base/bytes.hpp"

namespace spindle::files {

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

/// Looks keys up in a map, and tells which of its keys are unknown.
class YamlMap {
 public:
  /// `group` and then `file` are what keys that may be shared are looked up in where the map itself
  /// has none; both may be null.
  YamlMap(const YamlNode& map, Diagnostics& findings, const YamlNode* group = nullptr,
          const YamlNode* file = nullptr);

  void know(std::string_view key) { known_.push_back(key); }
  /// The value of a key; null when it is not there.
  [[nodiscard]] const YamlNode* find(std::string_view key, bool shared = false) const;
  /// The same, with a finding when it is not there.
  const YamlNode* require(std::string_view key, bool shared = false);

  /// Reports the keys that are not known.
  void finish();

  [[nodiscard]] const YamlNode& node() const { return map_; }
  [[nodiscard]] Diagnostics& findings() const { return findings_; }

 private:
  const YamlNode& map_;
  const YamlNode* group_;
  const YamlNode* file_;
  Diagnostics& findings_;
  std::vector<std::string_view> known_;
};

}  // namespace spindle::files
