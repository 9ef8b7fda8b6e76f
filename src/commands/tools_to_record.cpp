#include "tools_to_record.hpp"

#include <fmt/format.h>

#include <utility>

#include "watch_plan.hpp"

namespace spindle::commands {
namespace {

Error no_tools(const files::Tools& file) {
  Error error{.code = Errc::usage, .message = "there is no tool to record"};
  error.hint = file.path.empty() ? "name one, or write a tools file"
                                 : "name one, or add it to the tools file";
  return error;
}

std::vector<std::string> names_of(const RecordOptions& options, const files::Tools& file) {
  if (!options.watch.targets.empty()) return options.watch.targets;
  std::vector<std::string> names;
  for (const files::Tool& tool : file.tools) {
    if (!file.faults.contains(tool.name)) names.push_back(tool.name);
  }
  return names;
}

/// The entries of the file that are not used, with what is wrong with them.
std::vector<std::string> faults_of(const files::Tools& file) {
  std::vector<std::string> notes;
  for (const auto& [entry, fault] : file.faults) {
    notes.push_back(fmt::format("{}: left out: {}", entry, fault.message));
  }
  return notes;
}

}  // namespace

Result<ToolsToRecord> tools_to_record(const RecordOptions& options, const files::Tools& file,
                                      ProfileShelf& shelf, const Context& context) {
  const bool all = options.watch.targets.empty();
  const std::vector<std::string> names = names_of(options, file);
  if (names.empty()) return tl::unexpected(no_tools(file));
  TRY_LET(auto targets, resolve_targets(names, with_tools(context, file)));
  const std::vector<Error> faults = take_out_faulty(targets);
  targets = naming_gateways(std::move(targets), context);
  TRY_LET(auto tools, prepare_tools(targets, options.watch.names, shelf, context));
  ToolsToRecord wanted;
  if (all) wanted.notes = faults_of(file);
  for (const Error& fault : faults) {
    wanted.notes.push_back(fmt::format("{}: left out: {}", fault.target, fault.message));
  }
  for (WatchedTool& tool : tools) {
    auto checked = check_watch(options.watch, tool, shelf, context);
    if (checked) {
      wanted.tools.push_back(std::move(tool));
      continue;
    }
    checked.error().asked_of = tool.target().shown;
    if (!all) return tl::unexpected(std::move(checked.error()));
    wanted.notes.push_back(
        fmt::format("{}: left out: {}", tool.target().shown, checked.error().message));
  }
  if (wanted.tools.empty()) return tl::unexpected(no_tools(file));
  return wanted;
}

std::set<std::string> names_of(const std::vector<WatchedTool>& tools) {
  std::set<std::string> names;
  for (const WatchedTool& tool : tools) names.insert(tool.target().shown);
  return names;
}

}  // namespace spindle::commands
