#include "undo_plan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "spindle/base/text.hpp"
#include "spindle/work/snapshot.hpp"

namespace spindle::commands {
namespace {

const UndoneTool& tool_of(const Undoing& undoing, const Target& target) {
  static const UndoneTool nothing;
  const auto found = undoing.find(target.shown);
  return found == undoing.end() ? nothing : found->second;
}

const UndoneValue* find_value(const UndoneTool& tool, const std::string& name) {
  const auto found = std::find_if(tool.values.begin(), tool.values.end(),
                                  [&](const UndoneValue& value) { return value.name == name; });
  return found == tool.values.end() ? nullptr : &*found;
}

std::string recorded_form(const catalogue::Value& value) {
  return value.is_number() ? value.number.to_string() : value.exact();
}

Result<void> check_serial(const SetPlan& plan, const UndoneTool& tool) {
  if (tool.serial.empty() || plan.serial == tool.serial) return {};
  const std::string now =
      plan.serial.empty() ? "says no serial" : fmt::format("is serial {}", plan.serial);
  return tl::unexpected(Error{
      .code = Errc::mismatch,
      .message =
          fmt::format("the change was made on serial {}, and this tool {}", tool.serial, now)});
}

/// The number before is written only where it means what it meant. A tool that does not say the
/// unit of its torques does not change it either; what the user says of it may come and go.
Result<void> check_unit(const catalogue::Parameter& parameter, const UndoneValue& value,
                        const OpenTool& tool) {
  const std::string today = unit_of(parameter, tool.target);
  const bool tells_unit = !tool.profile->torque_unit_from.empty();
  const bool may_have_changed = parameter.unit == catalogue::torque_unit && tells_unit;
  if (value.unit.empty() ? !may_have_changed : value.unit == today) return {};
  const auto named = [](const std::string& unit) {
    return unit.empty() ? std::string("a unit that is not known") : unit;
  };
  return tl::unexpected(
      Error{.code = Errc::mismatch,
            .message = fmt::format("the change was recorded in {}, and this tool has it in {} now",
                                   named(value.unit), named(today)),
            .hint = fmt::format(
                "it was {} before: set it by hand, in the unit that is meant",
                value.unit.empty() ? value.before : fmt::format("{} {}", value.before, value.unit)),
            .name = parameter.name,
            .register_address = parameter.address.value});
}

Result<void> check_left(const SetStep& step, const UndoneValue& value) {
  if (!step.changes() || !step.before) return {};
  const std::string present = recorded_form(*step.before);
  const auto& left = value.left;
  if (std::find(left.begin(), left.end(), present) != left.end()) return {};
  return tl::unexpected(
      Error{.code = Errc::mismatch,
            .message = fmt::format("it was changed again: the tool holds {}, the change left {}",
                                   present, fmt::join(left, " or ")),
            .hint = fmt::format("'spindle log {}' shows the changes of this value", value.name),
            .name = value.name});
}

}  // namespace

std::vector<PlacedText> texts_to_undo(const Undoing& undoing, const Target& target) {
  std::vector<PlacedText> texts;
  for (const UndoneValue& value : tool_of(undoing, target).values) {
    texts.push_back({fmt::format("{}={}", value.name, value.before)});
  }
  return texts;
}

std::map<std::string, std::string> undone_ids(const Undoing& undoing, const Target& target) {
  std::map<std::string, std::string> ids;
  for (const UndoneValue& value : tool_of(undoing, target).values)
    ids.emplace(value.name, value.id);
  return ids;
}

Result<void> check_undo(const SetPlan& plan, const Undoing& undoing, const OpenTool& tool) {
  const UndoneTool& undone = tool_of(undoing, tool.target);
  TRY(check_serial(plan, undone));
  for (const SetStep& step : plan.steps) {
    const UndoneValue* value = find_value(undone, step.assignment.parameter.name);
    if (value == nullptr) continue;
    TRY(check_unit(step.assignment.parameter, *value, tool));
    TRY(check_left(step, *value));
  }
  return {};
}

void tell_doubts(const SetPlan& plan, const Undoing& undoing, const Target& target,
                 const Context& context) {
  const UndoneTool& tool = tool_of(undoing, target);
  for (const SetStep& step : plan.steps) {
    const UndoneValue* value = find_value(tool, step.assignment.parameter.name);
    if (value == nullptr || value->doubt.empty() || !step.before) continue;
    context.renderer.note(fmt::format(
        "{}: {}: what change {} left was not known ({}); the tool holds {}", target.shown,
        value->name, value->id, value->doubt, shown_of(step.assignment.parameter, *step.before)));
  }
}

}  // namespace spindle::commands
