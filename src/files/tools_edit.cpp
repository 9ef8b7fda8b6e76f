#include "spindle/files/tools_edit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "files/yaml_reader.hpp"
#include "files/yaml_text.hpp"
#include "spindle/base/text.hpp"
#include "spindle/files/tools_file.hpp"

namespace spindle::files {
namespace {

constexpr std::string_view key_of_tools = "tools";
/// Blanks before the first entry of a map.
constexpr std::size_t usual_indent = 2;

Error bad_name(const std::string& name, std::string hint) {
  return {.code = Errc::usage,
          .message = fmt::format("'{}' is no name for a tool", name),
          .hint = std::move(hint)};
}

Result<void> check_name(const NewTool& tool) {
  if (tool.name.find("://") != std::string::npos || tool.name.starts_with('/')) {
    return tl::unexpected(bad_name(tool.name,
                                   "the name comes first, such as 'spindle tools add station3 "
                                   "tcp://192.168.10.23:5000'"));
  }
  if (!may_name_tools(tool.name) || tool.name.starts_with('@')) {
    return tl::unexpected(
        bad_name(tool.name,
                 "it is made of the letters a to z and A to Z, digits, '_', '.' and "
                 "'-', beginning with a letter or digit"));
  }
  return {};
}

Error not_to_be_edited(const NewTool& tool, const std::string& path, std::string why) {
  return {.code = Errc::bad_file,
          .message = std::move(why),
          .hint = fmt::format("add this line by hand: {}", line_of(tool)),
          .name = path};
}

/// A text as lines, each with its end.
std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1);
    lines.emplace_back(text.substr(0, end + 1));
    text.remove_prefix(end + 1);
  }
  return lines;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line;
  return text;
}

std::size_t indent_of(std::string_view line) {
  return std::min(line.find_first_not_of(' '), line.size());
}

bool is_blank(std::string_view line) {
  return line.find_first_not_of(" \t\r\n") == std::string::npos;
}

bool is_comment(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t");
  return first != std::string::npos && line[first] == '#';
}

/// Where the YAML document is over although the text goes on.
bool ends_document(std::string_view line) {
  return line.starts_with("...") || line.starts_with("---");
}

/// The line on which the last value begins that is part of this one; from 0.
std::size_t last_line(const YamlNode& node) {
  if (!node.items.empty()) return last_line(node.items.back());
  if (!node.entries.empty()) return last_line(node.entries.back().value);
  return static_cast<std::size_t>(std::max(node.at.line, 1)) - 1;
}

/// A document, and where its tools are.
struct Place {
  const YamlEntry* tools = nullptr;  ///< null: it has none
  std::size_t end = 0;               ///< the first line that is not about them any more
};

Place place_of(const YamlNode& document, const std::vector<std::string>& lines) {
  Place place{.end = lines.size()};
  for (const YamlEntry& entry : document.entries) {
    const std::size_t line = static_cast<std::size_t>(std::max(entry.key_at.line, 1)) - 1;
    if (place.tools != nullptr) {
      place.end = std::min(place.end, line);
      break;
    }
    if (entry.key == key_of_tools) place.tools = &entry;
  }
  return place;
}

/// The line behind what belongs to the last entry: also a comment that is indented like it.
std::size_t end_of_entries(const Place& place, std::size_t indent,
                           const std::vector<std::string>& lines) {
  std::size_t end = last_line(place.tools->value) + 1;
  bool is_apart = false;
  for (std::size_t at = end; at < place.end && !ends_document(lines[at]); ++at) {
    if (is_blank(lines[at])) {
      is_apart = true;
      continue;
    }
    const bool is_of_another = is_apart || indent_of(lines[at]) < indent;
    if (is_comment(lines[at]) && is_of_another) continue;
    end = at + 1;
    is_apart = false;
  }
  return end;
}

/// Adds lines of an existing text.
class Editor {
 public:
  Editor(std::string_view text, const NewTool& tool)
      : lines_(lines_of(text)),
        line_end_(text.find("\r\n") == std::string_view::npos ? "\n" : "\r\n"),
        tool_(&tool) {}

