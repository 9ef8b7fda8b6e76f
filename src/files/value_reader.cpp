#include "files/value_reader.hpp"

#include <fmt/format.h>

#include "spindle/base/duration.hpp"

namespace spindle::files {

bool read_value(const YamlNode& node, bool& target, const Asked& asked) {
  if (!expect(node, YamlNode::Kind::scalar, asked.findings)) return false;
  const bool is_true = node.text == "true";
  if (!is_true && node.text != "false") {
    asked.findings.add(node.at, fmt::format("'{}' is neither true nor false", node.text));
    return false;
  }
  target = is_true;
  return true;
}

bool read_value(const YamlNode& node, Decimal& target, const Asked& asked) {
  if (!expect(node, YamlNode::Kind::scalar, asked.findings)) return false;
  const auto number = Decimal::parse(node.text);
  if (!number) {
    asked.findings.add(node.at, fmt::format("'{}' is not a number", node.text));
    return false;
  }
  target = *number;
  return true;
}

bool read_value(const YamlNode& node, Duration& target, const Asked& asked) {
  if (!expect(node, YamlNode::Kind::scalar, asked.findings)) return false;
  const auto read = parse_duration(node.text);
  if (!read) {
    asked.findings.add(node.at,
                       fmt::format("'{}' is not a duration such as 500ms or 2s", node.text));
    return false;
  }
  target = *read;
  return true;
}

bool read_value(const YamlNode& node, std::string& target, const Asked& asked) {
  auto text = to_text(node, asked.findings);
  if (!text) return false;
  if (asked.required && text->empty()) {
    asked.findings.add(node.at, fmt::format("key '{}' is empty", asked.key.name));
  }
  target = std::move(*text);
  return true;
}

bool read_value(const YamlNode& node, catalogue::List<catalogue::Text>& target,
                const Asked& asked) {
  expect(node, YamlNode::Kind::sequence, asked.findings);
  std::vector<catalogue::Text> texts;
  for (const YamlNode& item : node.items) {
    if (auto text = to_text(item, asked.findings)) texts.emplace_back(std::move(*text));
  }
  target = std::move(texts);
  return true;
}

bool read_value(const YamlNode& node, catalogue::Text& target, const Asked& asked) {
  return read_as<std::string>(node, target, asked);
}

bool read_value(const YamlNode& node, modbus::RegisterAddress& target, const Asked& asked) {
  return read_value(node, target.value, asked);
}

bool read_value(const YamlNode& node, const YamlNode*& target, const Asked&) {
  target = &node;
  return true;
}

}  // namespace spindle::files
