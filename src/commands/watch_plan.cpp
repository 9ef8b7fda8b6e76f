#include "watch_plan.hpp"

#include <fmt/format.h>

#include <utility>

#include "driver.hpp"
#include "spindle/catalogue/short_name.hpp"
#include "spindle/device/run_model.hpp"

namespace spindle::commands {
namespace {

/// Whether there is something to watch, and something to poll where it is said how.
Result<device::WatchPlan> check_purpose(const WatchOptions& options,
                                        const catalogue::Profile& profile, device::WatchPlan plan) {
  const bool polls_values = plan.motor || !plan.values.empty();
  if (plan.events == device::EventMode::none && !polls_values) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "this tool sends no events, so name what to watch",
                                .hint = "such as 'status.*'",
                                .name = profile.id});
  }
  const bool polls_events =
      plan.events != device::EventMode::none &&
      (plan.events == device::EventMode::unarmed || !catalogue::sends_unasked(profile));
  const bool says_how = options.interval || options.samples != device::Samples::changes;
  if (says_how && !polls_values && !polls_events) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "--all, --initial and --interval are about polled values",
              .hint = "name some behind the tool, such as 'status.*'"});
  }
  return plan;
}

/// What is secret is not shown by the way.
Result<void> check_secrets(const std::vector<catalogue::Parameter>& values) {
  for (const catalogue::Parameter& parameter : values) {
    if (parameter.secrecy == catalogue::Secrecy::open) continue;
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "it is a secret, and no stream shows it",
                                .hint = "'spindle get --include-secrets' does",
                                .name = parameter.name});
  }
  return {};
}

/// Why the counter alone cannot be polled instead; empty: it can.
std::string_view why_not_unarmed(const catalogue::Profile& profile) {
  if (!profile.events) return "it has no events";
  if (!catalogue::sends_unasked(profile)) return "its events are polled, it sends nothing unasked";
  if (!profile.events->first) return "where its last event can be read is not known";
  return profile.events->arm ? "" : "it sends its events whether they are wanted or not";
}

/// Whether what was asked for can be watched on some tool that is known.
Result<void> check_for_any_profile(const WatchOptions& options, ProfileShelf& shelf,
                                   const Context& context) {
  Result<void> checked;
  for (const files::ProfileEntry& entry : context.profiles.list()) {
    const auto known = shelf.take(entry.id);
    if (!known) continue;                       // another one's broken file
    if (!(*known)->profile.identity) continue;  // never found, always named
    auto plan = plan_watch(options, (*known)->profile);
    if (plan) return {};
    checked = tl::unexpected(std::move(plan.error()));
  }
  if (!checked && checked.error().code == Errc::unknown_name) {
    checked.error().message = "neither a tool, nor a parameter of any profile that is known";
  }
  return checked;
}

}  // namespace

Result<device::WatchPlan> plan_watch(const WatchOptions& options,
                                     const catalogue::Profile& profile) {
  device::WatchPlan plan{.events = options.events, .samples = options.samples};
  if (profile.events && profile.events->interval) plan.interval = *profile.events->interval;
  plan.interval = options.interval.value_or(plan.interval);
  if (options.events == device::EventMode::unarmed) {
    if (const auto why = why_not_unarmed(profile); !why.empty()) {
      return tl::unexpected(Error{.code = Errc::usage,
                                  .message = fmt::format("--no-push does nothing here: {}", why),
                                  .hint = "leave it out",
                                  .name = profile.id});
    }
  }
  if (!profile.events) plan.events = device::EventMode::none;
  const auto model = device::RunModel::of(profile);
  if (model && (*model)->monitor() != nullptr) plan.motor = *(*model)->monitor();
  const std::vector<std::string> names =
      options.names.empty() ? to_strings(profile.watched) : options.names;
  if (!names.empty()) {
    TRY_LET(const auto meant, catalogue::meant_by(names, profile));
    TRY_LET(auto values, profile.select(meant));
    TRY(check_secrets(values));
    plan.values = std::move(values);
  }
  return check_purpose(options, profile, std::move(plan));
}

Result<void> check_watch(const WatchOptions& options, const WatchedTool& tool, ProfileShelf& shelf,
                         const Context& context) {
  if (tool.known() == nullptr) return check_for_any_profile(options, shelf, context);
  const auto otherwise = [](const std::string& word, const catalogue::Profile& profile) {
    return std::string_view(catalogue::is_meant(word, profile) ? "a parameter" : "");
  };
  TRY(check_doubtful(otherwise, tool.known()->profile, context));
  return plan_watch(options, tool.known()->profile).map([](const device::WatchPlan&) {});
}

}  // namespace spindle::commands
