#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "listing.hpp"
#include "progress.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "seen_on_tool.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/learning.hpp"

namespace spindle::commands {
namespace {

using work::Learned;
using work::LearnPlan;
using work::LearnResult;

/// "5, 3, 7".
std::string numbers_in_words(const std::vector<std::uint16_t>& numbers) {
  return fmt::format("{}", fmt::join(numbers, ", "));
}

/// As it will stand in the user's own profile.
catalogue::Action learned_action(const LearnPlan& plan, const work::Follower& follower,
                                 const std::string& seen) {
  const catalogue::LearnedAction& what = plan.what;
  catalogue::Action action;
  action.name = what.name;
  action.title = what.title;
  action.address = {follower.address};
  action.value = follower.value;
  action.minimum = what.minimum;
  action.maximum = what.maximum;
  action.has_range = what.minimum < what.maximum;
  action.labels = what.labels;
  action.hazard = what.hazard;
  action.evidence = catalogue::Evidence::verified;
  action.source = seen;
  action.check = what.check;
  action.confirm = what.follows;
  return action;
}

std::string sentence_of(const LearnPlan& plan, const LearnResult& result, Duration waited) {
  const std::size_t changes = result.numbers.empty() ? 0 : result.numbers.size() - 1;
  const std::string seen = counted(changes, "change");
  switch (result.how) {
    case Learned::one:
      return fmt::format("register {} followed {} through {}", result.followers.front().address,
                         plan.what.follows, seen);
    case Learned::other:
      return fmt::format(
          "register {} followed {} through {}, but not number by number: what a "
          "write to it would have to be is not known",
          result.followers.front().address, plan.what.follows, seen);
    case Learned::several:
      return fmt::format(
          "{} registers followed {} through {}: which of them commands it is not "
          "known",
          result.followers.size(), plan.what.follows, seen);
    case Learned::none:
      return fmt::format(
          "none of {} followed {} through {}: its register is not among those "
          "that the tool shows from {} to {}, or follows later than within a second",
          counted(result.readable, "register"), plan.what.follows, seen, plan.where.from,
          plan.where.to);
    case Learned::unreadable:
      return fmt::format("the tool shows none of the registers from {} to {}", plan.where.from,
                         plan.where.to);
    case Learned::idle:
      return fmt::format("{} did not change for {}, with {} seen: nothing was found out",
                         plan.what.follows, to_text(waited), seen);
  }
  return {};
}

class Learn final : public Verb<LearnPlan, Outcome> {
 public:
  Learn(const LearnOptions& options, files::SeenOnTool& seen) : options_(&options), seen_(&seen) {}

  Result<Plan> plan(const catalogue::Profile& profile, const Target& /*target*/) const override {
    TRY_LET(auto plan, work::plan_learning(options_->what, profile));
    plan.changes = options_->changes;
    plan.idle_timeout = options_->idle_timeout;
    return plan;
  }

  Result<Plan> examine(OpenTool& tool, Plan plan, Context& context) const override {
    TRY(check_base(tool.device.profile(), tool.target, options_->file, context));
    return plan;
  }

  Result<Done> perform(OpenTool& tool, const Plan& plan, Context& context) const override {
    const auto result = watch(tool, plan, context);
    if (!result) return tl::unexpected(result.error());
    Outcome outcome;
    std::string sentence = sentence_of(plan, *result, plan.idle_timeout);
    std::vector<std::uint16_t> candidates;
    for (const work::Follower& each : result->followers) candidates.push_back(each.address);
    Listing listing(context, action_columns());
    std::string text;
    if (result->how == Learned::one) {
      outcome.succeed();
      name_tool(tool, context.clock, *seen_);
      listing.add(action_record(learned_action(plan, result->followers.front(), seen_->seen),
                                tool.target.shown, context.clock));
      text = profile_text(plan, *result);
    } else {
      outcome.negate();
    }
    TRY(listing.end());
    if (!text.empty()) {
      TRY_LET(const auto told, tell_profile(text, context));
      sentence += told;
    }
    return tell({.counts = {{"action", plan.what.name},
                            {"how", std::string(work::learned_words.text(result->how))},
                            {"candidates", report::Words(candidates)},
                            {"numbers", report::Words(result->numbers)},
                            {"looked_at", count(result->readable)},
                            {"file", report::text_or_null(options_->file)},
                            {"profile", report::text_or_null(text)}},
                 .sentence = std::move(sentence),
                 .target = tool.target.shown},
                outcome, context)
        .map([&] { return outcome; });
  }

 private:
  static Result<LearnResult> watch(OpenTool& tool, const Plan& plan, Context& context) {
    ProgressLine progress(context);
    const auto tell = [&](const work::LearnNews& news) {
      const std::string left = counted(news.candidates, "register");
      if (news.kind == work::LearnNews::Kind::ready) {
        context.renderer.note(
            fmt::format("{} is {}; now {}, {} times, some seconds apart ({} looked at)",
                        plan.what.follows, news.to, plan.what.deed, plan.changes, left));
      } else {
        context.renderer.note(fmt::format("{} of {}: {} {} -> {}; {} may be the one", news.changes,
                                          plan.changes, plan.what.follows, news.from, news.to,
                                          left));
      }
    };
    return work::learn_register(tool, plan, context.clock, tell,
                                progress.counter(tool.target.shown + ": registers asked"));
  }

  [[nodiscard]] std::string profile_text(const Plan& plan, const LearnResult& result) const {
    const work::Follower& follower = result.followers.front();
    seen_->action = {plan.what, follower.address, follower.value.value_or(0)};
    seen_->remarks = {fmt::format(
        "Register {} followed {} through {} ({}). That a write to it acts was not tried.",
        follower.address, plan.what.follows, counted(result.numbers.size() - 1, "change"),
        numbers_in_words(result.numbers))};
    return files::render_user_profile(*seen_);
  }

  /// Writes the profile, or shows it; returns how the summary goes on. What was found by hand is
  /// shown also where it cannot be written.
  Result<std::string> tell_profile(const std::string& text, Context& context) const {
    if (options_->file.empty()) {
      TRY(show_profile(text, context));
      context.renderer.note("these are lines for a profile of your own; -f FILE writes them");
      return std::string();
    }
    auto written = context.disk.write(options_->file, text, Overwrite::refuse, Privacy::usual);
    if (!written) {
      TRY(show_profile(text, context));
      return tl::unexpected(std::move(written.error()));
    }
    return fmt::format("; {} has it: use it with --profile {}, or in the tools file",
                       options_->file, shell_word(options_->file));
  }

  const LearnOptions* options_;
  files::SeenOnTool* seen_;
};

}  // namespace

Result<Outcome> learn(const LearnOptions& options, Context& context) {
  TRY_LET(auto seen, begin_user_profile(options.file, context));
  TRY_LET(auto target, resolve_target(options.target, context));
  return run_verb(Learn(options, seen), {.tools = {std::move(target)}}, 1, context);
}

}  // namespace spindle::commands
