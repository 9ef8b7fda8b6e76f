#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "files/yaml_map.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/base/decimal.hpp"
#include "spindle/catalogue/list.hpp"
#include "spindle/catalogue/text.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::files {

enum class Need : std::uint8_t {
  optional,
  required,
  inherited,  ///< required of the first layer of a profile that says anything of its section
};

/// What people are told of a key.
struct Key {
  std::string_view name;
  Need need = Need::optional;
  std::string_view value = {};                    ///< "number 0..255", "list of maps"
  std::vector<std::string> (*words)() = nullptr;  ///< or one of these
  std::vector<Key> (*inner)() = nullptr;          ///< keys of the map, or of each map of the list
  std::string_view what = {};                     ///< a wrong word is called; empty: as the key
  bool shared = false;                            ///< a group may have it for all its fields
};

/// The value of a key: where it stands, and what is asked of it.
struct Asked {
  const Key& key;
  const YamlNode& map;
  bool required;
  bool inherited;  ///< an earlier layer has said what Need::inherited asks for
  Diagnostics& findings;
};

// ---- values: what they are for people, and an overload of read_value() for each type, which says
// whether the target has got it; beside a finding the target stays as it was ----

template <typename T>
inline constexpr std::string_view value_name = "map";
template <std::unsigned_integral T>
inline constexpr std::string_view value_name<T> = sizeof(T) == 1   ? "number 0..255"
                                                  : sizeof(T) == 2 ? "number 0..65535"
                                                                   : "number 0..4294967295";
template <std::unsigned_integral T>
inline constexpr std::string_view value_name<std::pair<T, T>> = sizeof(T) == 1 ? "range 0..255"
                                                                               : "range 0..65535";
template <typename T>
inline constexpr std::string_view value_name<std::optional<T>> = value_name<T>;
template <>
inline constexpr std::string_view value_name<bool> = "true | false";
template <>
inline constexpr std::string_view value_name<Decimal> = "decimal number";
template <>
inline constexpr std::string_view value_name<Duration> = "duration";
template <>
inline constexpr std::string_view value_name<std::string> = "text";
template <>
inline constexpr std::string_view value_name<catalogue::Text> = "text";
template <>
inline constexpr std::string_view value_name<catalogue::List<catalogue::Text>> = "list of text";
template <>
inline constexpr std::string_view value_name<modbus::RegisterAddress> = "number 0..65535";

bool read_value(const YamlNode& node, bool& target, const Asked& asked);
bool read_value(const YamlNode& node, Decimal& target, const Asked& asked);
bool read_value(const YamlNode& node, Duration& target, const Asked& asked);
/// One that is required is not empty.
bool read_value(const YamlNode& node, std::string& target, const Asked& asked);
bool read_value(const YamlNode& node, catalogue::Text& target, const Asked& asked);
bool read_value(const YamlNode& node, catalogue::List<catalogue::Text>& target, const Asked& asked);
bool read_value(const YamlNode& node, modbus::RegisterAddress& target, const Asked& asked);
/// What is read later.
bool read_value(const YamlNode& node, const YamlNode*& target, const Asked& asked);

template <std::unsigned_integral T>
bool read_value(const YamlNode& node, T& target, const Asked& asked) {
  const auto number = to_unsigned(node, std::numeric_limits<T>::max(), asked.findings);
  if (number) target = static_cast<T>(*number);
  return number.has_value();
}

/// A range.
template <std::unsigned_integral T>
bool read_value(const YamlNode& node, std::pair<T, T>& target, const Asked& asked) {
  const auto range = to_range(node, std::numeric_limits<T>::max(), asked.findings);
  if (range) target = {static_cast<T>(range->from), static_cast<T>(range->to)};
  return range.has_value();
}

/// Read as a value of another type.
template <typename As, typename T>
bool read_as(const YamlNode& node, T& target, const Asked& asked) {
  As read = {};
  const bool is_read = read_value(node, read, asked);
  if (is_read) target = T(std::move(read));
  return is_read;
}

template <typename T>
bool read_value(const YamlNode& node, std::optional<T>& target, const Asked& asked) {
  return read_as<T>(node, target, asked);
}

/// The items of a list that are numbers of this type.
template <std::unsigned_integral T>
std::vector<std::int64_t> to_numbers(const YamlNode& node, Diagnostics& findings) {
  expect(node, YamlNode::Kind::sequence, findings);
  std::vector<std::int64_t> numbers;
  for (const YamlNode& item : node.items) {
    const auto number = to_unsigned(item, std::numeric_limits<T>::max(), findings);
    if (number) numbers.push_back(static_cast<std::int64_t>(*number));
  }
  return numbers;
}

}  // namespace spindle::files
