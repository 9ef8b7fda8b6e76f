#pragma once

#include <fmt/format.h>

#include "driver.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/work/change.hpp"
#include "spindle/work/shared_lines.hpp"

namespace spindle::commands {

/// Tools for which something is planned, and how the others came out.
template <typename Plan>
struct Preflight {
  std::vector<Planned<Plan>> planned = {};
  Outcome unavailable = {};  ///< of tools that cannot be had now: the others go on
  Outcome rejected = {};     ///< of tools that what was asked for does not fit: none goes on
};

/// One verb on its way through the tools of one command.
template <typename V>
class VerbRun {
 public:
  using Plan = typename V::Plan;
  using Done = typename V::Done;
  using Profile = catalogue::Profile;

  /// Both must outlive it. At most `jobs` tools are handled at the same time.
  VerbRun(const V& verb, std::size_t jobs, Context& context)
      : verb_(&verb), jobs_(jobs), context_(&context) {}

  /// One tool is told of at once; a group in the order of its tools, with a column for their
  /// names. Errors: what ended the command before anything was told of a tool.
  Result<Outcome> on_one(const Target& target);
  Result<Outcome> on_group(const std::vector<Target>& tools);

 private:
  [[nodiscard]] Purpose purpose() const {
    return verb_->changes_tools() ? Purpose::change : Purpose::read;
  }
  Result<Plan> plan_for(const Profile& profile, const Target& target) const;
  Result<Opened<Plan>> open(const Target& target, Context& context) const;
  Result<Opened<Plan>> open_again(const Planned<Plan>& planned, Context& context) const;
  Result<Plan> ask_for_one(const Target& target, Plan plan) const;
  Result<Planned<Plan>> plan_by_profile(const Target& target, const Context& context) const;
  Result<Planned<Plan>> plan_one(const Target& target, Context& context) const;
  Result<Done> finish(OpenTool& tool, const Plan& plan, Context& context) const;
  Result<Done> take_turn(const Target& target, Context& context) const;
  Result<Done> take_turn(const Planned<Plan>& planned, Context& context) const;

  [[nodiscard]] Result<void> check_fit(const std::vector<Target>& tools) const;
  [[nodiscard]] Result<void> check_all_fit(const std::vector<Target>& tools) const;
  [[nodiscard]] Result<void> check_one_fits(const std::vector<Target>& tools) const;
  Result<Preflight<Plan>> prepare(const std::vector<Target>& tools) const;
  Result<Outcome> reject(const Outcome& rejected, std::size_t of) const;
  Result<Outcome> each_alone(const std::vector<Target>& tools) const;
  Result<Outcome> all_together(const std::vector<Target>& tools) const;

