#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <thread>

#include "listing.hpp"
#include "records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/device/run_model.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/last_words.hpp"
#include "spindle/work/shared_lines.hpp"
#include "spindle/work/side_by_side.hpp"
#include "spindle/work/stop_pursuit.hpp"
#include "stops.hpp"

namespace spindle::commands {
namespace {

using catalogue::StopMode;

/// The answer is of no interest here, so hardly waited for.
constexpr int hurry_divisor = 5;

/// On a line that several share each waits for those before it, and one that is not there costs
/// timeouts. So all motors are told to stop before any is asked whether it stands still. Only who
/// asks for a gentle stop waits for what has to be known for it.
void tell_to_stop(const std::vector<Target>& targets, const std::vector<std::size_t>& line,
                  const RemoteStopOptions& options, const Context& context) {
  for (const std::size_t index : line) {
    const auto profile = load_profile(targets[index], context);
    if (!profile) continue;  // told when its turn comes, as all that fails here
    const auto model = device::RunModel::of(*profile);
    if (!model || !device::has_motor(*profile)) continue;
    Context hurried = context;
    hurried.common.timeout = context.common.timeout.value_or(profile->link.answer) / hurry_divisor;
    hurried.common.retries = 0;
    auto device = connect_device(targets[index], *profile, hurried);
    if (!device) continue;
    const auto stopper = (*model)->stopper(options.stop.value_or(StopMode::decelerate));
    if (options.stop == StopMode::decelerate) stopper->observe(*device);
    static_cast<void>(stopper->send(*device));
  }
}

using Pursuits = std::vector<std::unique_ptr<StopPursuit>>;

/// In turns, so that none waits for another one that is not there.
void pursue(const std::vector<std::size_t>& line, Pursuits& pursuits, const Context& context) {
  bool goes_on = true;
  while (goes_on) {
    goes_on = false;
    for (const std::size_t index : line) {
      if (!pursuits[index]->try_stop()) goes_on = true;
    }
    if (goes_on && !context.clock.sleep_until(context.clock.now() + device::RunGuard::pause)) break;
  }
}

/// A stop waits for no other one, and no signal ends it. The results are in the order of the
/// targets.
Pursuits stop_all(const std::vector<Target>& targets, const RemoteStopOptions& options,
                  const Context& own) {
  Pursuits pursuits;
  for (const Target& target : targets) {
    pursuits.push_back(
        std::make_unique<StopPursuit>(target, options.stop.value_or(StopMode::decelerate), own));
  }
  const auto stop_line = [&](const std::vector<std::size_t>& line) {
    if (line.size() > 1) tell_to_stop(targets, line, options, own);
    pursue(line, pursuits, own);
  };
  const auto lines = by_line(targets);
  {
    std::vector<std::jthread> threads;
    for (std::size_t other = 1; other < lines.size(); ++other) {
      threads.emplace_back([&, other] { stop_line(lines[other]); });
    }
    if (!lines.empty()) stop_line(lines.front());
  }
  return pursuits;
}

/// Why a tool may still run.
std::optional<Error> failure_of(const Result<device::StopResult>& result, const Target& target,
                                const catalogue::Profile* profile) {
  if (!result) return result.error();
  if (result == device::StopResult::unconfirmed) return still_runs(target, profile);
  return std::nullopt;
}

/// A tools file that does not count as a whole: only who names a group may miss a tool.
std::optional<Error> fault_of_file(const RemoteStopOptions& options, const Context& context) {
  const auto& left_out = context.tools.left_out;
  if (!left_out) return std::nullopt;
  if (std::any_of(options.targets.begin(), options.targets.end(), names_group)) {
    return Error{
        .code = left_out->code,
        .message = fmt::format("not all of the tools file counts, so a group may lack tools: {}",
                               describe(*left_out)),
        .hint = "name each tool, or stop it at the tool"};
  }
  context.renderer.note(
      fmt::format("warning: not all of the tools file counts: {}", describe(*left_out)));
  return std::nullopt;
}

/// `unproven`: so many were acknowledged, and nothing that can be read proves them.
Summary summary_of(const Outcome& outcome, Addressing addressing, std::size_t unproven) {
  const bool everybody = addressing == Addressing::broadcast;
  const std::size_t stopped = everybody ? 0 : outcome.succeeded() - unproven;
  const std::size_t sent = everybody ? outcome.succeeded() : unproven;
  Summary summary;
  std::string words;
  if (!everybody) {
    summary.counts.push_back({"stopped", count(stopped)});
    words = fmt::format("{} stopped, ", stopped);
  }
  if (sent > 0 || everybody) {
    summary.counts.push_back({"sent", count(sent)});
    words += fmt::format("{} sent, not {}, ", sent, everybody ? "acknowledged" : "confirmed");
  }
  summary.counts.push_back({"failed", count(outcome.failed())});
  const bool has_failed = outcome.failed() > 0;
  summary.sentence = fmt::format(
      "{}{} failed{}", words, outcome.failed(),
      has_failed ? "; what could not be stopped may still run: stop it at the tool" : "");
  return summary;
}

}  // namespace

Result<Outcome> remote_stop(const RemoteStopOptions& options, Context& context) {
  // No wrong name keeps another tool running, and no fault of the tools file.
  auto [targets, faults] = resolve_each_target(options.targets, context);
  for (Target& target : targets) {
    target.addressing = options.addressing;
    target.endpoint.claim = link::Claim::beside;
    target.endpoint.gateway.clear();  // a unit that is not there must not keep the others waiting
  }
  const Context calm = uninterruptible_context(context);
  SharedLines shared(targets, calm);
  const device::OpenTransport open = shared.opener();
  const Context own = with_lines(calm, open);
  Pursuits pursuits;
  {
    const LastWords last_words(
        context,
        "THE TOOL MAY STILL RUN: a second signal ended the program before the stop was "
        "confirmed; stop it at the tool");
    pursuits = stop_all(targets, options, own);
  }
  if (auto fault = fault_of_file(options, context)) faults.push_back(std::move(*fault));
  Outcome outcome;
  Listing listing(context, stop_columns());
  std::size_t unproven = 0;
  const auto fail = [&](const Error& error) {
    outcome.fail(error);
    listing.add(error);
  };
  for (std::size_t index = 0; index < pursuits.size(); ++index) {
    const Result<device::StopResult> result = pursuits[index]->result();
    if (result) listing.add(stop_record(*result, targets[index], context.clock));
    const std::string difference = other_serial(targets[index], pursuits[index]->serial());
    if (!difference.empty()) {
      context.renderer.note(fmt::format("{}: warning: {}", targets[index].shown, difference));
    }
    if (result == device::StopResult::sent) ++unproven;
    const auto failure = failure_of(result, targets[index], pursuits[index]->profile());
    failure ? fail(*failure) : outcome.succeed();
  }
  std::for_each(faults.begin(), faults.end(), fail);
  return finish(listing, outcome, summary_of(outcome, options.addressing, unproven), context);
}

}  // namespace spindle::commands
