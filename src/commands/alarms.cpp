#include <fmt/format.h>

#include <array>

#include "change_log.hpp"
#include "deeds.hpp"
#include "group.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"

namespace spindle::commands {
namespace {

using catalogue::Parameter;
using catalogue::Profile;
using report::Column;

constexpr std::string_view present_list = "present";
constexpr std::string_view reset_action = "alarm-reset";
/// Registers whose meaning is not known: their numbers are shown, not explained.
constexpr std::string_view data_list = "alarm-data";

/// One parameter that holds a code.
struct Source {
  std::string list;
  Parameter parameter;
  catalogue::CodeTable table = catalogue::CodeTable::error;
};

struct AlarmPlan {
  std::vector<Source> sources;
  std::optional<Deed> reset;
};

const std::array<Column, 5> columns = {{{"LIST", "list"},
                                        {"INDEX", "index", report::Align::right},
                                        {"CODE", "code", report::Align::right},
                                        {"TEXT", "text"},
                                        {"REMEDY", "remedy"}}};

/// The lists that the profile names.
Result<AlarmPlan> plan_lists(const Profile& profile) {
  AlarmPlan plan;
  for (const catalogue::AlarmList& list : profile.alarm_lists) {
    auto parameters = profile.select(list.parameters);
    if (!parameters) return tl::unexpected(std::move(parameters.error()));
    for (Parameter& parameter : *parameters) {
      plan.sources.push_back({list.name, std::move(parameter), list.codes});
    }
  }
  return plan;
}

Error no_alarms(const Profile& profile) {
  return {.code = Errc::usage,
          .message = fmt::format("profile {} names no alarms", profile.id),
          .hint = "'alarm-lists' in the profile names what is shown, see spindle-profile(5)"};
}

/// The present alarm is what proves a reset; the last event's error and the raw alarm data stand
/// beside it.
Result<AlarmPlan> plan_alarms(const Profile& profile) {
  if (!profile.alarm_lists.empty()) return plan_lists(profile);
  AlarmPlan plan;
  const auto reset = profile.find_action(reset_action);
  if (reset && !reset->confirm.empty()) {
    auto present = profile.find(reset->confirm);
    if (!present) return tl::unexpected(std::move(present.error()));
    plan.sources.push_back({std::string(present_list), std::move(*present)});
  }
  if (auto error = profile.find("event.error")) {
    plan.sources.push_back({"last-event", std::move(*error)});
  }
  if (auto data = profile.select({"alarm.*"})) {
    for (Parameter& parameter : *data)
      plan.sources.push_back({std::string(data_list), std::move(parameter)});
  }
  if (plan.sources.empty()) return tl::unexpected(no_alarms(profile));
  return plan;
}

report::Record alarm_record(const std::string& list, std::size_t index,
                            const catalogue::Value& value, const catalogue::CodeText* text,
                            const Target& target, const Clock& clock) {
  const std::int64_t code = value.number.mantissa();
  const bool is_free = code == 0 && list != data_list;
  const std::string meaning = text != nullptr ? text->text : is_free ? "none" : "";
  return {.type = "alarm",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"list", list},
                     {"index", count(index)},
                     {"code", number(code), value.to_string()},
                     {"text", text_or_null(meaning)},
                     {"remedy", text_or_null(text != nullptr ? text->remedy : "")}}};
}

/// What was found, and what became of the reset.
struct Findings {
  Outcome outcome = {};
  catalogue::Value present = {};  ///< the present alarm; 0: none was found
  bool was_asked = false;         ///< something that tells the present alarm was asked for
  bool was_told = true;           ///< and it answered
  catalogue::Resettable resettable = catalogue::Resettable::unknown;
  enum class Reset : std::uint8_t { none, done, failed } reset = Reset::none;

  /// Whether it is known that there was an alarm, or that there was none.
  [[nodiscard]] bool is_known() const { return was_present() || (was_asked && was_told); }
  [[nodiscard]] bool was_present() const { return present.number != Decimal(0); }
  /// Whether there is still an alarm now.
  [[nodiscard]] bool is_present() const { return was_present() && reset != Reset::done; }
};

/// The meaning of a code by the table of its list; null when it is not known.
const catalogue::CodeText* text_of(std::int64_t code, catalogue::CodeTable table,
                                   const catalogue::CodeTables& tables, const OpenTool& tool) {
  const auto& refusals = tool.profile->refusals;
  const catalogue::CodeTexts* texts = &tables.error;
  if (table == catalogue::CodeTable::warning) texts = &tables.warning;
  if (table == catalogue::CodeTable::refusal && refusals) texts = &refusals->codes;
  const auto known = texts->find(code);
  return known == texts->end() ? nullptr : &known->second;
}

