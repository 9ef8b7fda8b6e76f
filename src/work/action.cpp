#include "spindle/work/action.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "spindle/base/text.hpp"
#include "spindle/catalogue/danger.hpp"
#include "spindle/work/stop.hpp"

namespace spindle::work {
namespace {

using catalogue::Action;
using catalogue::Evidence;
using catalogue::Hazard;
using catalogue::Profile;

Error bad_action_value(const Action& action, std::string message, std::string hint = {}) {
  return {.code = Errc::bad_value,
          .message = std::move(message),
          .hint = std::move(hint),
          .name = action.name};
}

Result<std::int64_t> parse_label(const Action& action, std::string_view text) {
  std::vector<std::string> known;
  for (const catalogue::Label& label : action.labels) {
    const bool same = label.text == text || std::to_string(label.number) == text;
    if (same) return label.number;
    known.push_back(fmt::format("{} ({})", label.text, label.number));
  }
  if (action.has_range) known.push_back(fmt::format("{} to {}", action.minimum, action.maximum));
  return tl::unexpected(bad_action_value(action, fmt::format("'{}' is none of its values", text),
                                         fmt::format("it takes {}", fmt::join(known, ", "))));
}

Result<std::int64_t> parse_action_value(const Action& action, std::string_view text) {
  const auto value = parse_unsigned(text, 0xFFFF);
  const bool ranged = action.labels.empty() || action.has_range;
  if (ranged && value && *value >= action.minimum && *value <= action.maximum) {
    return static_cast<std::int64_t>(*value);
  }
  if (!action.labels.empty()) return parse_label(action, text);
  return tl::unexpected(
      bad_action_value(action, fmt::format("'{}' is none of its values", text),
                       fmt::format("it takes {} to {}", action.minimum, action.maximum)));
}

bool is_weak(Evidence evidence) {
  return evidence == Evidence::sibling || evidence == Evidence::inferred;
}

device::ActionResult in_words_of_actions(device::StopResult result) {
  switch (result) {
    case device::StopResult::confirmed:
      return device::ActionResult::confirmed;
    case device::StopResult::sent:
      return device::ActionResult::sent;
    case device::StopResult::unconfirmed:
      break;
  }
  return device::ActionResult::not_confirmed;
}

catalogue::Secrecy secrecy_of(const Action& action, const Profile& profile) {
  catalogue::Parameter written;
  written.address = action.address;
  return profile.marked(std::move(written)).secrecy;
}

Result<device::ActionResult> perform_action(const ActionRequest& request, OpenTool& tool,
                                            const Environment& environment) {
  const Action& action = request.action;
  const bool everybody = tool.target.addressing == Addressing::broadcast;
  if (action.motion == catalogue::Motion::stop) {
    return stop_motor(tool, catalogue::StopMode::decelerate, environment).map(in_words_of_actions);
  }
  if (!everybody) return tool.device.perform(action, request.value);
  return tool.device.broadcast(action, request.value).map([] {
    return device::ActionResult::sent;
  });
}

}  // namespace

Result<ActionRequest> parse_action(const std::string& text, const Profile& profile) {
  const auto equals = text.find('=');
  auto action = profile.find_action(text.substr(0, equals));
  if (!action) return tl::unexpected(std::move(action.error()));
  if (catalogue::moves_without_end(*action)) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "it starts a motion, and its profile names no 'stop' that ends it",
              .hint = "add 'stop: VALUE' to the action; then it is started under a guard",
              .name = action->name,
              .register_address = action->address.value});
  }
  const bool given = equals != std::string::npos;
  if (action->value || action->motion != catalogue::Motion::none) {
    if (!given)
      return ActionRequest{*action, action->value.value_or(0), secrecy_of(*action, profile)};
    return tl::unexpected(bad_action_value(*action, "it takes no value",
                                           fmt::format("write '{}' alone", action->name)));
  }
  if (!given) {
    return tl::unexpected(bad_action_value(*action, "a value is missing",
                                           fmt::format("write {}=VALUE", action->name)));
  }
  return parse_action_value(*action, std::string_view(text).substr(equals + 1))
      .map([&](std::int64_t value) {
        return ActionRequest{*action, value, secrecy_of(*action, profile)};
      });
}

std::string words_of(const ActionRequest& request) {
  const Action& action = request.action;
  const bool fixed = action.value || action.motion != catalogue::Motion::none;
  if (fixed || request.secrecy == catalogue::Secrecy::secret) return action.name;
  const auto label =
      std::find_if(action.labels.begin(), action.labels.end(),
                   [&](const catalogue::Label& one) { return one.number == request.value; });
  const bool labelled = label != action.labels.end();
  return fmt::format("{}={}", action.name,
                     labelled ? label->text.to_string() : std::to_string(request.value));
}

Result<void> check_evidence(const Action& action, const Target& target, Acceptance acceptance) {
  const bool moves_or_locks = action.hazard == Hazard::moves || action.hazard == Hazard::locks ||
                              action.hazard == Hazard::unclear;
  const bool verified = std::find(target.verified.begin(), target.verified.end(), action.name) !=
                        target.verified.end();
  const bool accepted = verified || acceptance == Acceptance::unverified;
  if (!moves_or_locks || !is_weak(action.evidence) || accepted) return {};
  const std::string check =
      action.check.empty() ? "try it where nothing can be hurt" : action.check.to_string();
  return tl::unexpected(Error{
      .code = Errc::unverified,
      .message = fmt::format(
          "it is not certain that register {} is '{}' on this tool: evidence {} ({})",
          action.address.value, action.name, catalogue::to_text(action.evidence), action.source),
      .hint = fmt::format("{}; then add --accept-unverified, or list it under 'verified' in the "
                          "tools file",
                          check),
      .name = action.name,
      .register_address = action.address.value});
}

Error not_confirmed(const ActionRequest& request) {
  const bool busy = request.action.confirm.empty();
  return {.code = Errc::mismatch,
          .message = busy ? "the tool acknowledged it, but does not show that it is done"
                          : fmt::format("the tool acknowledged it, but {} does not show the effect",
                                        request.action.confirm),
          .hint = "is the tool running or locked? its register may also mean something else here",
          .name = request.action.name,
          .register_address = request.action.address.value};
}

LoggedChange logged(const ActionRequest& request) {
  LoggedChange change{.name = request.action.name,
                      .register_address = request.action.address.value};
  if (request.secrecy == catalogue::Secrecy::open) change.new_value = Decimal(request.value);
  return change;
}

LoggedChange logged(const ActionRequest& request, const Result<device::ActionResult>& result) {
  LoggedChange change = logged(request);
  change.result = result ? to_text(*result) : result_of_failure(result.error());
  return change;
}

Result<device::ActionResult> perform_recorded(const ActionRequest& request, OpenTool& tool,
                                              ChangeLog& log, const Environment& environment) {
  const std::string id = log.begin(logged(request));
  auto result = perform_action(request, tool, environment);
  log.end(id, logged(request, result));
  return result;
}

}  // namespace spindle::work
