#include "files/yaml_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "spindle/base/text.hpp"

namespace spindle::files {
namespace {

std::string_view describe(YamlNode::Kind kind) {
  switch (kind) {
    case YamlNode::Kind::nothing:
      return "nothing";
    case YamlNode::Kind::scalar:
      return "a single value";
    case YamlNode::Kind::sequence:
      return "a list";
    case YamlNode::Kind::map:
      break;
  }
  return "a mapping of keys to values";
}

}  // namespace

bool expect(const YamlNode& node, YamlNode::Kind kind, Diagnostics& findings) {
  if (node.kind == kind) return true;
  findings.add(node.at,
               fmt::format("{} is expected here, not {}", describe(kind), describe(node.kind)));
  return false;
}

std::optional<std::string> to_text(const YamlNode& node, Diagnostics& findings) {
  if (!expect(node, YamlNode::Kind::scalar, findings)) return std::nullopt;
  return node.text;
}

std::optional<std::uint64_t> to_unsigned(const YamlNode& node, std::uint64_t maximum,
                                         Diagnostics& findings) {
  if (!expect(node, YamlNode::Kind::scalar, findings)) return std::nullopt;
  const auto number = parse_unsigned(node.text, maximum);
  if (!number) {
    findings.add(node.at,
                 fmt::format("'{}' is not a whole number from 0 to {}", node.text, maximum));
  }
  return number;
}

std::optional<NumberRange> to_range(const YamlNode& node, std::uint64_t maximum,
                                    Diagnostics& findings) {
  if (!expect(node, YamlNode::Kind::scalar, findings)) return std::nullopt;
  const std::string_view text = node.text;
  const std::size_t dots = text.find("..");
  const auto from = parse_unsigned(text.substr(0, dots), maximum);
  const auto to =
      dots == std::string_view::npos ? from : parse_unsigned(text.substr(dots + 2), maximum);
  if (!from || !to || *from > *to) {
    findings.add(node.at,
                 fmt::format("'{}' is not a range such as 1..15, at most up to {}", text, maximum));
    return std::nullopt;
  }
  return NumberRange{*from, *to};
}

Bytes to_bytes(const YamlNode& node, const std::vector<std::string_view>& words,
               Diagnostics& findings) {
  constexpr std::uint64_t last_byte = std::numeric_limits<std::uint8_t>::max();
  Bytes bytes;
  if (!expect(node, YamlNode::Kind::scalar, findings)) return bytes;
  for (const std::string_view pair : words) {
    const auto byte =
        pair.size() == 2 ? parse_unsigned(fmt::format("0x{}", pair), last_byte) : std::nullopt;
    if (!byte) {
      findings.add(node.at, fmt::format("'{}' is not a byte of two hexadecimal digits", pair));
      return {};
    }
    bytes.push_back(static_cast<std::uint8_t>(*byte));
  }
  return bytes;
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  const auto magnitude = parse_unsigned(text, std::numeric_limits<std::uint32_t>::max());
  if (!magnitude) return std::nullopt;
  const auto number = static_cast<std::int64_t>(*magnitude);
  return negative ? -number : number;
}

std::string unknown_word(std::string_view what, std::string_view text,
                         const std::vector<std::string>& words) {
  // Another encoding or unit is another number, so only a spelling is mended.
  const bool exact = what == "encoding" || what.ends_with("unit");
  const std::string hint = exact ? same_word(text, words) : suggestion(text, words);
  if (!hint.empty()) return fmt::format("unknown {} '{}'; {}", what, text, hint);
  return fmt::format("unknown {} '{}'; known: {}", what, text, fmt::join(words, ", "));
}

YamlMap::YamlMap(const YamlNode& map, Diagnostics& findings, const YamlNode* group,
                 const YamlNode* file)
    : map_(map), group_(group), file_(file), findings_(findings) {
  expect(map, YamlNode::Kind::map, findings);
}

const YamlNode* YamlMap::find(std::string_view key, bool shared) const {
  const YamlNode* node = map_.find(key);
  for (const YamlNode* outer : {group_, file_}) {
    if (node == nullptr && shared && outer != nullptr) node = outer->find(key);
  }
  return node;
}

const YamlNode* YamlMap::require(std::string_view key, bool shared) {
  const YamlNode* node = find(key, shared);
  if (node == nullptr && map_.kind == YamlNode::Kind::map) {
    findings_.add(map_.at, fmt::format("key '{}' is missing", key));
  }
  return node;
}

void YamlMap::finish() {
  for (const YamlEntry& entry : map_.entries) {
    if (std::find(known_.begin(), known_.end(), entry.key) != known_.end()) continue;
    const std::vector<std::string> words(known_.begin(), known_.end());
    findings_.add(entry.key_at, unknown_word("key", entry.key, words));
  }
}

}  // namespace spindle::files
