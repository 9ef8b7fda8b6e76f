#include <algorithm>
#include <optional>
#include <utility>

#include "motor_records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/device/run_model.hpp"
#include "spindle/work/shared_lines.hpp"
#include "watch_plan.hpp"
#include "watch_stream.hpp"
#include "watched_tool.hpp"

namespace spindle::commands {
namespace {

/// What a tool may be of which nothing is known yet.
std::vector<const catalogue::Profile*> candidates(ProfileShelf& shelf, const Context& context) {
  std::vector<const catalogue::Profile*> profiles;
  for (const files::ProfileEntry& entry : context.profiles.list()) {
    const auto known = shelf.take(entry.id);
    if (known && (*known)->profile.identity) profiles.push_back(&(*known)->profile);
  }
  return profiles;
}

/// Motors have other columns than tools that count their results.
std::vector<report::Column> columns_for(const std::vector<WatchedTool>& tools, ProfileShelf& shelf,
                                        const WatchOptions& options, const Context& context) {
  const bool one = tools.size() == 1 && !names_group(options.targets.front());
  const Tools shown = one ? Tools::one : Tools::several;
  const bool motors = std::all_of(tools.begin(), tools.end(), [](const WatchedTool& tool) {
    return tool.known() != nullptr && device::has_motor(tool.known()->profile) &&
           !tool.known()->profile.events;
  });
  if (motors) return motor_columns(shown);
  std::vector<const catalogue::Profile*> profiles;
  for (const WatchedTool& tool : tools) {
    if (tool.known() == nullptr) return news_columns(shown, candidates(shelf, context));
    profiles.push_back(&tool.known()->profile);
  }
  return news_columns(shown, profiles);
}

/// Whether the error is one of the tool or its link that does not say yet whose it is.
bool is_about_tool(const Error& error) {
  switch (error.status()) {
    case ExitStatus::unreachable:
    case ExitStatus::no_answer:
    case ExitStatus::refused:
    case ExitStatus::malformed:
    case ExitStatus::mismatch:
      return error.target.empty();
    default:
      return false;
  }
}

void watch_one(WatchedTool& tool, const device::OpenTransport& open_transport, WatchStream& stream,
               const WatchOptions& options, const Context& context) {
  const catalogue::Profile unknown;
  Voice voice;
  voice.records.emplace(tool.target(), unknown, catalogue::CodeTables());
  const auto open = [&] {
    const TimePoint until = stream.until();
    const TimePoint now = context.clock.now();
    auto link = tool.open(until > now ? until - now : Duration::zero(), open_transport);
    if (link) voice.records.emplace(tool.target(), tool.known()->profile, tool.known()->tables);
    return link;
  };
  const auto plan = [&](const catalogue::Profile& profile) { return plan_watch(options, profile); };
  device::Watcher watcher(open, plan, options.reconnection, context.clock,
                          [&](const device::WatchEvent& news) { return stream.tell(news, voice); });
  const auto of_tool = [&](Error error) {
    if (is_about_tool(error)) return with_target(std::move(error), tool.target());
    error.asked_of = tool.target().shown;
    return error;
  };
  auto watched = watcher.run([&] { return stream.until(); }).map_error(of_tool);
  auto unreached = watcher.unreached();
  if (unreached) unreached = of_tool(std::move(*unreached));
  stream.leave(watched, unreached, voice);
}

}  // namespace

Result<Outcome> watch(const WatchOptions& options, Context& context) {
  ProfileShelf shelf(context.profiles);
  auto tools = prepare_tools(options.targets, options.names, shelf, context);
  if (!tools) return tl::unexpected(std::move(tools.error()));
  for (const WatchedTool& tool : *tools) {
    if (auto checked = check_watch(options, tool, shelf, context); !checked) {
      checked.error().asked_of = tool.target().shown;
      return tl::unexpected(std::move(checked.error()));
    }
  }
  std::vector<Target> targets;
  for (const WatchedTool& tool : *tools) targets.push_back(tool.target());
  SharedLines lines(targets, context);
  const device::OpenTransport open_transport = lines.opener();
  WatchStream stream(options, tools->size(), columns_for(*tools, shelf, options, context), context);
  for_each_side_by_side(*tools, [&](WatchedTool& tool) {
    watch_one(tool, open_transport, stream, options, context);
  });
  return stream.finish();
}

}  // namespace spindle::commands
