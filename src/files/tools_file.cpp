#include "spindle/files/tools_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "files/fields.hpp"
#include "files/known_keys.hpp"
#include "files/yaml_reader.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"
#include "spindle/files/profile_store.hpp"

namespace spindle::files {
namespace {

// As in a URL, whose layer is not seen here.
constexpr Duration longest_timeout = std::chrono::minutes(10);
constexpr Duration longest_gap = std::chrono::seconds(1);
constexpr std::uint64_t most_retries = 100;

constexpr std::array<std::string_view, 7> torque_units = {"kgf.cm", "kgf.m",  "N.m",   "cN.m",
                                                          "lbf.in", "ozf.in", "lbf.ft"};

bool is_letter_or_digit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

/// Begins with a letter or digit, so that it is neither a group (@), an option (-) nor a path.
bool is_tool_name(std::string_view text) {
  return !text.empty() && is_letter_or_digit(text.front()) &&
         std::all_of(text.begin(), text.end(), [](char c) {
           return is_letter_or_digit(c) || c == '_' || c == '.' || c == '-';
         });
}

void check_name(const YamlEntry& entry, Diagnostics& findings) {
  if (is_tool_name(entry.key)) return;
  findings.add(entry.key_at,
               fmt::format("name '{}' is not made of the letters a to z and A to Z, digits, '_', "
                           "'.' and '-', beginning with a letter or digit",
                           entry.key));
}

std::vector<std::string> read_words(const YamlNode& list, Diagnostics& findings) {
  std::vector<std::string> words;
  expect(list, YamlNode::Kind::sequence, findings);
  if (list.kind == YamlNode::Kind::scalar) words.push_back(list.text);  // what was meant by it
  for (const YamlNode& item : list.items) {
    auto word = to_text(item, findings);
    if (!word) continue;
    if (std::find(words.begin(), words.end(), *word) != words.end()) {
      findings.add(item.at, fmt::format("'{}' is given twice", *word));
    }
    words.push_back(std::move(*word));
  }
  return words;
}

void read_torque_unit(const YamlNode& node, Tool& tool, const Asked& asked) {
  auto unit = to_text(node, asked.findings);
  if (!unit) return;
  if (std::find(torque_units.begin(), torque_units.end(), *unit) != torque_units.end()) {
    tool.torque_unit = std::move(*unit);
  } else {
    asked.findings.add(
        node.at, unknown_word("torque unit", *unit, {torque_units.begin(), torque_units.end()}));
  }
}

void read_time(const YamlNode& node, Duration longest, std::optional<Duration>& target,
               const Asked& asked) {
  Duration time = {};
  if (!read_value(node, time, asked)) return;
  if (time <= Duration::zero() || time > longest) {
    asked.findings.add(node.at, fmt::format("it is a time up to {}", spindle::to_text(longest)));
    return;
  }
  target = time;
}

void read_timeout(const YamlNode& node, Tool& tool, const Asked& asked) {
  read_time(node, longest_timeout, tool.timeout, asked);
}

void read_gap(const YamlNode& node, Tool& tool, const Asked& asked) {
  read_time(node, longest_gap, tool.gap, asked);
}

void read_retries(const YamlNode& node, Tool& tool, const Asked& asked) {
  const auto retries = to_unsigned(node, most_retries, asked.findings);
  if (retries) tool.retries = static_cast<unsigned>(*retries);
}

void read_verified(const YamlNode& node, Tool& tool, const Asked& asked) {
  tool.verified = read_words(node, asked.findings);
}

void read_limits(const YamlNode& node, Tool& tool, const Asked& asked) {
  constexpr std::uint64_t last_preset = 65'535;
  expect(node, YamlNode::Kind::map, asked.findings);
  for (const YamlEntry& entry : node.entries) {
    const auto preset = parse_unsigned(entry.key, last_preset);
    if (!preset) {
      asked.findings.add(entry.key_at, fmt::format("'{}' is no number of a preset", entry.key));
    }
    const auto text = to_text(entry.value, asked.findings);
    if (!text) continue;
    const auto limits = parse_limits(*text);
    if (!limits) {
      asked.findings.add(
          entry.value.at,
          fmt::format("'{}' are no limits; write \"2.44:2.98\", or one of the two", *text));
    } else if (preset) {
      tool.limits[static_cast<std::int64_t>(*preset)] = *limits;
    }
  }
}

constexpr Field<Tool> tool_fields[] = {
    field<&Tool::url>("url", Need::required),
    field<&Tool::profile>("profile"),
    custom("torque-unit", Need::optional, "text", read_torque_unit),
    custom("timeout", Need::optional, "duration", read_timeout),
    custom("gap", Need::optional, "duration", read_gap),
    custom("retries", Need::optional, "number 0..100", read_retries),
    word<modbus::transaction_words, &Tool::transactions>("transaction"),
    custom("verified", Need::optional, "list of text", read_verified),
    field<&Tool::serial>("serial"),
    custom("limits", Need::optional, "map of preset to text", read_limits),
};

Tool read_tool(const YamlEntry& entry, Diagnostics& findings) {
  check_name(entry, findings);
  Tool tool;
  tool.name = entry.key;
  read_map(tool_fields, entry.value, tool, findings);
  const auto location_of = [&](std::string_view key) {
    const YamlNode* value = entry.value.find(key);
    return value == nullptr ? SourceLocation() : value->at;
  };
  tool.url_at = location_of("url");
  tool.profile_at = location_of("profile");
  tool.verified_at = location_of("verified");
  return tool;
}

std::vector<std::string> names_of(const Tools& tools) {
  std::vector<std::string> names;
  for (const Tool& tool : tools.tools) names.push_back(tool.name);
  return names;
}

void read_group(const YamlEntry& entry, Tools& tools, Diagnostics& findings) {
  check_name(entry, findings);
  std::vector<std::string> members = read_words(entry.value, findings);
  if (entry.value.kind == YamlNode::Kind::sequence && members.empty()) {
    findings.add_once(entry.value.at, fmt::format("group '{}' has no tools", entry.key));
  }
  const std::vector<std::string> known = names_of(tools);
  for (const YamlNode& item : entry.value.items) {
    if (item.kind != YamlNode::Kind::scalar) continue;
    if (std::find(known.begin(), known.end(), item.text) != known.end()) continue;
    findings.add_once(item.at, unknown_word("tool", item.text, known));
  }
  auto& group = tools.groups[entry.key];
  group.insert(group.end(), members.begin(), members.end());
}

void read_tool_map(const YamlNode& node, Tools& tools, const Asked& asked) {
  if (node.kind == YamlNode::Kind::nothing) return;  // all of them may be comments
  expect(node, YamlNode::Kind::map, asked.findings);
  for (const YamlEntry& entry : node.entries) {
    tools.tools.push_back(read_tool(entry, asked.findings));
  }
}

void read_group_map(const YamlNode& node, Tools& tools, const Asked& asked) {
  expect(node, YamlNode::Kind::map, asked.findings);
  for (const YamlEntry& entry : node.entries) read_group(entry, tools, asked.findings);
}

void read_urls(const YamlNode& node, Sink& sink, const Asked& asked) {
  sink.url_at = node.at;
  std::optional<SinkKind> kind;
  const auto read_url = [&](const YamlNode& item) {
    const auto text = to_text(item, asked.findings);
    if (!text) return;
    const auto url = parse_sink_url(*text);
    if (!url) {
      asked.findings.add(item.at, describe(url.error()));
    } else if (kind && *kind != url->kind) {
      asked.findings.add(item.at, "all URLs of a sink are of one kind");
    } else {
      kind = url->kind;
    }
    sink.urls.push_back(*text);
  };
  if (node.kind != YamlNode::Kind::sequence) return read_url(node);
  for (const YamlNode& item : node.items) read_url(item);
  if (node.items.empty()) asked.findings.add(node.at, "a sink needs a URL");
}

template <std::optional<std::size_t> Sink::*member, std::uint64_t most>
void read_amount(const YamlNode& node, Sink& sink, const Asked& asked) {
  const auto amount = to_unsigned(node, most, asked.findings);
  if (!amount) return;
  if (*amount == 0) asked.findings.add(node.at, "it is 1 at least");
  sink.*member = static_cast<std::size_t>(*amount);
}

constexpr Field<Sink> sink_fields[] = {
    custom("url", Need::required, "text, or list of text", read_urls),
    field<&Sink::user>("user"),
    field<&Sink::password_file>("password-file"),
    field<&Sink::ca_file>("ca-file"),
    field<&Sink::cert_file>("cert-file"),
    field<&Sink::key_file>("key-file"),
    field<&Sink::collector>("collector"),
    word<sink_events_words, &Sink::events>("events"),
    field<&Sink::client_id>("client-id"),
    custom("window", Need::optional, "number 1..10000", read_amount<&Sink::window, 10'000>),
    custom("batch", Need::optional, "number 1..10000", read_amount<&Sink::batch, 10'000>),
};

/// Keys that mean nothing to a sink of this kind.
void check_keys(const YamlEntry& entry, const Sink& sink, Diagnostics& findings) {
  const auto url = sink.urls.empty() ? Result<SinkUrl>(SinkUrl()) : parse_sink_url(sink.urls[0]);
  if (sink.urls.empty() || !url) return;
  const auto refuse = [&](std::string_view key, SinkKind of) {
    const YamlNode* value = entry.value.find(key);
    if (value == nullptr || url->kind == of) return;
    findings.add(value->at,
                 fmt::format("'{}' is about sinks of kind {}", key, sink_kind_words.text(of)));
  };
  refuse("window", SinkKind::mqtt);
  refuse("client-id", SinkKind::mqtt);
  refuse("batch", SinkKind::postgresql);
  for (const auto& [one, other] : {std::pair("cert-file", "key-file"), {"key-file", "cert-file"}}) {
    const YamlNode* value = entry.value.find(one);
    if (value == nullptr || entry.value.find(other) != nullptr) continue;
    findings.add(value->at, fmt::format("'{}' makes no sense without '{}'", one, other));
  }
}

void read_sink_map(const YamlNode& node, Tools& tools, const Asked& asked) {
  expect(node, YamlNode::Kind::map, asked.findings);
  for (const YamlEntry& entry : node.entries) {
    check_name(entry, asked.findings);
    Sink& sink = tools.sinks.emplace_back();
    sink.name = entry.key;
    read_map(sink_fields, entry.value, sink, asked.findings);
    check_keys(entry, sink, asked.findings);
  }
}

constexpr Field<Tools> document_fields[] = {
    custom("tools", Need::required, "maps by name", read_tool_map).with(keys_of<tool_fields>),
    custom("groups", Need::optional, "lists of names by name", read_group_map),
    custom("sinks", Need::optional, "maps by name", read_sink_map).with(keys_of<sink_fields>),
};

/// A file where the tools file means it; absolute paths as they are.
std::string beside(const std::string& tools_file, std::string path) {
  const std::filesystem::path folder = std::filesystem::path(tools_file).parent_path();
  const std::filesystem::path file(path);
  const bool here = folder.empty() || folder == ".";
  if (here || path.empty() || file.is_absolute()) return path;
  return (folder / file).lexically_normal().string();
}

/// A profile's file likewise; ids as they are.
std::string profile_beside(const std::string& tools_file, std::string profile) {
  return names_profile_file(profile) ? beside(tools_file, std::move(profile)) : profile;
}

using Position = std::pair<std::size_t, std::size_t>;  ///< line and column

Position position_of(const SourceLocation& at) { return {at.line, at.column}; }

/// Where the last value begins that is part of this one.
Position last_position(const YamlNode& node) {
  if (!node.items.empty()) return last_position(node.items.back());
  if (!node.entries.empty()) return last_position(node.entries.back().value);
  return position_of(node.at);
}

/// The entry of the file that has its place there, as Tools::faults names it; empty: none has.
std::string entry_at(const YamlNode& document, const Position& place) {
  constexpr std::pair<std::string_view, std::string_view> kinds[] = {
      {"tools", ""}, {"groups", "@"}, {"sinks", "sink "}};
  for (const auto& [kind, prefix] : kinds) {
    const YamlNode* entries = document.find(kind);
    if (entries == nullptr) continue;
    for (const YamlEntry& entry : entries->entries) {
      const bool is_here =
          position_of(entry.key_at) <= place && place <= last_position(entry.value);
      if (is_here) return std::string(prefix) + entry.key;
    }
  }
  return {};
}

/// Everything that can be read, with what is wrong.
Tools read_tools(std::string_view text, const std::string& path, Diagnostics& findings) {
  const std::size_t file = findings.add_file(path);
  const std::vector<YamlNode> documents = parse_yaml(text, file, Documents::all, findings);
  Tools tools;
  tools.path = path;
  if (!documents.empty()) read_map(document_fields, documents.front(), tools, findings);
  for (Tool& tool : tools.tools) tool.profile = profile_beside(path, std::move(tool.profile));
  for (Sink& sink : tools.sinks) {
    for (auto part : {&Sink::password_file, &Sink::ca_file, &Sink::cert_file, &Sink::key_file}) {
      sink.*part = beside(path, std::move(sink.*part));
    }
  }
  if (documents.empty() && findings.empty()) findings.add({file, 1, 1}, "the file is empty");
  if (documents.size() > 1) findings.add(documents[1].at, "a second document has no meaning here");
  for (const Diagnostic& finding : findings.list()) {
    const std::string entry =
        documents.empty() ? "" : entry_at(documents.front(), {finding.line, finding.column});
    tools.faults.try_emplace(entry, Error{.code = Errc::bad_file, .message = finding.to_string()});
  }
  return tools;
}

Result<Tools> read_tools_file(const std::string& path, const Disk& disk, Diagnostics& findings) {
  TRY_LET(const auto text, disk.read_trusted(path));
  return read_tools(text, path, findings);
}

/// What is said of a file that has these faults.
Error refusal_of(const Diagnostics& findings, const std::string& path) {
  Error error = findings.error();
  if (findings.list().size() > 1) {
    error.hint = "'spindle tools --check' lists every fault";
    error.remedy.right = fmt::format("spindle tools --check --tools {}", shell_word(path));
  }
  return error;
}

}  // namespace

std::optional<JointLimits> parse_limits(std::string_view text) {
  const auto parts = split(text, ':');
  if (parts.size() != 2 || text.size() == 1) return std::nullopt;
  JointLimits limits;
  for (const bool is_lower : {true, false}) {
    const std::string_view part = parts[is_lower ? 0 : 1];
    if (part.empty()) continue;
    auto& limit = is_lower ? limits.lower : limits.upper;
    limit = Decimal::parse(part);
    if (!limit) return std::nullopt;
  }
  if (limits.lower && limits.upper && *limits.lower >= *limits.upper) return std::nullopt;
  return limits;
}

bool may_name_tools(std::string_view word) { return word.starts_with('@') || is_tool_name(word); }

Result<Tools> load_tools(const std::string& path, const Disk& disk) {
  Diagnostics findings;
  auto tools = read_tools_file(path, disk, findings);
  if (!tools || findings.empty()) return tools;
  return tl::unexpected(refusal_of(findings, path));
}

Result<Tools> usable_tools(const std::string& path, const Disk& disk) {
  TRY_LET(const auto text, disk.read_trusted(path));
  return parse_tools(text, path);
}

Result<Tools> parse_tools(std::string_view text, const std::string& path) {
  Diagnostics findings;
  Tools tools = read_tools(text, path, findings);
  if (tools.faults.contains("")) return tl::unexpected(refusal_of(findings, path));
  return tools;
}

Result<Tools> without_faults(Tools tools) {
  if (tools.faults.empty()) return tools;
  return tl::unexpected(tools.faults.begin()->second);
}

Result<Sink> usable_sink(const Sink& sink, const Tools& tools) {
  const auto fault = tools.faults.find("sink " + sink.name);
  if (fault == tools.faults.end()) return sink;
  Error error = fault->second;
  error.name = sink.name;
  error.hint = "until it is mended, this entry is not used";
  return tl::unexpected(std::move(error));
}

Tools salvage_tools(const std::string& path, const Disk& disk) {
  Diagnostics findings;
  auto tools = read_tools_file(path, disk, findings);
  if (!tools) return {.path = path, .left_out = std::move(tools.error())};
  if (!findings.empty()) tools->left_out = refusal_of(findings, path);
  tools->faults.clear();
  return std::move(*tools);
}

Result<CheckedTools> check_tools(const std::string& path, const Disk& disk) {
  Diagnostics findings;
  TRY_LET(auto tools, read_tools_file(path, disk, findings));
  return CheckedTools{std::move(tools), findings.list()};
}

std::vector<KeyList> tools_keys() { return {{"document", keys_of<document_fields>()}}; }

}  // namespace spindle::files
