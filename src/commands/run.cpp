#include "run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "change_log.hpp"
#include "command_register_run.hpp"
#include "command_word_run.hpp"
#include "start_action_run.hpp"

namespace spindle::commands {
namespace {

using catalogue::Profile;

/// The options of a start that only some models have, and whether each was given.
std::vector<std::pair<std::string_view, bool>> given_options(const RemoteStartOptions& options) {
  return {{"--preset", !options.preset.empty()},
          {"--direction", !options.direction.empty()},
          {"--speed", !options.speed.empty()},
          {"--reverse", options.direction_of_motor == catalogue::Direction::reverse},
          {"--operation", options.operation.has_value()},
          {"--acceleration", !options.acceleration.empty()},
          {"--deceleration", !options.deceleration.empty()},
          {"--watchdog", options.watchdog.has_value()},
          {"--stop", options.stop.has_value()}};
}

Result<void> check_options(const RemoteStartOptions& options, const Profile& profile) {
  const std::vector<std::string> declared = start_options(profile);
  for (const auto& [option, is_given] : given_options(options)) {
    const bool is_known = std::find(declared.begin(), declared.end(), option) != declared.end();
    if (!is_given || is_known) continue;
    return tl::unexpected(
        bad_option(option,
                   fmt::format("{} is run by the model {}, which has no such option", profile.id,
                               catalogue::to_text(profile.run->kind())),
                   fmt::format("it takes {}", fmt::join(declared, ", "))));
  }
  return {};
}

}  // namespace

std::vector<std::string> start_options(const Profile& profile) {
  std::vector<std::string> options;
  if (!profile.run || profile.run->is_derived) return options;
  if (const auto* action = profile.run->action()) {
    for (const auto& selection : action->selections) {
      options.push_back(fmt::format("--{}", selection.option));
    }
  }
  if (const auto* word = profile.run->word()) {
    options = {"--speed", "--reverse", "--operation", "--acceleration", "--deceleration", "--stop"};
    if (!word->watchdog.empty()) options.emplace_back("--watchdog");
  }
  if (const auto* values = profile.run->command_register()) {
    if (!values->set_point.empty()) options.emplace_back("--speed");
    if (values->reverse) options.emplace_back("--reverse");
    if (values->instant) options.emplace_back("--stop");
  }
  options.emplace_back("--for");
  return options;
}

ToolRun::ToolRun(OpenTool& tool, Context& context)
    : tool_(&tool), context_(&context), log_(change_log("remote-start", tool, context)) {}

Result<std::unique_ptr<RunPlan>> plan_run(const RemoteStartOptions& options, const Profile& profile,
                                          const Target& target) {
  const auto model = device::RunModel::of(profile);
  if (!model) return tl::unexpected(model.error());
  if (profile.run->is_derived) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "its profile does not say how it is run, so it can be stopped, and is not "
                         "started",
              .hint = "'run' in the profile names the action that starts it, see "
                      "spindle-profile(5)",
              .name = profile.id});
  }
  TRY(check_options(options, profile));
  switch (profile.run->kind()) {
    case catalogue::RunKind::start_action:
      return plan_start_action(options, profile, target);
    case catalogue::RunKind::command_word:
      return plan_command_word(options, profile, target);
    case catalogue::RunKind::command_register:
      break;
  }
  return plan_command_register(options, profile, target);
}

Result<Outcome> run_and_tell(ToolRun& run, catalogue::StopMode mode, OpenTool& tool,
                             Context& context, const std::function<void()>& on_prepared) {
  const auto columns = run.columns();
  RunOutput output(columns, tool, context, run.log(), on_prepared);
  run.show_on(output);
  return run_guarded(run, mode, tool, run.log(), context, output)
      .and_then([&](const work::RunReport& report) { return output.end(report); });
}

}  // namespace spindle::commands
