#include "spindle/work/target.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "spindle/base/text.hpp"

namespace spindle::work {
namespace {

const files::Tool* find_tool(const files::Tools& tools, std::string_view name) {
  const auto found = std::find_if(tools.tools.begin(), tools.tools.end(),
                                  [&](const files::Tool& tool) { return tool.name == name; });
  return found == tools.tools.end() ? nullptr : &*found;
}

Error unknown_target(const std::string& text, const files::Tools& tools) {
  std::vector<std::string> known;
  for (const files::Tool& tool : tools.tools) known.push_back(tool.name);
  for (const auto& [group, members] : tools.groups) known.push_back("@" + group);
  std::string hint = suggestion(text, known);
  if (hint.empty()) {
    hint = tools.path.empty()
               ? "no tools file was found, so a target is a URL: tcp://HOST or sim:doga-bm"
               : fmt::format("name a tool of {}, or a URL such as tcp://HOST", tools.path);
  }
  return {.code = Errc::unknown_name,
          .message = fmt::format("unknown target '{}'", text),
          .hint = std::move(hint),
          .remedy = remedy_for(text, known, tools.path.empty() ? "" : "spindle tools")};
}

Result<Target> target_of_url(const std::string& url, const Environment& environment) {
  TRY_LET(auto endpoint, link::parse_endpoint(url));
  Target target{.shown = url, .endpoint = std::move(endpoint)};
  target.profile =
      environment.common.profile.empty() ? target.endpoint.profile : environment.common.profile;
  return target;
}

/// A tool of which a part means nothing.
Target faulty_target(const files::Tool& tool, const files::SourceLocation& at, const Error& error,
                     const Environment& environment) {
  return {.shown = tool.name,
          .fault = fmt::format("{}:{}:{}: {}", environment.tools.path, at.line, at.column,
                               describe(error))};
}

Target target_of_tool(const files::Tool& tool, const Environment& environment) {
  auto target = target_of_url(tool.url, environment);
  if (!target) return faulty_target(tool, tool.url_at, target.error(), environment);
  target->shown = tool.name;
  if (tool.timeout) target->endpoint.timeout = tool.timeout;
  if (tool.gap) target->endpoint.gap = tool.gap;
  if (tool.retries) target->endpoint.retries = tool.retries;
  if (tool.transactions) target->endpoint.transactions = tool.transactions;
  if (environment.common.profile.empty() && !tool.profile.empty()) {
    const auto profile = environment.profiles.load(tool.profile);
    if (!profile) return faulty_target(tool, tool.profile_at, profile.error(), environment);
    target->profile = tool.profile;
  }
  target->torque_unit = tool.torque_unit;
  target->verified = tool.verified;
  target->serial = tool.serial;
  return std::move(*target);
}

/// The tools of this name, or that of this URL; a target with a fault where the entry has one. Only
/// a file with faults can have a name twice.
std::vector<Result<Target>> named_targets(const std::string& name, const Environment& environment) {
  std::vector<Result<Target>> found;
  if (const auto fault = environment.tools.faults.find(name);
      fault != environment.tools.faults.end()) {
    const std::string& file = environment.common.tools_file;
    found.emplace_back(
        Target{.shown = name,
               .fault = fault->second.message,
               .check = "spindle tools --check" +
                        (file.empty() ? std::string() : " --tools " + shell_word(file))});
    return found;
  }
  for (const files::Tool& tool : environment.tools.tools) {
    if (tool.name == name) found.push_back(target_of_tool(tool, environment));
  }
  if (!found.empty()) return found;
  if (link::looks_like_url(name)) {
    found.push_back(target_of_url(name, environment));
  } else {
    found.emplace_back(tl::unexpected(unknown_target(name, environment.tools)));
  }
  return found;
}

void add(Result<Target> found, Resolution& resolution) {
  if (!found) {
    resolution.faults.push_back(std::move(found.error()));
    return;
  }
  const bool known =
      std::any_of(resolution.targets.begin(), resolution.targets.end(), [&](const Target& target) {
        return target.shown == found->shown && target.endpoint.text == found->endpoint.text;
      });
  if (!known) resolution.targets.push_back(std::move(*found));
}

void add_named(const std::string& name, const Environment& environment, Resolution& resolution) {
  for (Result<Target>& found : named_targets(name, environment)) add(std::move(found), resolution);
}

/// Where a tool is one of several units behind a gateway, as far as its URL says so. A tool that
/// sends unasked has a connection of its own, whatever unit it is.
std::optional<std::string> gateway_of(const Target& target, const Environment& environment) {
  catalogue::LinkSpec facts;
  if (!target.profile.empty()) {
    const auto profile = environment.profiles.load(target.profile);
    if (!profile || catalogue::sends_unasked(*profile)) return std::nullopt;
    facts = profile->link;
  }
  return link::to_url(
      {.host = target.endpoint.host, .port = target.endpoint.port.value_or(facts.port)});
}

/// Units that are named behind one host and port share its connection.
void share_gateways(std::vector<Target>& targets, const Environment& environment) {
  std::map<std::string, std::vector<Target*>> hosts;
  for (Target& target : targets) {
    const link::Endpoint& endpoint = target.endpoint;
    if (endpoint.medium == link::Medium::tcp && endpoint.unit) {
      hosts[endpoint.host].push_back(&target);
    }
  }
  std::map<std::string, std::vector<Target*>> gateways;
  for (const auto& [host, units] : hosts) {
    if (units.size() == 1) continue;
    for (Target* unit : units) {
      if (const auto gateway = gateway_of(*unit, environment)) gateways[*gateway].push_back(unit);
    }
  }
  for (const auto& [gateway, units] : gateways) {
    if (units.size() == 1) continue;
    for (Target* unit : units) unit->endpoint.gateway = gateway;
  }
}

}  // namespace

Error fault_of(const Target& target) {
  return {.code = Errc::bad_file,
          .message = target.fault,
          .hint = "until it is mended, this entry is not used",
          .target = target.shown,
          .remedy = {.right = target.check}};
}

std::vector<Error> take_out_faulty(std::vector<Target>& targets) {
  std::vector<Error> faults;
  for (const Target& target : targets) {
    if (!target.fault.empty()) faults.push_back(fault_of(target));
  }
  std::erase_if(targets, [](const Target& target) { return !target.fault.empty(); });
  return faults;
}

Error with_target(Error error, const Target& target) {
  if (!error.target.empty()) return error;
  error.target = target.shown;
  if (target.endpoint.text != target.shown) error.endpoint = target.endpoint.text;
  return error;
}

std::vector<Target> naming_gateways(std::vector<Target> targets, const Environment& environment) {
  for (Target& target : targets) {
    const link::Endpoint& endpoint = target.endpoint;
    const bool is_known = endpoint.medium == link::Medium::tcp && !target.profile.empty();
    if (!is_known || !endpoint.unit) continue;
    if (auto gateway = gateway_of(target, environment)) target.endpoint.gateway = *gateway;
  }
  return targets;
}

Target reopening(Target target) {
  target.reopening = link::Reopening::once;
  return target;
}

std::string shared_line(const link::Endpoint& endpoint) {
  if (endpoint.medium == link::Medium::rtu_over_tcp) {
    return fmt::format("{}:{}", endpoint.host, endpoint.port.value_or(0));
  }
  if (endpoint.medium != link::Medium::serial) return {};
  std::error_code unreadable;  // then the path as it is
  const auto port = std::filesystem::weakly_canonical(endpoint.device, unreadable);
  return unreadable ? endpoint.device : port.string();
}

std::string shared_connection(const link::Endpoint& endpoint) {
  return endpoint.gateway.empty() ? shared_line(endpoint) : endpoint.gateway;
}

Error unproven(const Target& target) {
  return with_target(
      Error{.code = Errc::usage,
            .message = "a tool on a serial line cannot prove what it is",
            .hint = "name the profile with --profile or in the tools file; 'spindle profile list' "
                    "shows all",
            .remedy = {.right = "spindle profile list"}},
      target);
}

bool names_group(std::string_view text) { return text.starts_with('@'); }

bool is_target(std::string_view text, const Environment& environment) {
  if (link::looks_like_url(text) || find_tool(environment.tools, text) != nullptr) return true;
  return names_group(text) && environment.tools.groups.contains(std::string(text.substr(1)));
}

namespace {

/// With the faulty ones among the targets.
Resolution resolve_all(const std::vector<std::string>& texts, const Environment& environment) {
  Resolution resolution;
  for (const std::string& text : texts) {
    const auto group = names_group(text) ? environment.tools.groups.find(text.substr(1))
                                         : environment.tools.groups.end();
    if (group == environment.tools.groups.end()) {
      add_named(text, environment, resolution);
      continue;
    }
    if (const auto fault = environment.tools.faults.find(text);
        fault != environment.tools.faults.end()) {
      resolution.faults.push_back(fault->second);
      continue;
    }
    for (const std::string& name : group->second) add_named(name, environment, resolution);
    if (group->second.empty()) {
      resolution.faults.push_back(
          {.code = Errc::bad_file, .message = fmt::format("'{}' names no tools", text)});
    }
  }
  share_gateways(resolution.targets, environment);
  return resolution;
}

}  // namespace

Resolution resolve_each_target(const std::vector<std::string>& texts,
                               const Environment& environment) {
  Resolution resolution = resolve_all(texts, environment);
  for (Error& fault : take_out_faulty(resolution.targets)) {
    resolution.faults.push_back(std::move(fault));
  }
  return resolution;
}

Result<std::vector<Target>> resolve_targets(const std::vector<std::string>& texts,
                                            const Environment& environment) {
  Resolution resolution = resolve_all(texts, environment);
  if (!resolution.faults.empty()) return tl::unexpected(std::move(resolution.faults.front()));
  const auto& targets = resolution.targets;
  const auto usable = [](const Target& target) { return target.fault.empty(); };
  if (!targets.empty() && std::none_of(targets.begin(), targets.end(), usable)) {
    return tl::unexpected(fault_of(targets.front()));
  }
  return std::move(resolution.targets);
}

Result<Target> resolve_target(const std::string& text, const Environment& environment,
                              const OneTool& words) {
  TRY_LET(auto targets, resolve_targets({text}, environment));
  if (targets.size() == 1) return std::move(targets.front());
  return tl::unexpected(Error{
      .code = Errc::usage,
      .message = fmt::format("'{}' is {} tools, and {}", text, targets.size(), words.why),
      .hint = words.remedy.empty() ? fmt::format("{} {}", words.instead, targets.front().shown)
                                   : std::string(words.remedy),
      .remedy = words.remedy.empty() ? Remedy{text, targets.front().shown} : Remedy()});
}

}  // namespace spindle::work