/// One code of a list, told and remembered.
void tell(const Source& source, std::size_t index, const device::Reading& reading,
          const catalogue::CodeTables& tables, const OpenTool& tool, Findings& findings,
          Listing& listing, const Clock& clock) {
  const bool tells_present = source.list == present_list;
  findings.was_asked = findings.was_asked || tells_present;
  if (!reading.value) {
    findings.was_told = findings.was_told && !tells_present;
    findings.outcome.fail(reading.value.error());
    listing.add(reading.value.error());
    return;
  }
  findings.outcome.succeed();
  // The rest of a history that is not full says nothing.
  const bool unused = index > 1 && reading.value->number == Decimal(0);
  if (unused && !tool.profile->alarm_lists.empty()) return;
  const catalogue::CodeText* text = nullptr;
  if (source.list != data_list) {
    text = text_of(reading.value->number.mantissa(), source.table, tables, tool);
  }
  if (tells_present && !findings.was_present()) {
    findings.present = *reading.value;
    if (text != nullptr) findings.resettable = text->resettable;
  }
  listing.add(alarm_record(source.list, index, *reading.value, text, tool.target, clock));
}

Result<void> show(const AlarmPlan& plan, OpenTool& tool, Findings& findings, Context& context) {
  const auto tables = context.profiles.load_code_tables(tool.profile->path);
  if (!tables) return tl::unexpected(tables.error());
  std::vector<Parameter> parameters;
  parameters.reserve(plan.sources.size());
  for (const Source& source : plan.sources) parameters.push_back(source.parameter);
  const auto readings = tool.device.read_each(parameters, device::Limits::skip);
  if (!readings) return tl::unexpected(readings.error());
  Listing listing(context, columns);
  std::size_t index = 0;
  for (std::size_t at = 0; at < readings->size(); ++at) {
    const Source& source = plan.sources[at];
    index = at > 0 && plan.sources[at - 1].list == source.list ? index + 1 : 1;
    tell(source, index, (*readings)[at], *tables, tool, findings, listing, context.clock);
  }
  return listing.end();
}

/// Nothing that is sent ends such an alarm, and its cause has to be dealt with first.
Error not_resettable(const Findings& findings, const Target& target) {
  return target.blamed(
      {.code = Errc::negative,
       .message = fmt::format("alarm {} can not be reset by command, nothing was sent",
                              findings.present.to_string()),
       .hint = "remove its cause, then switch the tool off and on"});
}

/// Whether somebody was asked, and what the note of the reset says was told.
enum class Asked : std::uint8_t { no, yes };

Result<void> reset(const Deed& deed, Asked asked, OpenTool& tool, Findings& findings,
                   Context& context) {
  if (findings.is_present() && findings.resettable == catalogue::Resettable::no) {
    return tl::unexpected(not_resettable(findings, tool.target));
  }
  if (asked == Asked::no) tell_notes(deed, tool.target, context);
  work::ChangeLog log = change_log("alarms", tool, context);
  const auto result = perform_recorded(deed, tool, log, context);
  if (!result) return tl::unexpected(result.error());
  Listing listing(context, deed_columns());
  listing.add(deed_record(deed, *result, tool.target, context.clock));
  findings.reset = Findings::Reset::done;
  if (result == device::ActionResult::not_confirmed) {
    const Error error = not_confirmed(deed, tool.target);
    findings.reset = Findings::Reset::failed;
    findings.outcome = {};  // the reset is what was asked for
    findings.outcome.fail(error);
    listing.add(error);
  }
  return listing.end();
}

std::string sentence_of(const Findings& findings) {
  switch (findings.reset) {
    case Findings::Reset::done:
      return "no alarm present";
    case Findings::Reset::failed:
      return "the alarm was not reset";
    case Findings::Reset::none:
      break;
  }
  if (!findings.is_known()) return "whether an alarm is present is not known";
  if (!findings.is_present()) return "no alarm present";
  return fmt::format("alarm {} is present", findings.present.to_string());
}

Summary summary_of(report::Cell present, const Outcome& outcome, std::string sentence,
                   const std::string& target) {
  return {.counts = {{"present", std::move(present)}, {"failed", count(outcome.failed())}},
          .sentence = std::move(sentence),
          .target = target};
}

Result<AlarmPlan> plan(const Profile& profile, const AlarmsOptions& options, const Target& target) {
  auto plan = plan_alarms(profile);
  if (!plan || options.reset == AlarmReset::no) return plan;
  if (!profile.find_action(reset_action)) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = fmt::format("profile {} has no action that resets alarms", profile.id),
              .hint = fmt::format("an action '{}' in the profile does it, see spindle-profile(5)",
                                  reset_action)});
  }
  auto deed = parse_deed(std::string(reset_action), profile);
  if (!deed) return tl::unexpected(std::move(deed.error()));
  plan->reset = std::move(*deed);
  return check_evidence(plan->reset->action, target, options.acceptance).map([&] {
    return std::move(*plan);
  });
}

