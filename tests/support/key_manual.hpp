#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include "files/known_keys.hpp"
#include "support/key_examples.hpp"
#include "support/manual.hpp"

/// The keys of a kind of file as mdoc(7) text.
namespace spindle::test {

/// "one of: tcp, rtu" where the value is a word.
inline std::string value_of(const files::Key& key) {
  if (key.words == nullptr) return std::string(key.value);
  return fmt::format("one of: {}", fmt::join(key.words(), ", "));
}

inline std::string_view need_of(const files::Key& key) {
  switch (key.need) {
    case files::Need::required:
      return "yes";
    case files::Need::inherited:
      return "here or in a base";
    case files::Need::optional:
      break;
  }
  return {};
}

/// The text of a cell that is filled, with an example in italics.
inline std::string filled(const std::string& text, const std::string& example) {
  std::string lines = mdoc_prose(example.empty() ? text : text + ", such as");
  if (!example.empty()) {
    std::string shown = mdoc_prose(example);
    shown.pop_back();  // the last line's end
    lines += fmt::format("\\fI{}\\fR\n", shown);
  }
  return lines;
}

/// A row for each key with an example; below one that has a map the keys of that map.
inline std::string key_rows(const std::vector<files::Key>& keys, const Nodes& maps,
                            std::vector<std::string>& without, const std::string& path,
                            std::string_view indent = {}) {
  constexpr std::string_view step = "\\ \\ ";
  std::string rows;
  for (const files::Key& key : keys) {
    const std::string example = KeyExamples::example(maps, key.name);
    if (example.empty()) without.push_back(fmt::format("{}.{}", path, key.name));
    rows +=
        fmt::format("{}\\fB{}\\fR|{}|T{{\n{}T}}\n", indent, mdoc_escaped(key.name), need_of(key),
                    filled(value_of(key), key.inner == nullptr ? example : std::string()));
    if (key.inner != nullptr) {
      const std::vector<files::Key> keys_inside = key.inner();
      Nodes inside;
      for (const files::YamlNode* map : maps)
        if (const files::YamlNode* value = map->find(key.name))
          add_maps_with(keys_inside, *value, inside);
      rows += key_rows(keys_inside, inside, without, fmt::format("{}.{}", path, key.name),
                       fmt::format("{}{}", indent, step));
    }
  }
  return rows;
}

/// "KEYS_ALARM_LISTS" for the list "alarm-lists".
inline std::string name_of_keys(std::string_view map) {
  std::string name = "KEYS_";
  for (const char c : map) {
    name += c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return name;
}

inline std::string key_list(const files::KeyList& list, const KeyExamples& examples,
                            std::vector<std::string>& without) {
  return fmt::format(
      ".Pp\nKeys of\n.Ic {} :\n"
      ".nh\n.TS\ntab(|);\nlb lb lbx\nl l lx.\nKey|Needed|Value, with an example\n{}.TE\n.hy\n",
      mdoc_argument(list.map), key_rows(list.keys, examples.maps(list.map), without, list.map));
}

/// What a group of parameters may say for all of them.
inline std::string group_keys(const std::vector<files::Key>& keys) {
  std::vector<std::string> names;
  for (const files::Key& key : keys) {
    if (key.shared) names.push_back(".Ic " + mdoc_argument(key.name));
  }
  return fmt::format("{} .\n", fmt::join(names, " ,\n"));
}

/// The placeholders for each list of the profile's keys, and GROUP_KEYS. Keys that no file has an
/// example of are told in `without`.
inline std::vector<Placeholder> key_placeholders(const KeyExamples& examples,
                                                 std::vector<std::string>& without) {
  std::vector<Placeholder> placeholders;
  for (const files::KeyList& list : files::profile_keys()) {
    placeholders.push_back({name_of_keys(list.map), key_list(list, examples, without)});
    if (list.map == "parameters") placeholders.push_back({"GROUP_KEYS", group_keys(list.keys)});
  }
  return placeholders;
}

}  // namespace spindle::test
