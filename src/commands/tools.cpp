#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <tuple>

#include "findings.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/link/endpoint.hpp"
#include "tool_record.hpp"

namespace spindle::commands {
namespace {

using report::Column;

const std::array<Column, 6> tool_columns = {
    {{"NAME", "name"},
     {"URL", "endpoint", report::Align::left, 0, report::wrapped(24)},
     {"PROFILE", "profile"},
     {"TORQUE UNIT", "torque_unit", report::Align::left, 0, report::left_out(2)},
     {"GROUPS", "groups", report::Align::left, 0, report::wrapped(12)},
     {"VERIFIED", "verified", report::Align::left, 0, report::wrapped(12, 1)}}};

std::vector<std::string> groups_of(const files::Tool& tool, const files::Tools& tools) {
  std::vector<std::string> groups;
  for (const auto& [group, members] : tools.groups) {
    if (tools.faults.contains("@" + group)) continue;
    const bool is_member = std::find(members.begin(), members.end(), tool.name) != members.end();
    if (is_member) groups.push_back(group);
  }
  return groups;
}

/// Collects what the file's own rules cannot see: whether URLs, profiles and actions exist.
class ToolsCheck {
 public:
  ToolsCheck(files::CheckedTools checked, const Context& context)
      : checked_(std::move(checked)), context_(&context) {}

  std::vector<files::Diagnostic> run() {
    for (const files::Tool& tool : checked_.tools.tools) check(tool);
    auto findings = std::move(checked_.findings);
    std::stable_sort(findings.begin(), findings.end(), [](const auto& a, const auto& b) {
      return std::tie(a.line, a.column) < std::tie(b.line, b.column);
    });
    return findings;
  }

 private:
  void check(const files::Tool& tool) {
    if (tool.url_at.line > 0) {
      const auto endpoint = link::parse_endpoint(tool.url);
      if (!endpoint) add(tool.url_at, endpoint.error());
    }
    if (tool.profile.empty()) return;
    const auto profile = context_->profiles.load(tool.profile);
    if (!profile) return add(tool.profile_at, profile.error());
    for (const std::string& action : tool.verified) {
      const auto known = profile->find_action(action);
      if (!known) add(tool.verified_at, known.error());
    }
  }

  void add(const files::SourceLocation& place, const Error& error) {
    checked_.findings.push_back({.file = checked_.tools.path,
                                 .line = place.line,
                                 .column = place.column,
                                 .message = describe(error)});
  }

  files::CheckedTools checked_;
  const Context* context_;
};

}  // namespace

Result<Outcome> tools(Context& context) {
  Outcome outcome;
  outcome.succeed();
  if (context.tools.path.empty()) {
    context.renderer.note("no tools file was found; 'man 5 spindle-tools' says where it may be");
  }
  Listing listing(context, tool_columns);
  for (const files::Tool& tool : context.tools.tools) {
    if (context.tools.faults.contains(tool.name)) continue;
    const Resolution meant = resolve_each_target({tool.name}, context);
    for (const Error& fault : meant.faults) {
      outcome.fail(fault);
      listing.add(fault);
    }
    if (!meant.faults.empty()) continue;
    listing.add(tool_record(tool, groups_of(tool, context.tools), context.clock));
  }
  for (const auto& [entry, fault] : context.tools.faults) {
    outcome.fail(fault);
    Error told = fault;
    if (files::may_name_tools(entry)) told.target = entry;  // else it is a sink's
    listing.add(told);
  }
  return finish(listing, outcome);
}

Result<Outcome> check_tools(Context& context) {
  const std::string& path = context.tools.path;
  if (path.empty()) {
    return tl::unexpected(
        Error{.code = Errc::bad_file,
              .message = "no tools file was found",
              .hint = "name one with --tools; 'man 5 spindle-tools' says where it is looked for"});
  }
  TRY_LET(auto checked, files::check_tools(path, context.disk));
  return tell_findings(ToolsCheck(std::move(checked), context).run(), path, "tools file", context);
}

}  // namespace spindle::commands