  /// Empty where no line can be added.
  std::optional<std::string> run(const YamlNode* document) {
    const Place place = document == nullptr ? Place() : place_of(*document, lines_);
    if (place.tools == nullptr) {
      insert(lines_.size(), std::string(key_of_tools) + ":");
      insert(lines_.size(), entry(usual_indent));
      return joined(lines_);
    }
    const YamlNode& tools = place.tools->value;
    const std::size_t line = static_cast<std::size_t>(std::max(place.tools->key_at.line, 1)) - 1;
    if (line >= lines_.size()) return std::nullopt;
    if (tools.kind == YamlNode::Kind::nothing) {
      insert(line + 1, entry(usual_indent));
      return joined(lines_);
    }
    if (tools.kind != YamlNode::Kind::map) return std::nullopt;
    if (tools.entries.empty()) return in_place_of_braces(line);
    const YamlEntry& first = tools.entries.front();
    const std::size_t indent = static_cast<std::size_t>(std::max(first.key_at.column, 1)) - 1;
    const auto first_line = static_cast<std::size_t>(std::max(first.key_at.line, 1)) - 1;
    const bool begins_line =
        first_line < lines_.size() && indent_of(lines_[first_line]) == indent && indent > 0;
    if (!begins_line) return std::nullopt;
    insert(end_of_entries(place, indent, lines_), entry(indent));
    return joined(lines_);
  }

 private:
  [[nodiscard]] std::string entry(std::size_t indent) const {
    return std::string(indent, ' ') + line_of(*tool_);
  }

  /// `tools: {}` becomes `tools:`, with what stands behind it.
  std::optional<std::string> in_place_of_braces(std::size_t line) {
    std::string& text = lines_[line];
    const std::size_t open = text.find('{');
    const std::size_t close = text.find('}');
    const std::size_t comment = text.find('#');
    if (open == std::string::npos || close == std::string::npos || close > comment) {
      return std::nullopt;
    }
    std::size_t begin = open;
    while (begin > 0 && text[begin - 1] == ' ') --begin;
    text.erase(begin, close + 1 - begin);
    insert(line + 1, entry(usual_indent));
    return joined(lines_);
  }

  void insert(std::size_t at, const std::string& line) {
    if (at > 0 && !lines_[at - 1].ends_with('\n')) lines_[at - 1] += line_end_;
    lines_.insert(lines_.begin() + static_cast<std::ptrdiff_t>(at), line + line_end_);
  }

  std::vector<std::string> lines_;
  std::string line_end_;
  const NewTool* tool_;
};

// ---- what is written says what was meant ----

bool same(const YamlNode& a, const YamlNode& b);

bool same(const YamlEntry& a, const YamlEntry& b) {
  return a.key == b.key && same(a.value, b.value);
}

bool same(const YamlNode& a, const YamlNode& b) {
  const auto alike = [](const auto& one, const auto& other) { return same(one, other); };
  return a.kind == b.kind && a.text == b.text &&
         std::equal(a.items.begin(), a.items.end(), b.items.begin(), b.items.end(), alike) &&
         std::equal(a.entries.begin(), a.entries.end(), b.entries.begin(), b.entries.end(), alike);
}

/// Whether `now` is `before` with the new entry behind the others, and nothing else.
bool is_added(const std::vector<YamlNode>& before, std::vector<YamlNode> now, const NewTool& tool) {
  if (now.size() != 1) return false;
  const auto of_tools = [](YamlNode& document) {
    return std::find_if(document.entries.begin(), document.entries.end(),
                        [](const YamlEntry& entry) { return entry.key == key_of_tools; });
  };
  const auto tools = of_tools(now.front());
  if (tools == now.front().entries.end() || tools->value.entries.empty()) return false;
  if (tools->value.entries.back().key != tool.name) return false;
  tools->value.entries.pop_back();
  YamlNode map;
  map.kind = YamlNode::Kind::map;
  YamlNode old = before.empty() ? map : before.front();
  const auto old_tools = of_tools(old);
  if (old_tools == old.entries.end()) {
    old.entries.push_back({std::string(key_of_tools), {}, map});
  } else if (old_tools->value.kind == YamlNode::Kind::nothing) {
    old_tools->value.kind = YamlNode::Kind::map;
  }
  return same(old, now.front());
}

std::vector<YamlNode> documents_of(std::string_view text, const std::string& path,
                                   Diagnostics& findings) {
  const std::size_t file = findings.add_file(path);
  return parse_yaml(text, file, Documents::all, findings);
}

