#include "set_plan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "spindle/base/text.hpp"
#include "spindle/catalogue/danger.hpp"
#include "spindle/catalogue/snapshot.hpp"
#include "spindle/catalogue/unit.hpp"
#include "spindle/catalogue/write_order.hpp"
#include "spindle/work/change.hpp"
#include "spindle/work/snapshot.hpp"

namespace spindle::commands {
namespace {

using catalogue::Parameter;
using catalogue::Profile;
using catalogue::Value;

/// Why a parameter cannot be written. A raw register says what it belongs to instead.
Error not_writable(const Parameter& parameter, const Profile& profile) {
  Error error{
      .code = Errc::read_only, .name = parameter.name, .register_address = parameter.address.value};
  if (!is_raw(parameter.name) || !modbus::is_writable(parameter.table)) {
    return error;
  }
  error.message = "this register is no parameter that can be written";
  for (const catalogue::Action& action : profile.actions) {
    if (action.address != parameter.address) continue;
    error.message =
        fmt::format("this is the register of action '{}', not of a parameter", action.name);
    error.hint = "'spindle do' runs actions";
  }
  return error;
}

/// What may move or lock a tool is no setting, whatever the value and by whatever name.
Result<void> check_danger(const Parameter& parameter, const Profile& profile) {
  const auto danger = catalogue::danger_of(parameter, profile);
  if (!danger) return {};
  return tl::unexpected(
      Error{.code = Errc::usage,
            .message = fmt::format(
                "{}, and 'set' does not stay to {}", danger->effect(),
                danger->hazard == catalogue::Hazard::moves ? "stop it" : "look after the tool"),
            .hint = danger->remedy(),
            .name = parameter.name,
            .register_address = parameter.address.value});
}

/// Whether the profile lets it be written at all, whatever the user says.
Result<void> check_listed(const Parameter& parameter, const Profile& profile) {
  const bool is_raw_register = is_raw(parameter.name) && modbus::is_writable(parameter.table);
  if (!is_raw_register) return {};
  return profile
      .may_write(parameter.table, parameter.written_at(),
                 catalogue::register_count(parameter.encoding))
      .map_error([&](Error error) {
        error.name = parameter.name;
        return error;
      });
}

/// Whether the user may write it. What may move or lock a tool is no setting in any case.
Result<void> check_access(const Parameter& parameter, const Profile& profile, RawWrites raw) {
  if (auto allowed = check_listed(parameter, profile); !allowed) return allowed;
  const bool is_asked =
      raw == RawWrites::ask && is_raw(parameter.name) && modbus::is_writable(parameter.table);
  if (parameter.access == catalogue::Access::read_only && !is_asked) {
    Error error = not_writable(parameter, profile);
    const bool may_be_raw = is_raw(parameter.name) && modbus::is_writable(parameter.table);
    if (may_be_raw && error.hint.empty()) error.hint = "--raw writes it all the same, and asks";
    return tl::unexpected(std::move(error));
  }
  return check_danger(parameter, profile);
}

/// Whether a unit may stand behind what is typed: a label, and a name of bits, are what they are.
bool takes_unit(const Parameter& parameter, std::string_view text) {
  const bool is_number = parameter.encoding.is_integer() || parameter.encoding.is_float();
  const bool is_label = std::any_of(
      parameter.labels.begin(), parameter.labels.end(),
      [&](const catalogue::Label& label) { return same_ignoring_case(label.text, text); });
  return is_number && !is_label && parameter.bits.empty();
}

/// Whether the unit of what was typed is known once the tool was read.
bool waits_for_unit(const Assignment& assignment, const Target& target, TorqueUnit torque) {
  const Parameter& parameter = assignment.parameter;
  return torque == TorqueUnit::told_by_tool && parameter.unit == catalogue::torque_unit &&
         target.torque_unit.empty() && !Decimal::parse(assignment.text);
}

/// The numbers in the unit of the parameter, and what was converted.
Result<Assignment> with_numbers(Assignment assignment, const Target& target) {
  const Parameter& parameter = assignment.parameter;
  if (!takes_unit(parameter, assignment.text)) return assignment;
  const std::string unit = unit_of(parameter, target);
  const bool is_list = parameter.encoding.count > 1;
  std::vector<std::string> numbers;
  std::vector<std::string> notes;
  for (const std::string_view text :
       is_list ? split(assignment.text, ',') : std::vector<std::string_view>{assignment.text}) {
    auto converted = catalogue::convert_typed(text, unit);
    if (!converted) {
      if (unit.empty() && parameter.unit == catalogue::torque_unit) {
        converted.error().hint = "'torque-unit' in the tools file says the unit of a tool";
      }
      return tl::unexpected(std::move(converted.error()));
    }
    numbers.push_back(std::move(converted->text));
    if (!converted->note.empty()) notes.push_back(std::move(converted->note));
  }
  assignment.text = fmt::format("{}", fmt::join(numbers, ","));
  assignment.converted = fmt::format("{}", fmt::join(notes, ", "));
  return assignment;
}

/// What stands behind NAME=; what is meant by some of it is known once the tool was read.
Result<Assignment> with_value(Assignment assignment, const Target& target, TorqueUnit torque) {
  if (waits_for_unit(assignment, target, torque)) return assignment;
  return with_numbers(std::move(assignment), target).and_then([](Assignment made) {
    const Parameter& parameter = made.parameter;
    const bool waits = !parameter.scale_by.empty() || !parameter.part.empty();
    if (waits) return Result<Assignment>(std::move(made));
    return catalogue::parse_value(parameter, made.text).map([&](Value value) {
      made.value = std::move(value);
      return std::move(made);
    });
  });
}

/// What a tool holds is changed by a step once it was read.
Result<Assignment> with_step(Assignment assignment, const TypedAssignment& typed,
                             const Target& target, TorqueUnit torque) {
  const std::string unit = unit_of(assignment.parameter, target);
  TRY_LET(assignment.step, step_of(typed, assignment.parameter, unit));
  if (assignment.step) return assignment;
  return with_value(std::move(assignment), target, torque);
}

/// What shows the limits that a value has to keep.
Remedy limits_of(const Parameter& parameter) {
  return {.right = fmt::format("spindle get TARGET {} --limits", shell_word(parameter.name))};
}

Result<Assignment> parse_one(const TypedAssignment& typed, Parameter parameter,
                             const Profile& profile, const Target& target, RawWrites raw,
                             TorqueUnit torque) {
  TRY(check_access(parameter, profile, raw));
  if (auto fits = catalogue::check_pair(parameter.encoding, profile.link); !fits) {
    fits.error().name = parameter.name;
    fits.error().register_address = parameter.address.value;
    return tl::unexpected(std::move(fits.error()));
  }
  return with_step({parameter, {}, typed.value}, typed, target, torque).map_error([&](Error error) {
    error.name = parameter.name;
    error.register_address = parameter.address.value;
    if (error.code == Errc::out_of_range) error.remedy = limits_of(parameter);
    return error;
  });
}

/// A pattern is as many assignments as it has names.
Result<std::vector<Assignment>> parse_assignment(const std::string& text, const Profile& profile,
                                                 const Target& target, RawWrites raw,
                                                 TorqueUnit torque) {
  TRY_LET(const auto typed, take_apart(text, profile));
  TRY_LET(auto parameters, parameters_to_set(typed.name, profile));
  std::vector<Assignment> assignments;
  for (Parameter& parameter : parameters) {
    TRY_LET(auto assignment, parse_one(typed, std::move(parameter), profile, target, raw, torque));
    assignments.push_back(std::move(assignment));
  }
  return assignments;
}

/// The error of a line of a file.
Error at_place(Error error, const std::string& place) {
  if (place.empty()) return error;
  error.message =
      error.name.empty() ? message_of(error) : fmt::format("{}: {}", error.name, message_of(error));
  error.name = place;
  return error;
}

std::optional<Decimal> number_of(const std::optional<Value>& value) {
  return value ? std::optional(value->number) : std::nullopt;
}

Error assigned_twice(const Parameter& parameter) {
  return {.code = Errc::usage,
          .message = "its register is assigned twice",
          .hint = "give it one value",
          .name = parameter.name,
          .register_address = parameter.address.value};
}

/// Adds what has no register in common with what is there.
Result<void> add_once(std::vector<Assignment> some, std::vector<Assignment>& to) {
  for (Assignment& assignment : some) {
    for (const Assignment& earlier : to) {
      // Which bits these are is known once the tool was read.
      if (!earlier.parameter.part.empty() || !assignment.parameter.part.empty()) continue;
      if (!catalogue::share_bits(earlier.parameter, assignment.parameter)) continue;
      return tl::unexpected(assigned_twice(assignment.parameter));
    }
    to.push_back(std::move(assignment));
  }
  return {};
}

/// The tool's own limits; a parameter whose limits should exist but cannot be read is not written.
Result<void> check_own_limits(const Assignment& assignment, const device::Reading& reading,
                              const Profile& profile) {
  if (reading.limits_error) return tl::unexpected(*reading.limits_error);
  return catalogue::check_own_limits(assignment.parameter, assignment.value.number,
                                     number_of(reading.minimum), number_of(reading.maximum),
                                     profile);
}

/// What a step leads to from what the tool holds.
Result<void> resolve_step(Assignment& assignment, const Value& before) {
  if (!assignment.step) return {};
  const auto result = stepped(before, *assignment.step);
  auto value = result.and_then([&](const Decimal& number) {
    assignment.text = number.to_string();
    assignment.converted = step_in_words(before, *assignment.step, number);
    return catalogue::parse_value(assignment.parameter, assignment.text);
  });
  if (!value) {
    value.error().name = assignment.parameter.name;
    value.error().register_address = assignment.parameter.address.value;
    return tl::unexpected(std::move(value.error()));
  }
  assignment.value = std::move(*value);
  return {};
}

/// Names of bits and steps of a scale as they count on this tool.
Result<void> resolve_by_tool(Assignment& assignment, const device::Reading& reading) {
  if (assignment.step) assignment.parameter = reading.parameter;
  if (assignment.step ||
      (assignment.parameter.bits_by.empty() && assignment.parameter.scale_by.empty()))
    return {};
  assignment.parameter = reading.parameter;
  TRY_LET(auto value, catalogue::parse_value(assignment.parameter, assignment.text));
  assignment.value = std::move(value);
  return {};
}

/// Whether a parameter of this name is about to be changed.
bool is_changed(const catalogue::Text& name, const std::vector<SetStep>& steps) {
  return !name.empty() && std::any_of(steps.begin(), steps.end(), [&](const SetStep& step) {
    return step.assignment.parameter.name == name.view() && step.changes();
  });
}

/// What a value means is not changed by the same command: between the two writes the tool would
/// hold, and act on, a quantity that is neither the old one nor the new one.
Result<void> check_meanings_stay(const std::vector<Parameter>& parameters,
                                 const std::vector<SetStep>& steps) {
  for (std::size_t index = 0; index < parameters.size(); ++index) {
    const Parameter& parameter = parameters[index];
    const bool scales = is_changed(parameter.scale_by, steps);
    const bool has_names = !parameter.part.empty() || !Decimal::parse(steps[index].assignment.text);
    if (!scales && !(has_names && is_changed(parameter.bits_by, steps))) continue;
    const catalogue::Text& decider = scales ? parameter.scale_by : parameter.bits_by;
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = scales ? fmt::format("its steps are worth what {} says, which this "
                                              "command changes, too: between the two writes it "
                                              "would be another quantity",
                                              decider)
                                : fmt::format("what its bits mean depends on {}, which this "
                                              "command changes, too",
                                              decider),
              .hint = fmt::format("set {} first, and this one in a command behind it", decider),
              .name = parameter.name});
  }
  return {};
}

