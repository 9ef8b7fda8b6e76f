#include "watching.hpp"

#include <utility>

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

}  // namespace

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
