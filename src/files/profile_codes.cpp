#include "files/profile_codes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

#include "spindle/base/text.hpp"

namespace spindle::files {
namespace {

using catalogue::CodeText;
using catalogue::Resettable;

using Codes = std::map<std::int64_t, CodeText>;

constexpr std::uint64_t last_code = std::numeric_limits<std::uint16_t>::max();

constexpr auto reset_words = enum_table<Resettable>(
    {{"possible", Resettable::yes}, {"power-cycle", Resettable::no}, {"", Resettable::unknown}});

constexpr auto completion_words =
    enum_table<catalogue::Completion>({{"true", catalogue::Completion::yes},
                                       {"false", catalogue::Completion::no},
                                       {"", catalogue::Completion::unknown}});

constexpr Field<CodeText> code_fields[] = {
    field<&CodeText::text>("text", Need::required),
    field<&CodeText::remedy>("remedy"),
    word<catalogue::evidence_words, &CodeText::evidence>("evidence"),
    field<&CodeText::source>("source"),
    word<reset_words, &CodeText::resettable>("reset"),
    word<completion_words, &CodeText::completed>("completed"),
};

/// A map of a list.
struct CodeList {
  CodeText common = {};  ///< to all of its texts
  const YamlNode* codes = nullptr;
};

constexpr Field<CodeList> code_list_fields[] = {
    word<catalogue::evidence_words, &CodeList::common, &CodeText::evidence>("evidence",
                                                                            Need::required),
    field<&CodeList::common, &CodeText::source>("source", Need::required),
    field<&CodeList::codes>("codes", Need::required).with(keys_of<code_fields>),
};

std::optional<CodeText> read_code_text(const YamlNode& node, CodeText code, Diagnostics& findings) {
  if (node.kind == YamlNode::Kind::map) {
    read_map(code_fields, node, code, findings);
    return code;
  }
  auto text = to_text(node, findings);
  if (!text) return std::nullopt;
  code.text = std::move(*text);
  return code;
}

void read_code_map(const YamlNode& node, const CodeText& common, Codes& codes,
                   Diagnostics& findings) {
  expect(node, YamlNode::Kind::map, findings);
  std::vector<std::int64_t> seen;
  for (const YamlEntry& entry : node.entries) {
    const auto number = parse_unsigned(entry.key, last_code);
    if (!number) {
      findings.add(entry.key_at,
                   fmt::format("'{}' is not a code from 0 to {}", entry.key, last_code));
      continue;
    }
    const auto code = static_cast<std::int64_t>(*number);
    if (std::find(seen.begin(), seen.end(), code) != seen.end()) {
      findings.add(entry.key_at, fmt::format("code {} is given twice", entry.key));
    }
    seen.push_back(code);
    auto text = read_code_text(entry.value, common, findings);
    if (text) codes.insert_or_assign(code, std::move(*text));
  }
}

}  // namespace

bool read_value(const YamlNode& node, catalogue::CodeTexts& target, const Asked& asked) {
  Codes codes = target.to_map();
  if (node.kind == YamlNode::Kind::sequence) {
    for (const YamlNode& item : node.items) {
      CodeList list;
      read_map(code_list_fields, item, list, asked.findings);
      if (list.codes != nullptr) read_code_map(*list.codes, list.common, codes, asked.findings);
    }
  } else {
    read_code_map(node, {}, codes, asked.findings);
  }
  target = std::move(codes);
  return true;
}

std::vector<Key> code_list_keys() { return keys_of<code_list_fields>(); }

}  // namespace spindle::files
