#include <utility>

#include "run_motor.hpp"
#include "run_tool.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {
namespace {

/// What only motors have is a mistake on a tool that runs by itself.
Result<void> check_tool_options(const RemoteStartOptions& options) {
  const std::pair<std::string_view, bool> given[] = {
      {"--speed", !options.speed.empty()},
      {"--reverse", options.direction_of_motor == catalogue::Direction::reverse},
      {"--operation", options.operation.has_value()},
      {"--acceleration", !options.acceleration.empty()},
      {"--deceleration", !options.deceleration.empty()},
      {"--watchdog", options.watchdog.has_value()},
      {"--stop", options.stop.has_value()}};
  for (const auto& [option, is_given] : given) {
    if (!is_given) continue;
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "this tool has no motor that is run by speed",
                                .hint = "it takes --preset, --direction and --for",
                                .name = std::string(option)});
  }
  return {};
}

}  // namespace

Result<Outcome> remote_start(const RemoteStartOptions& options, Context& context) {
  const auto target =
      resolve_target(options.target, context,
                     {.why = "a motion is started one tool at a time, by somebody who watches it",
                      .instead = "start them one after the other, beginning with"});
  if (!target) return tl::unexpected(target.error());
  const auto known = load_profile(*target, context);
  if (known && known->run) return run_motor(options, *target, context);
  if (auto fits = check_tool_options(options); !fits) return tl::unexpected(fits.error());
  return run_tool(options, *target, context);
}

}  // namespace spindle::commands
