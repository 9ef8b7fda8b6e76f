#include <memory>
#include <utility>

#include "consent.hpp"
#include "run.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/owned_lines.hpp"

namespace spindle::commands {

Result<Outcome> remote_start(const RemoteStartOptions& options, Context& context) {
  const auto target =
      resolve_target(options.target, context,
                     {.why = "a motion is started one tool at a time, by a user who watches it",
                      .instead = "start them one after the other, beginning with"});
  if (!target) return tl::unexpected(target.error());
  const auto plan_for = [&](const catalogue::Profile& profile) {
    return plan_run(options, profile, *target).and_then([&](std::unique_ptr<RunPlan> plan) {
      return require_answer(plan->in_words(*target), context).map([&] { return std::move(plan); });
    });
  };
  OwnedLines lines({*target}, context,
                   [&](const std::string& sentence) { context.renderer.note(sentence); });
  const device::OpenTransport open_transport = lines.opener();
  const Context own = with_lines(context, open_transport);
  TRY_LET(auto opened,
          open_prepared(*target, Need::named_registers, Purpose::change, own, plan_for));
  auto& [tool, plan] = opened;
  TRY(plan->on(tool, context)->ask());
  const auto mode = options.stop.value_or(catalogue::StopMode::decelerate);
  // Behind the guardian, which is started while there is one thread.
  const auto on_prepared = [&] { lines.open_doors(); };
  return run_and_tell(*plan->on(tool, context), mode, tool, context, on_prepared);
}

}  // namespace spindle::commands