Result<void> check_once(const std::vector<SetStep>& steps) {
  for (auto step = steps.begin(); step != steps.end(); ++step) {
    const bool is_twice = std::any_of(steps.begin(), step, [&](const SetStep& earlier) {
      return catalogue::share_bits(earlier.assignment.parameter, step->assignment.parameter);
    });
    if (is_twice) return tl::unexpected(assigned_twice(step->assignment.parameter));
  }
  return {};
}

/// As the profile says what has to be written before what; what is guarded behind all others, which
/// may mean something else then.
std::vector<SetStep> in_order(std::vector<SetStep> steps) {
  std::vector<Parameter> parameters;
  for (const SetStep& step : steps) parameters.push_back(step.assignment.parameter);
  std::vector<SetStep> ordered;
  for (const std::size_t index : catalogue::write_order(parameters)) {
    ordered.push_back(std::move(steps[index]));
  }
  std::stable_partition(ordered.begin(), ordered.end(), [](const SetStep& step) {
    return step.assignment.parameter.guarding == catalogue::Guarding::none;
  });
  return ordered;
}

/// Whether a tool is still the one that was planned for, and holds what it held.
Result<void> check_unchanged(const SetPlan& plan, const SetPlan& now) {
  if (now.serial != plan.serial) {
    return tl::unexpected(work::changed_meanwhile(fmt::format(
        "serial {} answers now, and it was {} that was planned for", now.serial, plan.serial)));
  }
  for (std::size_t index = 0; index < now.steps.size(); ++index) {
    const SetStep& step = now.steps[index];
    const SetStep& planned = plan.steps[index];
    const bool same =
        step.before == planned.before && step.assignment.value == planned.assignment.value &&
        step.assignment.parameter.encoding.slice == planned.assignment.parameter.encoding.slice;
    if (same) continue;
    return tl::unexpected(work::changed_meanwhile(
        fmt::format("{} changed meanwhile from {} to {}", step.assignment.parameter.name,
                    shown_of(step.assignment.parameter, *planned.before),
                    shown_of(step.assignment.parameter, *step.before))));
  }
  return {};
}

}  // namespace

