#pragma once

#include <tuple>
#include <type_traits>

#include "files/value_reader.hpp"
#include "spindle/base/enum_table.hpp"

namespace spindle::files {

// The keys of a map are the rows of one table. It is what the map is read by, and what the manual
// lists:
//
//   constexpr Field<Mast> mast_fields[] = {
//       field<&Mast::height>("height", Need::required),
//       word<colour_words, &Mast::paint, &Paint::colour>("colour"),
//       list_of<flag_fields, &Mast::flags>("flags"),
//       custom("stay", Need::optional, "text", read_stay),
//   };

/// A key, and how its value is read into a target.
template <typename T>
struct Field {
  using Target = T;
  Key key;
  void (*read)(const YamlNode& value, T& target, const Asked& asked) = nullptr;

  /// The same key, which a group may have for all its fields.
  [[nodiscard]] constexpr Field shared() const {
    Field copy = *this;
    copy.key.shared = true;
    return copy;
  }
  /// The same key, whose value has these keys.
  [[nodiscard]] constexpr Field with(std::vector<Key> (*inner)()) const {
    Field copy = *this;
    copy.key.inner = inner;
    return copy;
  }
};

/// Reads one key; whether it is there.
template <typename T>
bool read_field(const Field<T>& field, YamlMap& map, T& target, bool inherited = false) {
  const Key& key = field.key;
  const bool required = key.need == Need::required || (key.need == Need::inherited && !inherited);
  map.know(key.name);
  const YamlNode* node =
      required ? map.require(key.name, key.shared) : map.find(key.name, key.shared);
  if (node == nullptr) return false;
  field.read(*node, target, {key, map.node(), required, inherited, map.findings()});
  return true;
}

template <typename T, std::size_t count>
void read_fields(const Field<T> (&fields)[count], YamlMap& map, T& target, bool inherited = false) {
  for (const Field<T>& field : fields) read_field(field, map, target, inherited);
}

/// Reads a map that has no other keys.
template <typename T, std::size_t count>
void read_map(const Field<T> (&fields)[count], const YamlNode& node, T& target,
              Diagnostics& findings, bool inherited = false) {
  YamlMap map(node, findings);
  read_fields(fields, map, target, inherited);
  map.finish();
}

/// What is made by its first layer.
template <typename T, std::size_t count>
void read_map(const Field<T> (&fields)[count], const YamlNode& node, std::optional<T>& target,
              Diagnostics& findings, bool = false) {
  const bool inherited = target.has_value();
  if (!inherited) target.emplace();
  read_map(fields, node, *target, findings, inherited);
}

/// The keys of these tables, one behind the other.
template <const auto&... tables>
std::vector<Key> keys_of() {
  std::vector<Key> keys;
  const auto add = [&](const auto& fields) {
    for (const auto& field : fields) keys.push_back(field.key);
  };
  (add(tables), ...);
  return keys;
}

// ---- rows: each is told by pointers to members, the outermost first, what it is read into ----

template <auto... path>
struct Path;
template <typename T, typename M, M T::*first, auto... rest>
struct Path<first, rest...> {
  using Outer = T;
  static auto& in(T& outer) {
    if constexpr (sizeof...(rest) == 0) {
      return outer.*first;
    } else {
      return Path<rest...>::in(outer.*first);
    }
  }
};

template <const auto& fields>
using TargetOf = typename std::remove_cvref_t<decltype(fields[0])>::Target;
template <auto... path>
using OuterOf = typename Path<path...>::Outer;
template <auto... path>
using MemberOf =
    std::remove_reference_t<decltype(Path<path...>::in(std::declval<OuterOf<path...>&>()))>;

/// A row whose value is read into a member.
template <auto... path, typename Read>
constexpr auto row(const Key& key, Read) {
  using T = OuterOf<path...>;
  return Field<T>{key, [](const YamlNode& node, T& target, const Asked& asked) {
                    Read{}(node, Path<path...>::in(target), asked);
                  }};
}

/// A value of the member's own type.
template <auto... path>
constexpr auto field(std::string_view name, Need need = Need::optional) {
  return row<path...>({name, need, value_name<MemberOf<path...>>},
                      [](const YamlNode& node, auto& member, const Asked& asked) {
                        read_value(node, member, asked);
                      });
}

/// A value of another type, which the member can be made of.
template <typename As, auto... path>
constexpr auto field_as(std::string_view name, Need need = Need::optional) {
  return row<path...>({name, need, value_name<As>},
                      [](const YamlNode& node, auto& member, const Asked& asked) {
                        read_as<As>(node, member, asked);
                      });
}

/// A range whose ends are two members.
template <auto first, auto last>
constexpr auto range(std::string_view name, Need need = Need::optional) {
  using T = OuterOf<first>;
  using Ends = std::pair<MemberOf<first>, MemberOf<last>>;
  return Field<T>{{name, need, value_name<Ends>},
                  [](const YamlNode& node, T& target, const Asked& asked) {
                    Ends ends{target.*first, target.*last};
                    read_value(node, ends, asked);
                    std::tie(target.*first, target.*last) = ends;
                  }};
}

template <typename E, std::size_t count>
void read_word(const EnumTable<E, count>& words, const YamlNode& node, auto& target,
               const Asked& asked) {
  const auto text = to_text(node, asked.findings);
  if (!text) return;
  if (const auto meant = words.find(*text)) {
    target = *meant;
  } else {
    const std::string_view what = asked.key.what.empty() ? asked.key.name : asked.key.what;
    asked.findings.add(node.at, unknown_word(what, *text, words.words()));
  }
}

/// A word of the table; `what` it is, for the finding about another one.
template <const auto& words, auto... path>
constexpr auto word(std::string_view name, Need need = Need::optional, std::string_view what = {}) {
  return row<path...>(
      {.name = name, .need = need, .words = [] { return words.words(); }, .what = what},
      [](const YamlNode& node, auto& member, const Asked& asked) {
        read_word(words, node, member, asked);
      });
}

/// A list of numbers of this type.
template <typename Number, auto... path>
constexpr auto numbers(std::string_view name, Need need = Need::optional) {
  return row<path...>({name, need, "list of numbers"},
                      [](const YamlNode& node, auto& member, const Asked& asked) {
                        member = to_numbers<Number>(node, asked.findings);
                      });
}

/// A map with keys of its own.
template <const auto& fields, auto... path>
constexpr auto map_of(std::string_view name, Need need = Need::optional) {
  return row<path...>({.name = name, .need = need, .value = "map", .inner = keys_of<fields>},
                      [](const YamlNode& node, auto& member, const Asked& asked) {
                        read_map(fields, node, member, asked.findings, asked.inherited);
                      });
}

/// The same, read into the target itself.
template <const auto& fields>
constexpr auto map_here(std::string_view name, Need need = Need::optional) {
  using T = TargetOf<fields>;
  return Field<T>{{.name = name, .need = need, .value = "map", .inner = keys_of<fields>},
                  [](const YamlNode& node, T& target, const Asked& asked) {
                    read_map(fields, node, target, asked.findings, asked.inherited);
                  }};
}

/// A list of such maps.
template <const auto& fields, auto... path>
constexpr auto list_of(std::string_view name, Need need = Need::optional) {
  return row<path...>(
      {.name = name, .need = need, .value = "list of maps", .inner = keys_of<fields>},
      [](const YamlNode& node, auto& member, const Asked& asked) {
        expect(node, YamlNode::Kind::sequence, asked.findings);
        std::vector<TargetOf<fields>> items;
        for (const YamlNode& item : node.items) {
          read_map(fields, item, items.emplace_back(), asked.findings);
        }
        member = std::move(items);
      });
}

/// What no other row can say.
template <typename T>
constexpr Field<T> custom(std::string_view name, Need need, std::string_view value,
                          void (*read)(const YamlNode&, T&, const Asked&)) {
  return {{.name = name, .need = need, .value = value}, read};
}

}  // namespace spindle::files
