#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/manual.hpp"

/// The JSON Schema of the output as mdoc(7) text.
namespace spindle::test {

using nlohmann::ordered_json;

/// A key of the schema with what it refers to; its own words win.
inline ordered_json resolved(const ordered_json& key, const ordered_json& schema) {
  const auto reference = key.find("$ref");
  if (reference == key.end()) return key;
  constexpr std::size_t fragment = 1;  // behind '#'
  ordered_json whole =
      schema.at(ordered_json::json_pointer(reference->get<std::string>().substr(fragment)));
  whole.update(key);
  return whole;
}

inline std::string joined(const std::vector<std::string>& words, std::string_view last) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? fmt::format(" {} ", last) : ", ";
    text += words[i];
  }
  return text;
}

inline std::string bare(const ordered_json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// "number or null", "array of text", "text".
inline std::string kind_of(const ordered_json& key) {
  const auto plain = [](const std::string& kind) { return kind == "string" ? "text" : kind; };
  const ordered_json type = key.value("type", ordered_json("string"));
  if (key.contains("enum") && !key.at("enum").front().is_string()) return "integer";
  if (key.contains("const") && key.at("const").is_boolean()) return "boolean";
  const auto of = [&](const std::string& kind) {
    return kind == "array" && key.contains("items") ? "array of " + kind_of(key.at("items"))
                                                    : plain(kind);
  };
  if (type.is_string()) return key.contains("items") ? of("array") : plain(type);
  std::vector<std::string> kinds;
  for (const auto& kind : type) kinds.push_back(of(kind));
  return joined(kinds, "or");
}

inline bool is_named(const ordered_json& definition, const std::string& key) {
  const auto has = [&](const ordered_json& holder) {
    const auto required = holder.find("required");
    return required != holder.end() &&
           std::find(required->begin(), required->end(), key) != required->end();
  };
  const ordered_json variants = definition.value("anyOf", ordered_json::array());
  return has(definition) || std::any_of(variants.begin(), variants.end(), has);
}

inline std::string choices_of(const ordered_json& key) {
  if (key.contains("const")) return fmt::format(" Always {}.", bare(key.at("const")));
  if (!key.contains("enum")) return {};
  std::vector<std::string> words;
  for (const auto& word : key.at("enum")) words.push_back(bare(word));
  return fmt::format(" One of {}.", joined(words, "or"));
}

/// The keys of a definition. One that only narrows what every object has says nothing new.
inline std::string keys_text(const ordered_json& definition, const ordered_json& schema) {
  std::string text;
  for (const auto& [name, own] : definition.at("properties").items()) {
    const ordered_json key = resolved(own, schema);
    if (!key.contains("description")) continue;
    text += fmt::format(".It Sy {} Pq {}{}\n", mdoc_argument(name), mdoc_argument(kind_of(key)),
                        is_named(definition, name) ? "" : " , optional");
    text += mdoc_prose(key.at("description").get<std::string>() + choices_of(key));
  }
  return fmt::format(".Bl -tag -width Ds -compact\n{}.El\n", text);
}

/// Which keys stand together, of a type that has several forms.
inline std::string forms_text(const ordered_json& definition) {
  if (!definition.contains("anyOf")) return {};
  std::string items;
  for (const auto& form : definition.at("anyOf")) {
    const auto keys = form.at("required").get<std::vector<std::string>>();
    items +=
        fmt::format(".It\n{}", mdoc_prose(fmt::format("{}: {}", form.at("title").get<std::string>(),
                                                      joined(keys, "and"))));
  }
  return ".Pp\nIts forms, and the keys that each always has:\n.Bl -bullet -compact\n" + items +
         ".El\n";
}

/// The placeholders COMMON_KEYS and RECORDS.
inline std::vector<Placeholder> schema_placeholders(const ordered_json& schema) {
  std::string records;
  for (const auto& type : schema.at("properties").at("type").at("enum")) {
    const ordered_json& definition = schema.at("$defs").at(type.get<std::string>());
    records += ".Ss " + mdoc_argument(type.get<std::string>()) + "\n";
    records += mdoc_prose(definition.at("description").get<std::string>());
    records += ".Pp\n" + keys_text(definition, schema) + forms_text(definition);
  }
  return {{"COMMON_KEYS", keys_text(schema, schema)}, {"RECORDS", std::move(records)}};
}

}  // namespace spindle::test