  const V* verb_;
  std::size_t jobs_;
  Context* context_;
};

/// Runs a verb on what a command line means.
template <typename V>
Result<Outcome> run_verb(const V& verb, const Targets& targets, std::size_t jobs,
                         Context& context) {
  VerbRun<V> run(verb, jobs, context);
  return targets.is_group ? run.on_group(targets.tools) : run.on_one(targets.tools.front());
}

/// A word that was taken for a tool must not be meant as something else.
template <typename V>
auto VerbRun<V>::plan_for(const Profile& profile, const Target& target) const -> Result<Plan> {
  const auto otherwise = [&](const std::string& word, const Profile& of) {
    return verb_->otherwise(word, of);
  };
  TRY(check_doubtful(otherwise, profile, *context_));
  return verb_->plan(profile, target);
}

// ---- one tool ----

template <typename V>
auto VerbRun<V>::ask_for_one(const Target& target, Plan plan) const -> Result<Plan> {
  std::vector<Planned<Plan>> planned;
  planned.push_back({target, std::move(plan)});
  return verb_->ask(planned, 1, *context_).map([&] { return std::move(planned.front().plan); });
}

template <typename V>
Result<Outcome> VerbRun<V>::on_one(const Target& target) {
  const auto ask_by = [&](typename V::Basis basis, const Target& asked, Plan plan) -> Result<Plan> {
    if (verb_->question_basis() != basis) return plan;
    return ask_for_one(asked, std::move(plan));
  };
  auto opened =
      open_prepared(target, verb_->need(), purpose(), *context_, [&](const Profile& profile) {
        return plan_for(profile, target).and_then([&](Plan plan) {
          return ask_by(V::Basis::profile, target, std::move(plan));
        });
      });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  tell_remarks(opened->tool, *context_);
  if (verb_->changes_tools()) tell_caution(opened->tool, *context_);
  const auto plan = verb_->examine(opened->tool, std::move(opened->prepared), *context_)
                        .and_then([&](Plan known) {
                          return ask_by(V::Basis::tool, opened->tool.target, std::move(known));
                        });
  if (!plan) return tl::unexpected(plan.error());
  return finish(opened->tool, *plan, *context_).map([](const Done& done) {
    return outcome_of(done);
  });
}

template <typename V>
auto VerbRun<V>::finish(OpenTool& tool, const Plan& plan, Context& context) const -> Result<Done> {
  if (!verb_->needs_tool(plan)) return verb_->conclude(tool.target, plan, context);
  Context own = about(context, tool.target);
  auto done = verb_->perform(tool, plan, own);
  if (!done && !is_of_stream(done.error())) {
    done.error() = with_target(std::move(done.error()), tool.target);
  }
  return done;
}

// ---- several tools, each alone ----

template <typename V>
auto VerbRun<V>::open(const Target& target, Context& context) const -> Result<Opened<Plan>> {
  auto opened = open_prepared(target, verb_->need(), purpose(), context,
                              [&](const Profile& profile) { return plan_for(profile, target); });
  if (!opened) return opened;
  tell_remarks(opened->tool, context);
  if (verb_->changes_tools()) tell_caution(opened->tool, context);
  auto plan = verb_->examine(opened->tool, std::move(opened->prepared), context);
  if (!plan) return tl::unexpected(std::move(plan.error()));
  return Opened<Plan>{std::move(opened->tool), std::move(*plan)};
}

template <typename V>
auto VerbRun<V>::take_turn(const Target& target, Context& context) const -> Result<Done> {
  auto opened = begin_turn(target, context).and_then([&] { return open(target, context); });
  if (opened) return finish(opened->tool, opened->prepared, context);
  return verb_->give_up(target, nullptr, with_target(std::move(opened.error()), target), context);
}

template <typename V>
Result<Outcome> VerbRun<V>::each_alone(const std::vector<Target>& tools) const {
  const auto output = make_output(tools.size(), verb_->live_columns(), context_->renderer);
  SharedLines lines(tools, *context_, SharedLines::Of::gateways);
  const device::OpenTransport open = lines.opener();
  Context sharing = with_lines(*context_, open);
  typename V::AllDone all{.tools = tools.size()};
  all.done = for_each_told(tools, jobs_, *output, sharing, [&](const auto& target, Context& own) {
    return take_turn(target, own);
  });
  all.outcome = outcome_of_all(all.done);
  return end_group(*output, verb_->summary(all), all.outcome, *context_);
}

// ---- several tools, planned together ----

/// A tool whose profile was not named is asked what it is.
template <typename V>
auto VerbRun<V>::plan_by_profile(const Target& target, const Context& context) const
    -> Result<Planned<Plan>> {
  auto profile = load_profile(target, context);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  Target known = target;
  if (!target.profile.empty()) {
    if (auto meant = check_addressing(target, *profile); !meant)
      return tl::unexpected(meant.error());
  } else {
    auto tool = open_tool(target, Profile(), Need::named_registers, purpose(), context);
    if (!tool) return tl::unexpected(std::move(tool.error()));
    known = known_target(*tool);
    *profile = *tool->profile;
  }
  return plan_for(*profile, target).map([&](Plan plan) {
    return Planned<Plan>{std::move(known), std::move(plan)};
  });
}

template <typename V>
auto VerbRun<V>::plan_one(const Target& target, Context& context) const -> Result<Planned<Plan>> {
  if (verb_->basis() == V::Basis::profile) return plan_by_profile(target, context);
  return open(target, context).map([](Opened<Plan> opened) {
    return Planned<Plan>{known_target(opened.tool), std::move(opened.prepared)};
  });
}

/// Error `interrupted` when a signal ends it.
template <typename V>
auto VerbRun<V>::prepare(const std::vector<Target>& tools) const -> Result<Preflight<Plan>> {
  RecordedOutput output(tools.size(), context_->renderer);
  auto results =
      for_each_told(tools, jobs_, output, *context_, [&](const Target& target, Context& own) {
        return begin_turn(target, own).and_then([&] { return plan_one(target, own); });
      });
  Preflight<Plan> preflight;
  for (std::size_t index = 0; index < results.size(); ++index) {
    auto& result = results[index];
    if (result) {
      preflight.planned.push_back(std::move(*result));
    } else if (work::is_interruption(result.error())) {
      Error error = context_->interrupt.error();
      error.message = "interrupted, nothing was changed";
      return tl::unexpected(std::move(error));
    } else {
      const bool is_unfit = tools[index].fault.empty() && rejects_all(result.error());
      (is_unfit ? preflight.rejected : preflight.unavailable).fail(result.error());
    }
  }
  return output.end().map([&] { return std::move(preflight); });
}

/// What was asked for does not fit some tools, so nothing is done on any.
template <typename V>
Result<Outcome> VerbRun<V>::reject(const Outcome& rejected, std::size_t of) const {
  Summary summary =
      verb_->summary({.tools = of, .outcome = rejected, .is_rejected = true}).value_or(Summary());
  summary.sentence = fmt::format("nothing was done: this does not fit {} of {}", rejected.failed(),
                                 counted(of, "tool"));
  return tell(std::move(summary), rejected, *context_).map([&] { return rejected; });
}

template <typename V>
auto VerbRun<V>::open_again(const Planned<Plan>& planned, Context& context) const
    -> Result<Opened<Plan>> {
  auto profile = load_profile(planned.target, context);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  auto tool = open_tool(planned.target, std::move(*profile), verb_->need(), purpose(), context);
  if (!tool) return tl::unexpected(std::move(tool.error()));
  auto plan = verb_->confirm(*tool, planned.plan, context);
  if (!plan) return tl::unexpected(with_target(std::move(plan.error()), tool->target));
  return Opened<Plan>{std::move(*tool), std::move(*plan)};
}

template <typename V>
auto VerbRun<V>::take_turn(const Planned<Plan>& planned, Context& context) const -> Result<Done> {
  const auto& [target, plan] = planned;
  if (auto begun = begin_turn(target, context); !begun) {
    return tl::unexpected(std::move(begun.error()));
  }
  if (!verb_->needs_tool(plan)) return verb_->conclude(target, plan, context);
  auto opened = open_again(planned, context);
  if (opened) return finish(opened->tool, opened->prepared, context);
  return verb_->give_up(target, &plan, with_target(std::move(opened.error()), target), context);
}

template <typename V>
Result<Outcome> VerbRun<V>::all_together(const std::vector<Target>& tools) const {
  auto preflight = prepare(tools);
  if (!preflight) return tl::unexpected(std::move(preflight.error()));
  if (preflight->rejected.failed() > 0) return reject(preflight->rejected, tools.size());
  typename V::AllDone all{.tools = tools.size(), .planned = std::move(preflight->planned)};
  if (auto agreed = verb_->ask(all.planned, all.tools, *context_); !agreed) {
    return tl::unexpected(std::move(agreed.error()));
  }
  RecordedOutput output(all.planned.size(), context_->renderer);
  all.done =
      for_each_told(all.planned, jobs_, output, *context_,
                    [&](const auto& planned, Context& own) { return take_turn(planned, own); });
  all.outcome = outcome_of_all(all.done);
  all.outcome.add(preflight->unavailable);
  return end_group(output, verb_->summary(all), all.outcome, *context_);
}

// ---- several tools ----

/// What is wrong for the first tool whose profile is known.
template <typename V>
Result<void> VerbRun<V>::check_all_fit(const std::vector<Target>& tools) const {
  for (const Target& target : tools) {
    if (target.profile.empty()) continue;  // asked later, or its entry has a fault
    const auto profile = load_profile(target, *context_);
    if (!profile) return tl::unexpected(with_target(profile.error(), target));
    const auto plan = plan_for(*profile, target);
    if (!plan) return tl::unexpected(with_target(plan.error(), target));
  }
  return {};
}

/// What is wrong for every tool; fine as soon as it fits one, or as one of them has to say first
/// what it is.
template <typename V>
Result<void> VerbRun<V>::check_one_fits(const std::vector<Target>& tools) const {
  Result<void> checked;
  for (const Target& target : tools) {
    if (!target.fault.empty()) continue;
    if (target.profile.empty()) return {};
    const auto profile = load_profile(target, *context_);
    if (!profile) return {};  // told as one of this tool
    const auto plan = plan_for(*profile, target);
    if (plan) return {};
    if (checked) checked = tl::unexpected(plan.error());
  }
  return checked;
}

template <typename V>
Result<void> VerbRun<V>::check_fit(const std::vector<Target>& tools) const {
  switch (verb_->fit()) {
    case V::Fit::none:
      break;
    case V::Fit::one:
      return check_one_fits(tools);
    case V::Fit::all:
      return check_all_fit(tools);
  }
  return {};
}

template <typename V>
Result<Outcome> VerbRun<V>::on_group(const std::vector<Target>& tools) {
  if (auto fits = check_fit(tools); !fits) return tl::unexpected(std::move(fits.error()));
  return verb_->changes_tools() ? all_together(tools) : each_alone(tools);
}

}  // namespace spindle::commands