bool SetPlan::changes() const {
  return std::any_of(steps.begin(), steps.end(),
                     [](const SetStep& step) { return step.changes(); });
}

std::string serial_of(const device::Device& device) {
  const auto& identity = device.identity();
  return identity ? identity->serial : std::string();
}

Result<SetPlan> confirm_plan(const SetPlan& plan, device::Device& device) {
  SetPlan now{.assignments = plan.assignments};
  TRY_LET(auto steps, check_against_tool(now.assignments, device));
  now.steps = std::move(steps);
  now.serial = serial_of(device);
  return check_unchanged(plan, now).map([&] { return std::move(now); });
}

bool is_raw(const std::string& assignment) { return assignment.starts_with('@'); }

std::string raw_in_words(const std::vector<PlacedText>& assignments) {
  std::vector<std::string> raw;
  for (const PlacedText& assignment : assignments) {
    // What is written may be a secret: which registers these are is known to the profile only.
    if (is_raw(assignment.text))
      raw.push_back(assignment.text.substr(0, assignment.text.find('=')));
  }
  if (raw.empty()) return {};
  return fmt::format("write {}, of which it may not be known what it does", fmt::join(raw, ", "));
}

Result<std::vector<Assignment>> parse_assignments(const std::vector<PlacedText>& texts,
                                                  const Profile& profile, const Target& target,
                                                  RawWrites raw, TorqueUnit torque) {
  std::vector<Assignment> assignments;
  std::vector<Error> faults;
  for (const auto& [text, place] : texts) {
    auto added = parse_assignment(text, profile, target, raw, torque)
                     .and_then([&](std::vector<Assignment> some) {
                       return add_once(std::move(some), assignments);
                     });
    if (!added && place.empty()) return tl::unexpected(std::move(added.error()));
    if (!added) faults.push_back(at_place(std::move(added.error()), place));
  }
  if (!faults.empty()) return tl::unexpected(all_of(std::move(faults)));
  return assignments;
}

