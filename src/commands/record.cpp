#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "recorder.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/work/shared_lines.hpp"
#include "spindle/work/store_place.hpp"
#include "watch_plan.hpp"

namespace spindle::commands {
namespace {

/// How long what was heard may take to be stored when the program ends.
constexpr Duration farewell = std::chrono::seconds(8);

Error no_tools(const Context& context) {
  Error error{.code = Errc::usage, .message = "there is no tool to record"};
  error.hint = context.tools.path.empty() ? "name one, or write a tools file"
                                          : "name one, or add it to the tools file";
  return error;
}

/// The tools that are recorded: those named, else all of the tools file.
Result<std::vector<WatchedTool>> tools_to_record(const RecordOptions& options, ProfileShelf& shelf,
                                                 Context& context) {
  const bool all = options.watch.targets.empty();
  std::vector<std::string> targets = options.watch.targets;
  if (all) {
    for (const files::Tool& tool : context.tools.tools) targets.push_back(tool.name);
  }
  if (targets.empty()) return tl::unexpected(no_tools(context));
  auto tools = prepare_tools(targets, options.watch.names, shelf, context);
  if (!tools) return tools;
  std::vector<WatchedTool> wanted;
  for (WatchedTool& tool : *tools) {
    auto checked = check_watch(options.watch, tool, shelf, context);
    if (checked) {
      wanted.push_back(std::move(tool));
      continue;
    }
    checked.error().asked_of = tool.target().shown;
    if (!all) return tl::unexpected(std::move(checked.error()));
    context.renderer.note(
        fmt::format("{}: left out: {}", tool.target().shown, checked.error().message));
  }
  if (wanted.empty()) return tl::unexpected(no_tools(context));
  return wanted;
}

Error not_stored(std::size_t left, const std::string& path) {
  return Error{
      .code = Errc::storage,
      .message = fmt::format("{} could not be stored before the end", counted(left, "record")),
      .hint =
          "see why the store cannot be written; the last event of each tool is fetched "
          "at the next start",
      .name = path};
}

}  // namespace

Result<Outcome> record(const RecordOptions& options, Context& context) {
  ProfileShelf shelf(context.profiles);
  TRY_LET(auto tools, tools_to_record(options, shelf, context));
  TRY_LET(const auto path, work::store_place(options.store, context.state_folder));
  TRY_LET(auto writer, store::Writer::open(path));

  std::vector<Target> targets;
  for (const WatchedTool& tool : tools) targets.push_back(tool.target());
  SharedLines lines(targets, context);
  const device::OpenTransport open_transport = lines.opener();
  std::vector<report::Column> columns;
  if (options.tee) columns = columns_for(tools, shelf, options.watch, context);
  WatchStream stream(options.watch, tools.size(), columns, context,
                     options.tee ? Records::shown : Records::counted);
  work::JournalOptions pace;
  if (options.gather) pace.gather = *options.gather;
  Recorder recorder(*writer, stream, pace, context);
  std::vector<std::unique_ptr<RecordedTool>> recorded;
  for (const WatchedTool& tool : tools) {
    recorded.push_back(std::make_unique<RecordedTool>(tool.target(), recorder));
  }
  const auto plan = [&](const catalogue::Profile& profile) {
    return plan_watch(options.watch, profile);
  };
  for_each_side_by_side(tools, [&](WatchedTool& tool) {
    const auto index = static_cast<std::size_t>(&tool - tools.data());
    watch_tool(tool, open_transport, plan, device::Reconnection::whatever, *recorded[index],
               context);
  });
  const std::size_t left = recorder.journal().close(farewell);
  if (left > 0) stream.fail(not_stored(left, path));
  return stream.finish();
}

}  // namespace spindle::commands
