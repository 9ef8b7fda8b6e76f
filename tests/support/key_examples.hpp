#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "files/known_keys.hpp"
#include "files/yaml_reader.hpp"

/// Examples of keys, out of files that the program itself takes.
namespace spindle::test {

/// A value as YAML on one line. What is longer than that is shortened with "...".
class FlowText {
 public:
  static constexpr std::size_t longest = 48;

  static std::string of(const files::YamlNode& node) {
    std::string text = whole(node);
    return text.size() <= longest ? text : shortened(node);
  }

 private:
  static std::string whole(const files::YamlNode& node) {
    std::vector<std::string> parts;
    if (node.kind == files::YamlNode::Kind::sequence) {
      for (const files::YamlNode& item : node.items) parts.push_back(whole(item));
      return fmt::format("[{}]", fmt::join(parts, ", "));
    }
    if (node.kind == files::YamlNode::Kind::map) {
      for (const files::YamlEntry& entry : node.entries)
        parts.push_back(fmt::format("{}: {}", entry.key, whole(entry.value)));
      return fmt::format("{{{}}}", fmt::join(parts, ", "));
    }
    return scalar(node.text);
  }

  static std::string shortened(const files::YamlNode& node) {
    if (node.kind == files::YamlNode::Kind::sequence && !node.items.empty())
      return fmt::format("[{}, ...]", of(node.items.front()));
    if (node.kind == files::YamlNode::Kind::map && !node.entries.empty()) {
      const files::YamlEntry& first = node.entries.front();
      return fmt::format("{{{}: {}, ...}}", first.key, of(first.value));
    }
    return scalar(node.text.substr(0, node.text.find(' ', longest / 2)) + " ...");
  }

  static std::string scalar(const std::string& text) {
    constexpr std::string_view plain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 ./+-*()";
    const bool is_plain = !text.empty() && text.find_first_not_of(plain) == std::string::npos &&
                          text.front() != '*' && text.front() != ' ' && text.back() != ' ';
    if (is_plain) return text;
    std::string quoted = "\"";
    for (const char c : text)
      quoted += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
    return quoted + '"';
  }
};

using Nodes = std::vector<const files::YamlNode*>;

/// The maps that a value is, or has as a list, also those of a group in it.
inline void add_maps(const files::YamlNode& value, Nodes& maps) {
  if (value.kind == files::YamlNode::Kind::map) maps.push_back(&value);
  for (const files::YamlNode& item : value.items) add_maps(item, maps);
  if (const files::YamlNode* fields = value.find("fields")) add_maps(*fields, maps);
}

/// Those of a value that have one of these keys: itself, or what it has by numbers or names.
inline void add_maps_with(const std::vector<files::Key>& keys, const files::YamlNode& value,
                          Nodes& maps) {
  for (const files::YamlNode& item : value.items) add_maps_with(keys, item, maps);
  const bool has_one = std::any_of(keys.begin(), keys.end(), [&](const files::Key& key) {
    return value.find(key.name) != nullptr;
  });
  if (has_one) maps.push_back(&value);
  for (const files::YamlEntry& entry : value.entries)
    if (!has_one) add_maps_with(keys, entry.value, maps);
}

/// Profiles, to look examples up in.
class KeyExamples {
 public:
  void add(const std::string& text) {
    files::Diagnostics findings;
    const std::size_t file = findings.add_file("example");
    for (files::YamlNode& document : files::parse_yaml(text, file, files::Documents::all, findings))
      (document.find("part") == nullptr ? profiles_ : parts_).push_back(std::move(document));
  }

  /// Every map that is what the manual lists under this name.
  [[nodiscard]] Nodes maps(std::string_view list) const {
    Nodes found;
    if (list == "profile") {
      for (const files::YamlNode& profile : profiles_) found.push_back(&profile);
      return found;
    }
    for (const files::YamlNode& part : parts_)
      if (part.find("part")->text == list) found.push_back(&part);
    for (const files::YamlNode& profile : profiles_) {
      const files::YamlNode* run = profile.find("run");
      const files::YamlNode* model = run == nullptr ? nullptr : run->find("model");
      if (run != nullptr && (model == nullptr ? "command-word" : model->text) == list)
        found.push_back(run);
      collect(profile, list, found);
    }
    return found;
  }

  /// "key: value", the shortest of all; empty where there is none.
  static std::string example(const Nodes& maps, std::string_view key) {
    std::string best;
    for (const files::YamlNode* map : maps) {
      const files::YamlNode* value = map->find(key);
      if (value == nullptr) continue;
      std::string text = fmt::format("{}: {}", key, FlowText::of(*value));
      const bool is_told = value->kind != files::YamlNode::Kind::scalar || !value->text.empty();
      const bool is_ascii = std::all_of(text.begin(), text.end(), [](char c) { return c >= ' '; });
      if (!is_told || !is_ascii) continue;
      const bool is_cut = text.find("...") != std::string::npos;
      const bool best_is_cut = best.find("...") != std::string::npos;
      const auto rank = std::pair(is_cut, text.size());
      if (best.empty() || rank < std::pair(best_is_cut, best.size())) best = std::move(text);
    }
    return best;
  }

 private:
  static void collect(const files::YamlNode& node, std::string_view key, Nodes& found) {
    for (const files::YamlEntry& entry : node.entries) {
      if (entry.key == key) add_maps(entry.value, found);
      collect(entry.value, key, found);
    }
    for (const files::YamlNode& item : node.items) collect(item, key, found);
  }

  std::vector<files::YamlNode> profiles_;
  std::vector<files::YamlNode> parts_;
};

}  // namespace spindle::test
