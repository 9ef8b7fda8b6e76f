#include "spindle/work/start_action_setup.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "spindle/work/snapshot.hpp"

namespace spindle::work {
namespace {

using catalogue::Action;

/// Whether the action can be sent with this value.
bool takes(const Action& action, std::int64_t value) {
  const bool ranged = action.labels.empty() || action.has_range;
  if (ranged && value >= action.minimum && value <= action.maximum) return true;
  return std::any_of(action.labels.begin(), action.labels.end(),
                     [&](const catalogue::Label& label) { return label.number == value; });
}

/// "3", "loosening".
std::string value_words(const Action& action, std::int64_t value) {
  const std::string words = words_of({.action = action, .value = value});
  return words.substr(words.find('=') + 1);
}

/// "preset.2.target-torque" is "target torque" where the preset was named already.
std::string last_words(const std::string& name) {
  std::string words = name.substr(name.rfind('.') + 1);
  std::replace(words.begin(), words.end(), '-', ' ');
  return words;
}

}  // namespace

Result<void> StartActionSetup::look() {
  device::Device& device = tool_->device;
  const std::string& alarm = plan_->facts.alarm;
  const Result<device::Shown> alarm_free =
      alarm.empty() ? device::Shown::yes : device.shows(alarm, 0);
  if (!alarm_free) return tl::unexpected(alarm_free.error());
  if (*alarm_free == device::Shown::no) {
    return tl::unexpected(not_ready(tool_->target, "the tool has an alarm, so it was not started",
                                    "'spindle alarms' shows it"));
  }
  const auto still = device.shows(plan_->start.confirm, *plan_->start.stop_value);
  if (!still) return tl::unexpected(still.error());
  if (*still == device::Shown::no) {
    return tl::unexpected(
        not_ready(tool_->target, "the tool runs already, so it was not started",
                  "wait until it stands still, or stop it with 'spindle remote-stop'"));
  }
  selected_.clear();
  for (const ActionRequest& request : plan_->selections) {
    TRY_LET(const auto before, shown_by(request.action));
    selected_.push_back({request, std::nullopt});
    if (before) selected_.back().before = before->number.mantissa();
  }
  return {};
}

/// Empty where the tool does not say.
Result<std::optional<catalogue::Value>> StartActionSetup::shown_by(const Action& action) {
  if (action.confirm.empty()) return std::nullopt;
  TRY_LET(const auto parameter, tool_->profile->find(action.confirm));
  TRY_LET(const auto readings, tool_->device.read_each({parameter}, device::Limits::skip));
  if (!readings.front().value) return std::nullopt;
  return *readings.front().value;
}

Result<std::string> StartActionSetup::describe() {
  std::vector<std::string> words;
  for (const catalogue::StartOption& option : plan_->facts.selections) {
    TRY_LET(auto described, describe(option.action));
    if (described) words.push_back(std::move(*described));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

/// What was asked for of it, else what the tool shows; empty where it has no such action.
Result<std::optional<std::string>> StartActionSetup::describe(std::string_view name) {
  const auto known = tool_->profile->find_action(name);
  if (!known) return std::nullopt;
  const auto selected =
      std::find_if(plan_->selections.begin(), plan_->selections.end(),
                   [&](const ActionRequest& request) { return request.action.name == name; });
  if (selected != plan_->selections.end()) return describe_value(*selected);
  TRY_LET(const auto shown, shown_by(*known));
  if (!shown) return fmt::format("{} not known", last_words(known->confirm));
  return describe_value({.action = *known, .value = shown->number.mantissa()});
}

Result<std::string> StartActionSetup::describe_value(const ActionRequest& request) {
  const std::string value = value_words(request.action, request.value);
  std::string words = request.action.labels.empty()
                          ? fmt::format("{} {}", last_words(request.action.confirm), value)
                          : value;
  if (request.action.tells.empty() || request.value < 0) return words;
  const auto parameter = tool_->profile->find(
      catalogue::numbered_name(request.action.tells, static_cast<std::uint16_t>(request.value)));
  if (!parameter) return words;
  TRY_LET(const auto readings, tool_->device.read_each({*parameter}, device::Limits::skip));
  const auto& told = readings.front().value;
  const std::string unit = unit_of(*parameter, tool_->target);
  const bool unit_lacks = unit.empty() && !parameter->unit.empty();
  return fmt::format("{} ({} {}{}{})", words, last_words(parameter->name),
                     told ? told->to_string() : "not readable", unit.empty() ? "" : " ",
                     unit_lacks ? ", unit not known" : unit);
}

Result<void> StartActionSetup::select() {
  for (Selected& selected : selected_) {
    const ActionRequest& request = selected.request;
    selected.tried = true;
    const auto result = perform_recorded(request, *tool_, *log_, *environment_);
    if (!result) return tl::unexpected(result.error());
    if (result == device::ActionResult::not_confirmed) {
      return tl::unexpected(with_target(not_confirmed(request), tool_->target));
    }
  }
  return {};
}

std::vector<Left> StartActionSetup::put_back() {
  std::vector<Left> left;
  for (auto selected = selected_.rbegin(); selected != selected_.rend(); ++selected) {
    const auto& [request, before, tried] = *selected;
    if (!tried || before == request.value) continue;
    if (!before || !takes(request.action, *before)) {
      left.push_back(left_of(*selected, before ? "no command selects that" : ""));
      continue;
    }
    if (environment_->uninterruptible.refuse_suspend)
      environment_->uninterruptible.refuse_suspend();
    LoggedChange change{.name = request.action.name,
                        .register_address = request.action.address.value,
                        .old_value = Decimal(request.value),
                        .new_value = Decimal(*before)};
    const std::string id = log_->begin(change);
    const auto report = device::undo(
        {request.action, request.value, *before}, tool_->device,
        [this](Duration patience) { return uninterruptible_line_.connect(patience); },
        environment_->uninterruptible.clock);
    if (report.found) change.old_value = Decimal(*report.found);
    const bool done = report.result == device::RollbackResult::done ||
                      report.result == device::RollbackResult::kept;
    change.result = done ? "rolled-back" : "not-rolled-back";
    log_->end(id, change);
    if (!done) left.push_back(left_of(*selected, report.trouble));
  }
  selected_.clear();
  return left;
}

std::vector<Left> StartActionSetup::left() const {
  std::vector<Left> left;
  for (const Selected& selected : selected_) {
    if (!selected.tried || selected.before == selected.request.value) continue;
    left.push_back(left_of(selected, "the tool may still run"));
  }
  return left;
}

Left StartActionSetup::left_of(const Selected& selected, std::string trouble) {
  const Action& action = selected.request.action;
  return {.name = action.name,
          .set = value_words(action, selected.request.value),
          .before = selected.before ? value_words(action, *selected.before) : std::string(),
          .trouble = std::move(trouble)};
}

}  // namespace spindle::work