Result<std::vector<SetStep>> check_against_tool(std::vector<Assignment> assignments,
                                                device::Device& device) {
  std::vector<Parameter> parameters;
  parameters.reserve(assignments.size());
  for (const Assignment& assignment : assignments) parameters.push_back(assignment.parameter);
  TRY_LET(const auto readings, device.read_each(parameters, device::Limits::read));
  std::vector<SetStep> steps;
  for (std::size_t index = 0; index < assignments.size(); ++index) {
    const device::Reading& reading = readings[index];
    TRY_LET(const auto before, reading.held());
    TRY(resolve_by_tool(assignments[index], reading));
    TRY(resolve_step(assignments[index], before));
    auto allowed = check_own_limits(assignments[index], reading, device.profile());
    if (!allowed) {
      if (allowed.error().code == Errc::out_of_range) {
        allowed.error().remedy = limits_of(assignments[index].parameter);
      }
      return tl::unexpected(std::move(allowed.error()));
    }
    steps.push_back({std::move(assignments[index]), before});
  }
  TRY(check_meanings_stay(parameters, steps));
  TRY(check_once(steps));
  return in_order(std::move(steps));
}

Result<void> check_guarded(const std::vector<Assignment>& assignments) {
  if (assignments.size() < 2) return {};
  for (const Assignment& assignment : assignments) {
    const Parameter& parameter = assignment.parameter;
    if (parameter.guarding == catalogue::Guarding::none) continue;
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "it may change what other values mean, so it is written alone",
              .hint = "give it in a command of its own, and look at the others behind it",
              .name = parameter.name,
              .register_address = parameter.address.value});
  }
  return {};
}

Result<std::vector<SetStep>> steps_for_everybody(std::vector<Assignment> assignments) {
  std::vector<SetStep> steps;
  for (Assignment& assignment : assignments) {
    if (assignment.step) {
      return tl::unexpected(
          Error{.code = Errc::usage,
                .message = "what each tool holds is not known, and none can be asked",
                .hint = "write the new value behind =",
                .name = assignment.parameter.name});
    }
    if (!assignment.parameter.scale_by.empty()) {
      return tl::unexpected(Error{.code = Errc::usage,
                                  .message =
                                      "what its steps are worth stands in a register of each "
                                      "tool, and none can be asked",
                                  .name = assignment.parameter.name});
    }
    if (assignment.parameter.encoding.is_part() || !assignment.parameter.part.empty()) {
      return tl::unexpected(Error{.code = Errc::usage,
                                  .message = "what stands beside it in its register is not known, "
                                             "and none can be asked",
                                  .hint = "set the whole register, or each tool by itself",
                                  .name = assignment.parameter.name});
    }
    if (!assignment.parameter.bits_by.empty()) {
      assignment.parameter = catalogue::with_bits_for(assignment.parameter, std::nullopt);
      TRY_LET(auto value, catalogue::parse_value(assignment.parameter, assignment.text));
      assignment.value = std::move(value);
    }
    steps.push_back({std::move(assignment), std::nullopt});
  }
  return steps;
}

}  // namespace spindle::commands
