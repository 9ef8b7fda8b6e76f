#include "watching.hpp"

#include <algorithm>
#include <utility>

#include "motor_records.hpp"
#include "spindle/device/run_model.hpp"

namespace spindle::commands {
namespace {

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

Error of_tool(Error error, const Target& target) {
  if (is_about_tool(error)) return with_target(std::move(error), target);
  error.asked_of = target.shown;
  return error;
}

/// What a tool may be of which nothing is known yet.
std::vector<const catalogue::Profile*> candidates(ProfileShelf& shelf, const Context& context) {
  std::vector<const catalogue::Profile*> profiles;
  for (const files::ProfileEntry& entry : context.profiles.list()) {
    const auto known = shelf.take(entry.id);
    if (known && (*known)->profile.identity) profiles.push_back(&(*known)->profile);
  }
  return profiles;
}

}  // namespace

/// Motors have other columns than tools that count their results.
std::vector<report::Column> columns_for(const std::vector<WatchedTool>& tools, ProfileShelf& shelf,
                                        const WatchOptions& options, const Context& context) {
  // All of the tools file, which needs no name, is like a group.
  const bool is_named = !options.targets.empty() && !names_group(options.targets.front());
  const bool one = tools.size() == 1 && is_named;
  const Tools shown = one ? Tools::one : Tools::several;
  const bool is_file = context.user.format == report::Format::csv;
  const bool motors = std::all_of(tools.begin(), tools.end(), [](const WatchedTool& tool) {
    return tool.known() != nullptr && device::has_motor(tool.known()->profile) &&
           !tool.known()->profile.events;
  });
  if (motors && !is_file) return motor_columns(shown);
  NewsSources sources{.tools = shown};
  bool all_known = true;
  for (const WatchedTool& tool : tools) {
    all_known = all_known && tool.known() != nullptr;
    if (all_known) sources.profiles.push_back(&tool.known()->profile);
    const bool has_torque = tool.known() == nullptr || tool.known()->profile.events;
    if (has_torque) sources.torque_units.push_back(tool.target().torque_unit);
  }
  if (!all_known) sources.profiles = candidates(shelf, context);
  return is_file ? exchange_columns(sources.profiles) : news_columns(sources);
}

void watch_tool(WatchedTool& tool, const device::OpenTransport& open_transport,
                const device::Watcher::Plan& plan, device::Reconnection reconnection,
                Listener& listener, const Context& context) {
  const auto open = [&] {
    const TimePoint until = listener.until();
    const TimePoint now = context.clock.now();
    auto link = tool.open(until > now ? until - now : Duration::zero(), open_transport);
    if (link) listener.opened(tool);
    return link;
  };
  device::Watcher watcher(
      open, plan, reconnection, context.clock,
      [&](const device::WatchEvent& news) { return listener.tell(news); }, listener.hooks());
  auto watched = watcher.run([&] { return listener.until(); }).map_error([&](Error error) {
    return of_tool(std::move(error), tool.target());
  });
  auto unreached = watcher.unreached();
  if (unreached) unreached = of_tool(std::move(*unreached), tool.target());
  listener.left(watched, unreached);
}

}  // namespace spindle::commands
