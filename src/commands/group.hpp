#pragma once

#include <fmt/format.h>

#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "listing.hpp"
#include "progress.hpp"
#include "side_by_side.hpp"
#include "spindle/commands/target.hpp"
#include "tape.hpp"

namespace spindle::commands {

/// The targets of a command that takes one or a group; a broadcast has one, which is everybody.
Result<std::vector<Target>> resolve_one_or_group(const std::string& text, Reach reach,
                                                 const Context& context);

/// Whether the targets of this text are told of, and asked about, as a group: even one of a single
/// tool is, so that a program can rely on the columns. A broadcast has one target.
bool is_group(const std::string& text, Reach reach);

/// "2 of 3 tools (station3, station4)"; without "of 3" where these are all.
std::string tools_in_words(const std::vector<std::string>& names, std::size_t of);

/// "; 1 of 3 tools failed"; empty where none did.
std::string failed_in_words(std::size_t failed, std::size_t of);

/// What was told of one of several tools, and what came of it.
template <typename Handled>
struct Performance {
  std::unique_ptr<Tape> tape;
  Result<Handled> result;
};

/// The error as one of this tool, unless it says that already.
Error of_tool(const Target& target, Error error);

/// A tool whose turn came after the request to end.
Error not_begun(const Target& target, const Context& context);

/// Calls `handle(target, context)` side by side with a context whose renderer is a tape of this
/// tool's own. An error that it returns is on the tape, too. After a signal nothing more is begun.
template <typename Handle>
auto tape_each(const std::vector<Target>& targets, std::size_t jobs, Context& context,
               Handle handle) {
  using Attempt = std::invoke_result_t<Handle, const Target&, Context&>;
  using Part = Performance<typename Attempt::value_type>;
  ProgressLine progress(context);
  const auto handle_one = [&](const Target& target) {
    auto tape = std::make_unique<Tape>();
    Context own = with_renderer(context, *tape);
    Attempt attempt = context.interrupt.signalled()
                          ? Attempt(tl::unexpected(not_begun(target, context)))
                          : handle(target, own);
    if (!attempt) {
      attempt.error() = of_tool(target, std::move(attempt.error()));
      static_cast<void>(tape->error(attempt.error(), context.clock.wall()));
    }
    return Part{std::move(tape), std::move(attempt)};
  };
  return side_by_side(targets, jobs, handle_one, &progress);
}

/// Shows what was told of each.
template <typename Handled>
Result<void> play(const std::vector<Performance<Handled>>& performances, Context& context) {
  std::vector<const Tape*> tapes;
  tapes.reserve(performances.size());
  for (const auto& performance : performances) tapes.push_back(performance.tape.get());
  return play(tapes, context.renderer);
}

/// How all of them ended; a tool's own outcome is found by `outcome_of(handled)`.
template <typename Handled, typename OutcomeOf>
Outcome outcome_of_all(const std::vector<Performance<Handled>>& performances,
                       OutcomeOf outcome_of) {
  Outcome outcome;
  for (const auto& [tape, result] : performances) {
    result ? outcome.add(outcome_of(*result)) : outcome.fail(result.error());
  }
  return outcome;
}

inline Outcome outcome_of_all(const std::vector<Performance<Outcome>>& performances) {
  return outcome_of_all(performances, [](const Outcome& outcome) { return outcome; });
}

/// Tools for which something is planned, and how the others ended.
template <typename Plan>
struct Readiness {
  std::vector<Target> targets = {};
  std::map<std::string, Plan> plans = {};  ///< by the target's name
  Outcome lost = {};                       ///< of tools that can not be had now: the others go on
  Outcome refused = {};                    ///< of tools that what was asked for does not fit
};

/// A target with everything that was found out about it, and what is planned for it.
template <typename Plan>
struct Planned {
  Target target;
  Plan plan;
};

/// Whether such a failure says that the request is wrong rather than that the tool is not there.
bool refuses_all(const Error& error);

bool is_interruption(const Error& error);

/// The error of a write; of one that was cut off it also says that its effect is not known.
Error of_write(const std::string& parameter, Error error);

/// Calls `make_plan(target, context)` side by side and tells what failed. Changes nothing. Error
/// `interrupted` when a signal ends it.
template <typename MakePlan>
auto make_ready(const std::vector<Target>& targets, std::size_t jobs, Context& context,
                MakePlan make_plan) {
  using Made = typename std::invoke_result_t<MakePlan, const Target&, Context&>::value_type;
  using Ready = Readiness<decltype(Made::plan)>;
  auto performances = tape_each(targets, jobs, context, make_plan);
  Ready ready;
  for (auto& [tape, result] : performances) {
    if (result) {
      ready.targets.push_back(result->target);
      ready.plans.emplace(result->target.shown, std::move(result->plan));
    } else if (is_interruption(result.error())) {
      Error error = context.interrupt.error();
      error.message = "interrupted, nothing was changed";
      return Result<Ready>(tl::unexpected(std::move(error)));
    } else {
      (refuses_all(result.error()) ? ready.refused : ready.lost).fail(result.error());
    }
  }
  return play(performances, context).map([&] { return std::move(ready); });
}

/// Ends a command whose request does not fit some tools of a group of `of`, so that nothing was
/// done on any; the counts are those of the summary given.
Result<Outcome> refuse_all(const Outcome& refused, Summary summary, std::size_t of,
                           Context& context);

/// Plans by the tool's profile alone; a tool whose profile nobody named is asked what it is.
template <typename MakePlan>
auto plan_by_profile(const Target& target, const Context& context, MakePlan make_plan) -> Result<
    Planned<typename std::invoke_result_t<MakePlan, const catalogue::Profile&>::value_type>> {
  using Plan = typename std::invoke_result_t<MakePlan, const catalogue::Profile&>::value_type;
  auto profile = load_profile(target, context);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  Target known = target;
  if (!target.profile.empty()) {
    if (auto meant = check_reach(target, *profile); !meant) return tl::unexpected(meant.error());
  } else {
    auto tool = open_tool(target, catalogue::Profile(), Need::named_registers, context);
    if (!tool) return tl::unexpected(std::move(tool.error()));
    known = known_target(*tool);
    *profile = *tool->profile;
  }
  return make_plan(*profile).map([&](Plan plan) {
    return Planned<Plan>{std::move(known), std::move(plan)};
  });
}

/// What is wrong for the first tool whose profile is known, before any tool is asked.
template <typename Prepare>
Result<void> check_known(const std::vector<Target>& targets, const Context& context,
                         Prepare prepare) {
  for (const Target& target : targets) {
    if (target.profile.empty()) continue;
    const auto profile = load_profile(target, context);
    if (!profile) return tl::unexpected(of_tool(target, profile.error()));
    const auto prepared = prepare(*profile);
    if (!prepared) return tl::unexpected(of_tool(target, prepared.error()));
  }
  return {};
}

/// What is wrong for every tool, before any is asked; fine as soon as it fits one, or as one of
/// them has to say first what it is.
template <typename Prepare>
Result<void> check_for_some(const std::vector<Target>& targets, const Context& context,
                            Prepare prepare) {
  Result<void> checked;
  for (const Target& target : targets) {
    if (target.profile.empty()) return {};
    const auto profile = load_profile(target, context);
    if (!profile) return {};  // told as one of this tool
    const auto prepared = prepare(*profile);
    if (prepared) return {};
    if (checked) checked = tl::unexpected(prepared.error());
  }
  return checked;
}

}  // namespace spindle::commands
