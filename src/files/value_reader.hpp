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

/// How values are read into one type: `value` names them for people; read() says whether the target
/// has got one, and leaves it as it was beside a finding.
template <typename T>
struct ValueReader;

template <std::unsigned_integral T>
struct ValueReader<T> {
  static constexpr std::string_view value = sizeof(T) == 1   ? "number 0..255"
                                            : sizeof(T) == 2 ? "number 0..65535"
                                                             : "number 0..4294967295";
  static bool read(const YamlNode& node, T& target, const Asked& asked) {
    const auto number = to_unsigned(node, std::numeric_limits<T>::max(), asked.findings);
    if (number) target = static_cast<T>(*number);
    return number.has_value();
  }
};

template <>
struct ValueReader<bool> {
  static constexpr std::string_view value = "true | false";
  static bool read(const YamlNode& node, bool& target, const Asked& asked);
};

template <>
struct ValueReader<Decimal> {
  static constexpr std::string_view value = "decimal number";
  static bool read(const YamlNode& node, Decimal& target, const Asked& asked);
};

template <>
struct ValueReader<Duration> {
  static constexpr std::string_view value = "duration";
  static bool read(const YamlNode& node, Duration& target, const Asked& asked);
};

/// One that is required is not empty.
template <>
struct ValueReader<std::string> {
  static constexpr std::string_view value = "text";
  static bool read(const YamlNode& node, std::string& target, const Asked& asked);
};

/// Read by another type of value.
template <typename As, typename T>
bool read_as(const YamlNode& node, T& target, const Asked& asked) {
  As read = {};
  const bool is_read = ValueReader<As>::read(node, read, asked);
  if (is_read) target = T(std::move(read));
  return is_read;
}

template <>
struct ValueReader<catalogue::Text> : ValueReader<std::string> {
  static bool read(const YamlNode& node, catalogue::Text& target, const Asked& asked) {
    return read_as<std::string>(node, target, asked);
  }
};

template <>
struct ValueReader<modbus::RegisterAddress> : ValueReader<std::uint16_t> {
  static bool read(const YamlNode& node, modbus::RegisterAddress& target, const Asked& asked) {
    return ValueReader<std::uint16_t>::read(node, target.value, asked);
  }
};

/// Both ends are numbers of the type.
template <std::unsigned_integral T>
struct ValueReader<std::pair<T, T>> {
  static constexpr std::string_view value = sizeof(T) == 1 ? "range 0..255" : "range 0..65535";
  static bool read(const YamlNode& node, std::pair<T, T>& target, const Asked& asked) {
    const auto range = to_range(node, std::numeric_limits<T>::max(), asked.findings);
    if (range) target = {static_cast<T>(range->from), static_cast<T>(range->to)};
    return range.has_value();
  }
};

template <typename T>
struct ValueReader<std::optional<T>> : ValueReader<T> {
  static bool read(const YamlNode& node, std::optional<T>& target, const Asked& asked) {
    return read_as<T>(node, target, asked);
  }
};

template <>
struct ValueReader<catalogue::List<catalogue::Text>> {
  static constexpr std::string_view value = "list of text";
  static bool read(const YamlNode& node, catalogue::List<catalogue::Text>& target,
                   const Asked& asked);
};

/// A node that is read later.
template <>
struct ValueReader<const YamlNode*> {
  static constexpr std::string_view value = "map";
  static bool read(const YamlNode& node, const YamlNode*& target, const Asked&) {
    target = &node;
    return true;
  }
};

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