/// The entry itself has to be right: a unit may be none that is known.
Result<void> check_entry(std::string_view text, const NewTool& tool, const std::string& path) {
  TRY_LET(const auto tools, parse_tools(text, path));
  const auto fault = tools.faults.find(tool.name);
  if (fault != tools.faults.end()) {
    // The place is one of a file that is not written.
    const std::string& message = fault->second.message;
    const std::size_t behind_place = message.find(": ");
    return tl::unexpected(Error{
        .code = Errc::usage,
        .message = behind_place == std::string::npos ? message : message.substr(behind_place + 2),
        .name = tool.name});
  }
  const auto found = std::find_if(tools.tools.begin(), tools.tools.end(),
                                  [&](const Tool& known) { return known.name == tool.name; });
  const bool is_there = found != tools.tools.end() && found->url == tool.url &&
                        found->torque_unit == tool.torque_unit && found->serial == tool.serial;
  if (is_there) return {};
  return tl::unexpected(not_to_be_edited(tool, path, "the entry would not be read as it is meant"));
}

/// The name must be free. A file that is not yet one of tools has none.
Result<void> check_free(const std::vector<YamlNode>& documents, const NewTool& tool,
                        const std::string& path) {
  const YamlNode* tools = documents.empty() ? nullptr : documents.front().find(key_of_tools);
  if (tools == nullptr) return {};
  for (const YamlEntry& entry : tools->entries) {
    if (entry.key != tool.name) continue;
    const YamlNode* url = entry.value.find("url");
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = fmt::format("a tool of this name is there already{}: {}:{}",
                                     url == nullptr ? "" : fmt::format(" ({})", url->text), path,
                                     entry.key_at.line),
              .hint = "choose another name, or change that line",
              .name = tool.name});
  }
  return {};
}

}  // namespace

std::string empty_tools_file() {
  return "# The tools by name, for spindle: 'spindle get station3' in place of a long address.\n"
         "# 'spindle tools add NAME URL' adds one, 'spindle tools test' asks each of them, and\n"
         "# 'man spindle-tools' tells every key.\n"
         "tools:\n"
         "#  station3:  {url: \"tcp://192.168.10.23:5000\", profile: doga-bm, torque-unit: "
         "\"N.m\"}\n"
         "#  conveyor1: {url: \"rtu:///dev/ttyUSB0?unit=3&baud=115200\", profile: "
         "orientalmotor-blv}\n"
         "\n"
         "# Several tools under one name: 'spindle get @line1'.\n"
         "#groups:\n"
         "#  line1: [station3, conveyor1]\n";
}

std::string line_of(const NewTool& tool) {
  std::string line = fmt::format("{}: {{url: {}", tool.name, files::quoted(tool.url));
  if (!tool.profile.empty()) line += fmt::format(", profile: {}", scalar(tool.profile));
  if (!tool.torque_unit.empty())
    line += fmt::format(", torque-unit: {}", files::quoted(tool.torque_unit));
  if (!tool.serial.empty()) line += fmt::format(", serial: {}", files::quoted(tool.serial));
  return line + "}";
}

Result<std::string> with_tool(std::string_view text, const NewTool& tool, const std::string& path) {
  TRY(check_name(tool));
  Diagnostics findings;
  const std::vector<YamlNode> documents = documents_of(text, path, findings);
  TRY(check_free(documents, tool, path));
  if (!findings.empty()) return tl::unexpected(findings.error());
  const bool is_map = documents.empty() || documents.front().kind == YamlNode::Kind::map;
  if (documents.size() > 1 || !is_map) {
    return tl::unexpected(not_to_be_edited(tool, path, "this is no tools file"));
  }
  // Its faults have their places before anything is added.
  if (!documents.empty() && documents.front().find(key_of_tools) != nullptr) {
    TRY(parse_tools(text, path));
  }
  auto edited = Editor(text, tool).run(documents.empty() ? nullptr : &documents.front());
  Diagnostics troubles;
  const bool is_right = edited &&
                        is_added(documents, documents_of(*edited, path, troubles), tool) &&
                        troubles.empty();
  if (!is_right) {
    return tl::unexpected(not_to_be_edited(
        tool, path, "it is written so that no line can be added without changing others"));
  }
  return check_entry(*edited, tool, path).map([&] { return std::move(*edited); });
}

}  // namespace spindle::files