/// One tool: its alarms and, where it is wanted, their reset.
Result<Findings> examine(const Target& target, const AlarmsOptions& options, Asked asked,
                         Context& context) {
  auto opened = open_prepared(target, Need::named_registers, context, [&](const Profile& profile) {
    return plan(profile, options, target).and_then([&](AlarmPlan made) -> Result<AlarmPlan> {
      if (!made.reset || asked == Asked::yes) return made;
      return ask_for_hazards({*made.reset}, target, context).map([&] { return std::move(made); });
    });
  });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  Findings findings;
  auto done = show(opened->prepared, opened->tool, findings, context);
  if (done && opened->prepared.reset) {
    done = reset(*opened->prepared.reset, asked, opened->tool, findings, context);
  }
  if (!done) return tl::unexpected(std::move(done.error()));
  const report::Cell present =
      findings.is_known() ? count(findings.was_present() ? 1 : 0) : report::Cell();
  return tell(summary_of(present, findings.outcome, sentence_of(findings), target.shown),
              findings.outcome, context)
      .map([&] { return findings; });
}

/// The tools of a group whose alarms may be reset.
Result<Readiness<std::vector<Deed>>> agree_to_reset(const std::vector<Target>& targets,
                                                    const AlarmsOptions& options,
                                                    Context& context) {
  auto ready = make_ready(targets, options.jobs, context, [&](const Target& target, Context& own) {
    return plan_by_profile(target, own, [&](const Profile& profile) {
      return plan(profile, options, target).map([](const AlarmPlan& made) {
        return std::vector<Deed>{*made.reset};
      });
    });
  });
  if (!ready || ready->refused.failed() > 0) return ready;
  return ask_for_group(ready->targets, ready->plans, targets.size(), context).map([&] {
    return std::move(*ready);
  });
}

/// How many tools of a group had an alarm, have one still, do not say, and could not be examined or
/// reset.
struct Tally {
  std::size_t present = 0;
  std::size_t remaining = 0;
  std::size_t unknown = 0;
  std::size_t failed = 0;
};

std::string sentence_of(const Tally& tally, std::size_t failed, std::size_t of) {
  std::string found = tally.remaining == 0
                          ? std::string("no alarm present")
                          : fmt::format("alarms on {} of {}", tally.remaining, counted(of, "tool"));
  if (tally.unknown > 0) {
    const std::string unknown =
        fmt::format("not known of {} of {}", tally.unknown, counted(of, "tool"));
    found = tally.remaining == 0 && tally.unknown == of ? unknown : found + ", " + unknown;
  }
  return found + failed_in_words(failed, of);
}

Tally tally_of(const std::vector<Performance<Findings>>& performances) {
  Tally tally;
  for (const auto& [tape, found] : performances) {
    if (found && found->was_present()) ++tally.present;
    if (found && !found->is_known()) ++tally.unknown;
    if (found && found->is_present()) ++tally.remaining;
    if (!found || found->outcome.failed() > 0) ++tally.failed;
  }
  return tally;
}

Result<Outcome> examine_group(const std::vector<Target>& targets, const AlarmsOptions& options,
                              Context& context) {
  const bool resets = options.reset == AlarmReset::yes;
  std::vector<Target> reached = targets;
  Outcome outcome;
  if (resets) {
    auto ready = agree_to_reset(targets, options, context);
    if (!ready) return tl::unexpected(std::move(ready.error()));
    if (ready->refused.failed() > 0) {
      return refuse_all(ready->refused, summary_of(count(0), ready->refused, {}, {}),
                        targets.size(), context);
    }
    reached = std::move(ready->targets);
    outcome = ready->lost;
  }
  const auto performances =
      tape_each(reached, options.jobs, context, [&](const Target& target, Context& own) {
        return examine(target, options, resets ? Asked::yes : Asked::no, own);
      });
  outcome.add(outcome_of_all(performances, [](const Findings& found) { return found.outcome; }));
  const Tally tally = tally_of(performances);
  const std::size_t failed = targets.size() - reached.size() + tally.failed;
  return play(performances, context)
      .and_then([&] {
        return tell(summary_of(count(tally.present), outcome,
                               sentence_of(tally, failed, targets.size()), {}),
                    outcome, context);
      })
      .map([&] { return outcome; });
}

}  // namespace

Result<Outcome> alarms(const AlarmsOptions& options, Context& context) {
  const auto targets = resolve_one_or_group(options.target, Reach::one, context);
  if (!targets) return tl::unexpected(targets.error());
  if (is_group(options.target, Reach::one)) return examine_group(*targets, options, context);
  return examine(targets->front(), options, Asked::no, context).map([](const Findings& findings) {
    return findings.outcome;
  });
}

}  // namespace spindle::commands
