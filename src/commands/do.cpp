#include <fmt/format.h>

#include <utility>

#include "change_log.hpp"
#include "deeds.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"

namespace spindle::commands {
namespace {

using catalogue::Action;
using catalogue::Hazard;
using catalogue::Profile;

/// A started motion needs somebody who stops it again, and this command ends at once.
Result<void> check_guard(const Deed& deed) {
  const bool starts = deed.action.motion == catalogue::Motion::start ||
                      (deed.action.stop_value && deed.value != *deed.action.stop_value);
  if (deed.action.hazard != Hazard::moves || !starts) return {};
  return tl::unexpected(
      Error{.code = Errc::usage,
            .message = "it starts a motion, and 'do' does not stay to stop it",
            .hint = "'spindle remote-start' starts it under a guard that always ends in a stop",
            .name = deed.action.name});
}

Result<std::vector<Deed>> check_deeds(const DoOptions& options, const Profile& profile,
                                      const Target& target) {
  std::vector<Deed> deeds;
  for (const std::string& text : options.actions) {
    auto deed = parse_deed(text, profile);
    if (!deed) return tl::unexpected(std::move(deed.error()));
    auto allowed = check_guard(*deed).and_then(
        [&] { return check_evidence(deed->action, target, options.acceptance); });
    if (!allowed) return tl::unexpected(std::move(allowed.error()));
    deeds.push_back(std::move(*deed));
  }
  return deeds;
}

Result<Outcome> list_actions(const Target& target, Context& context) {
  auto profile = load_profile(target, context);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  if (target.profile.empty()) {
    auto tool = open_tool(target, catalogue::Profile(), Need::named_registers, context);
    if (!tool) return tl::unexpected(std::move(tool.error()));
    *profile = tool->device.profile();
  }
  Outcome outcome;
  Listing listing(context, action_columns());
  for (const Action& action : profile->actions) {
    listing.add(action_record(action, target.shown, context.clock));
    outcome.succeed();
  }
  return listing.end()
      .and_then([&] {
        return context.renderer.summary(
            summary_record({{"actions", number(static_cast<std::int64_t>(outcome.succeeded()))}},
                           outcome.status(), target.shown, context.clock),
            counted(outcome.succeeded(), "action"));
      })
      .map([&] { return outcome; });
}

/// Carries the deeds out in order and stops at the first that fails: later ones may rest on it.
Result<Outcome> carry_out(const std::vector<Deed>& deeds, OpenTool& tool, Context& context) {
  Outcome outcome;
  Listing listing(context, deed_columns());
  ChangeLog log("do", tool, context);
  for (const Deed& deed : deeds) {
    const auto result = perform_deed(deed, tool, context);
    log.add(logged(deed, result));
    if (result) listing.add(deed_record(deed, *result, tool.target, context.clock));
    std::optional<Error> error;
    if (!result) error = result.error();
    if (result == device::ActionResult::not_confirmed) error = not_confirmed(deed, tool.target);
    if (!error) {
      outcome.succeed();
      continue;
    }
    outcome.fail(*error);
    listing.add(*error);
    break;
  }
  return listing.end()
      .and_then([&] {
        return context.renderer.summary(
            summary_record({{tool.target.reach == Reach::everybody ? "sent" : "done",
                             number(static_cast<std::int64_t>(outcome.succeeded()))},
                            {"failed", number(static_cast<std::int64_t>(outcome.failed()))}},
                           outcome.status(), tool.target.shown, context.clock),
            fmt::format("{} {}, {} failed", outcome.succeeded(),
                        tool.target.reach == Reach::everybody ? "sent, not acknowledged" : "done",
                        outcome.failed()));
      })
      .map([&] { return outcome; });
}

}  // namespace

Result<Outcome> perform(const DoOptions& options, Context& context) {
  auto target = resolve_target(options.target, context);
  if (!target) return tl::unexpected(target.error());
  target->reach = options.reach;
  if (options.actions.empty()) return list_actions(*target, context);
  auto opened = open_prepared(*target, Need::named_registers, context, [&](const Profile& profile) {
    return check_deeds(options, profile, *target).and_then([&](std::vector<Deed> deeds) {
      return ask_for_hazards(deeds, *target, context).map([&] { return std::move(deeds); });
    });
  });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  return carry_out(opened->prepared, opened->tool, context);
}

}  // namespace spindle::commands
