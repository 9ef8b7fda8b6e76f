#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "deeds.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "side_by_side.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"
#include "spindle/device/motor.hpp"
#include "spindle/device/run_guard.hpp"
#include "stops.hpp"

namespace spindle::commands {
namespace {

/// Neither asks nor waits for anything but the proof: somebody wants this tool to stand still.
Result<device::StopResult> stop_one(const Target& target, const RemoteStopOptions& options,
                                    const Context& context) {
  auto profile = load_profile(target, context);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  auto tool = open_tool(target, std::move(*profile), Need::stop_word, context);
  if (!tool) return tl::unexpected(std::move(tool.error()));
  if (tool->profile->run)
    return stop_motor(*tool, options.stop.value_or(catalogue::StopMode::decelerate), context);
  const auto start = find_start(*tool->profile);
  if (!start) return tl::unexpected(start.error());
  // A stop may be repeated without harm, and one lost answer must not leave a motor running.
  auto stopped = device::stop_and_confirm(tool->device, *start, context.clock);
  for (int again = 1; again < most_stops && leaves_open(stopped); ++again) {
    stopped = device::stop_and_confirm(tool->device, *start, context.clock);
  }
  return stopped;
}

/// The answer is of no interest here, so hardly waited for.
constexpr int haste = 5;

/// On a line that several share each waits for those before it, and one that is not there costs
/// timeouts. So all motors are told to stop before any is asked whether it stands still.
void tell_to_stop(const std::vector<Target>& targets, const std::vector<std::size_t>& line,
                  const RemoteStopOptions& options, const Context& context) {
  for (const std::size_t index : line) {
    const auto profile = load_profile(targets[index], context);
    if (!profile) continue;  // told when its turn comes, as all that fails here
    const auto motor = device::Motor::of(*profile);
    if (!motor) continue;
    Context hurried = context;
    hurried.common.timeout = context.common.timeout.value_or(profile->link.answer) / haste;
    auto device = connect_device(targets[index], *profile, hurried);
    if (!device) continue;
    const catalogue::RunFacts& facts = motor->facts();
    const bool instant = options.stop == catalogue::StopMode::instant;
    static_cast<void>(
        motor->command(*device, instant ? facts.instant_always : facts.decelerate_always));
  }
}

/// A stop waits for no other one. The results are in the order of the targets.
std::vector<Result<device::StopResult>> stop_all(const std::vector<Target>& targets,
                                                 const RemoteStopOptions& options,
                                                 const Context& context) {
  const auto lines = by_line(targets);
  return side_by_side(targets, targets.size(), [&](const Target& target) {
    for (const auto& line : lines) {
      const bool begins = line.size() > 1 && &target == &targets[line.front()];
      if (begins) tell_to_stop(targets, line, options, context);
    }
    return stop_one(target, options, context);
  });
}

/// Why a tool may still run.
std::optional<Error> failure_of(const Result<device::StopResult>& result, const Target& target) {
  if (!result) return result.error();
  if (result == device::StopResult::unconfirmed) return still_runs(target);
  return std::nullopt;
}

Summary summary_of(const Outcome& outcome, Reach reach) {
  const bool everybody = reach == Reach::everybody;
  return {.counts = {{everybody ? "sent" : "stopped", count(outcome.succeeded())},
                     {"failed", count(outcome.failed())}},
          .sentence =
              fmt::format("{} {}, {} failed{}", outcome.succeeded(),
                          everybody ? "sent, not acknowledged" : "stopped", outcome.failed(),
                          outcome.failed() == 0
                              ? ""
                              : "; what could not be stopped may still run: stop it at the tool")};
}

}  // namespace

Result<Outcome> remote_stop(const RemoteStopOptions& options, Context& context) {
  // Nobody's wrong name keeps another tool running, and no fault of the tools file.
  auto [targets, faults] = resolve_each_target(options.targets, context);
  if (const auto& left_out = context.tools.left_out) {
    const bool may_lack_some =
        std::any_of(options.targets.begin(), options.targets.end(), names_group);
    if (may_lack_some) {
      faults.push_back({.code = left_out->code,
                        .message = fmt::format("not all of the tools file counts, so a group may "
                                               "lack tools: {}",
                                               describe(*left_out)),
                        .hint = "name each tool, or stop it at the tool"});
    } else {
      context.renderer.note(
          fmt::format("warning: not all of the tools file counts: {}", describe(*left_out)));
    }
  }
  for (Target& target : targets) {
    target.reach = options.reach;
    target.endpoint.claim = link::Claim::beside;
  }
  const auto results = stop_all(targets, options, context);
  Outcome outcome;
  Listing listing(context, stop_columns());
  const auto fail = [&](const Error& error) {
    outcome.fail(error);
    listing.add(error);
  };
  for (std::size_t index = 0; index < results.size(); ++index) {
    const Result<device::StopResult>& result = results[index];
    if (result) listing.add(stop_record(*result, targets[index], context.clock));
    const auto failure = failure_of(result, targets[index]);
    failure ? fail(*failure) : outcome.succeed();
  }
  std::for_each(faults.begin(), faults.end(), fail);
  return finish(listing, outcome, summary_of(outcome, options.reach), context);
}

}  // namespace spindle::commands
