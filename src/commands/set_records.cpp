#include "set_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "recording.hpp"
#include "records.hpp"

namespace spindle::commands {
namespace {

using catalogue::Parameter;
using catalogue::Value;
using report::Align;
using report::Column;

const std::array<Column, 5> plan_columns = {{{"NAME", "name"},
                                             {"OLD", "old", Align::right},
                                             {"NEW", "new", Align::right},
                                             {"UNIT", "unit"},
                                             {"CHANGES", "changes"}}};

const std::array<Column, 5> write_columns = {{{"NAME", "name"},
                                              {"OLD", "old", Align::right},
                                              {"NEW", "new", Align::right},
                                              {"UNIT", "unit"},
                                              {"RESULT", "result"}}};

/// When a value acts; empty where there is nothing to say.
std::string_view effect_words(const std::optional<catalogue::Effect>& effect) {
  if (!effect) return "";
  switch (*effect) {
    case catalogue::Effect::at_once:
      return "";
    case catalogue::Effect::after_stop:
      return "takes effect when the motor stands still";
    case catalogue::Effect::after_configuration:
      return "takes effect after 'do configure'";
    case catalogue::Effect::after_power_cycle:
      return "takes effect after 'do save' and switching off and on";
    case catalogue::Effect::unknown:
      return "takes effect at a moment that is not known; at the latest after 'do save' and "
             "switching off and on";
  }
  return "";
}

/// What was typed, also of the elements of a list that are as they were typed.
report::Cell typed_cell(const Value& value) {
  if (value.content != catalogue::Content::list) return *value.typed;
  report::Numbers numbers;
  for (const Value& element : value.elements) {
    numbers.push_back(element.typed.value_or(element.number));
  }
  return numbers;
}

}  // namespace

Ending ending_of(device::WriteResult result) {
  switch (result) {
    case device::WriteResult::written:
      return Ending::written;
    case device::WriteResult::coerced:
      return Ending::coerced;
    case device::WriteResult::mismatch:
      return Ending::mismatch;
    case device::WriteResult::refused:
      return Ending::refused;
    case device::WriteResult::unknown:
      break;
  }
  return Ending::unknown;
}

std::span<const Column> set_plan_columns() { return plan_columns; }

std::span<const Column> set_columns() { return write_columns; }

report::Record change_record(const Parameter& parameter, const std::optional<Value>& before,
                             Ending ending, const Value& now, const Target& target,
                             const Clock& clock) {
  const bool planned = ending == Ending::planned;
  const bool is_secret = parameter.secrecy == catalogue::Secrecy::secret;
  report::Record record{.type = planned ? "plan" : "write",
                        .target = target.shown,
                        .time = clock.wall(),
                        .fields = {}};
  record.fields = {{"name", parameter.name},
                   {"register", number(parameter.address.value)},
                   {"old", before && !is_secret ? value_cell(*before) : report::Cell(),
                    before ? shown_of(parameter, *before) : std::string()},
                   {"new", is_secret ? report::Cell() : value_cell(now), shown_of(parameter, now)},
                   {"unit", text_or_null(unit_of(parameter, target))}};
  if (now.is_rounded() && !is_secret) record.fields.push_back({"typed", typed_cell(now)});
  if (planned) {
    const bool changes = before != now;
    record.fields.push_back({"changes", changes, changes ? "yes" : "no"});
  }
  record.fields.push_back({"result", std::string(ending_words.text(ending))});
  return record;
}

report::Record step_record(const SetStep& step, Ending ending, const Value& now,
                           const Target& target, const Clock& clock) {
  return change_record(step.assignment.parameter, step.before, ending, now, target, clock);
}

report::Record planned_step_record(const SetStep& step, const Target& target, const Clock& clock) {
  return step_record(step, Ending::planned, step.assignment.value, target, clock);
}

void SetCounts::add(const SetCounts& other) {
  changed += other.changed;
  unchanged += other.unchanged;
  failed += other.failed;
  left += other.left;
}

SetCounts counts_of(const std::vector<SetStep>& steps) {
  SetCounts counts;
  for (const SetStep& step : steps) ++(step.changes() ? counts.changed : counts.unchanged);
  return counts;
}

Summary plan_summary(const SetCounts& counts, const std::string& target) {
  return {.counts = {{"planned", count(counts.changed)}, {"unchanged", count(counts.unchanged)}},
          .sentence = fmt::format("{} to write, {} unchanged", counts.changed, counts.unchanged),
          .target = target};
}

Summary set_summary(const SetCounts& counts, const std::string& target) {
  Summary summary{
      .counts = {{"written", count(counts.changed)},
                 {"unchanged", count(counts.unchanged)},
                 {"failed", count(counts.failed)},
                 {"not_tried", count(counts.left)}},
      .sentence = fmt::format("{} written, {} unchanged", counts.changed, counts.unchanged),
      .target = target};
  if (counts.failed > 0 || counts.left > 0) {
    summary.sentence += fmt::format(", {} failed, {} not tried", counts.failed, counts.left);
  }
  return summary;
}

Result<void> show_set_plans(const std::vector<Planned<SetPlan>>& planned, Context& context) {
  Listing listing(context, with_target_column(set_plan_columns()));
  for (const auto& [target, plan] : planned) {
    for (const SetStep& step : plan.steps) {
      listing.add(step_record(step, Ending::planned, step.assignment.value, target, context.clock));
    }
  }
  return listing.end();
}

void tell_risks(const std::vector<SetStep>& steps, const Target& target, const Context& context) {
  for (const SetStep& step : steps) {
    const Parameter& parameter = step.assignment.parameter;
    if (parameter.risk.empty() || !step.changes()) continue;
    context.renderer.note(fmt::format("{}: {}: {}", target.shown, parameter.name, parameter.risk));
  }
}

std::string guarded_in_words(const std::vector<SetStep>& steps) {
  for (const SetStep& step : steps) {
    const Parameter& parameter = step.assignment.parameter;
    if (parameter.guarding == catalogue::Guarding::none || !step.changes()) continue;
    return fmt::format("write {}, which may change what other values mean", parameter.name);
  }
  return {};
}

void tell_effects(const std::vector<SetStep>& steps, const Target& target, const Context& context) {
  for (const SetStep& step : steps) {
    const Parameter& parameter = step.assignment.parameter;
    const std::string_view words = effect_words(parameter.effect);
    if (words.empty() || !step.changes()) continue;
    context.renderer.note(fmt::format("{}: {} {}", target.shown, parameter.name, words));
  }
}

void tell_other_steps(const std::vector<SetStep>& steps, const catalogue::Profile& profile,
                      const Target& target, const Context& context) {
  for (const SetStep& step : steps) {
    const Parameter& changed = step.assignment.parameter;
    for (const Parameter& parameter : profile.parameters) {
      const bool is_meant = changed.name == parameter.scale_by.view() && step.changes() &&
                            parameter.access == catalogue::Access::read_write;
      if (!is_meant) continue;
      context.renderer.note(
          fmt::format("{}: {} will be another quantity, as {} says what its "
                      "steps are worth",
                      target.shown, parameter.name, changed.name));
    }
  }
}

void tell_roundings(const std::vector<SetStep>& steps, const Target& target,
                    const Context& context) {
  for (const SetStep& step : steps) {
    const auto& [parameter, value, text, converted, relative] = step.assignment;
    if (!converted.empty()) {
      context.renderer.note(fmt::format("{}: {}: {}", target.shown, parameter.name, converted));
    }
    if (!value.is_rounded() || parameter.secrecy == catalogue::Secrecy::secret) continue;
    context.renderer.note(fmt::format("{}: {}: {}", target.shown, parameter.name,
                                      catalogue::rounding_in_words(parameter, value)));
  }
}

}  // namespace spindle::commands
