#include "deeds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "consent.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"

namespace spindle::commands {
namespace {

using catalogue::Action;
using catalogue::Evidence;
using catalogue::Hazard;
using catalogue::Profile;
using report::Column;

Error bad_action_value(const Action& action, std::string message, std::string hint = {}) {
  return {.code = Errc::bad_value,
          .message = std::move(message),
          .hint = std::move(hint),
          .name = action.name};
}

Result<std::uint16_t> parse_label(const Action& action, std::string_view text) {
  std::vector<std::string> known;
  for (const catalogue::Label& label : action.labels) {
    const bool same = label.text == text || std::to_string(label.number) == text;
    if (same) return static_cast<std::uint16_t>(label.number);
    known.push_back(fmt::format("{} ({})", label.text, label.number));
  }
  return tl::unexpected(bad_action_value(action, fmt::format("'{}' is none of its values", text),
                                         fmt::format("it takes {}", fmt::join(known, ", "))));
}

Result<std::uint16_t> parse_action_value(const Action& action, std::string_view text) {
  if (!action.labels.empty()) return parse_label(action, text);
  const auto value = parse_unsigned(text, 0xFFFF);
  if (value && *value >= action.minimum && *value <= action.maximum) {
    return static_cast<std::uint16_t>(*value);
  }
  return tl::unexpected(bad_action_value(
      action,
      fmt::format("'{}' is not a number from {} to {}", text, action.minimum, action.maximum)));
}

bool is_weak(Evidence evidence) {
  return evidence == Evidence::sibling || evidence == Evidence::inferred;
}

const std::array<Column, 3> columns = {
    {{"ACTION", "action"}, {"VALUE", "value", report::Align::right}, {"RESULT", "result"}}};

}  // namespace

Result<Deed> parse_deed(const std::string& text, const Profile& profile) {
  const auto equals = text.find('=');
  auto action = profile.find_action(text.substr(0, equals));
  if (!action) return tl::unexpected(std::move(action.error()));
  const bool given = equals != std::string::npos;
  if (action->value) {
    if (!given) return Deed{*action, *action->value};
    return tl::unexpected(bad_action_value(*action, "it takes no value",
                                           fmt::format("write '{}' alone", action->name)));
  }
  if (!given) {
    return tl::unexpected(bad_action_value(*action, "a value is missing",
                                           fmt::format("write {}=VALUE", action->name)));
  }
  return parse_action_value(*action, std::string_view(text).substr(equals + 1))
      .map([&](std::uint16_t value) {
        return Deed{*action, value};
      });
}

Result<void> check_evidence(const Action& action, const Target& target, Acceptance acceptance) {
  const bool moves_or_locks = action.hazard == Hazard::moves || action.hazard == Hazard::locks ||
                              action.hazard == Hazard::unclear;
  const bool verified = std::find(target.verified.begin(), target.verified.end(), action.name) !=
                        target.verified.end();
  const bool accepted = verified || acceptance == Acceptance::unverified;
  if (!moves_or_locks || !is_weak(action.evidence) || accepted) return {};
  return tl::unexpected(Error{
      .code = Errc::unverified,
      .message = fmt::format(
          "it is not certain that register {} is '{}' on this tool: evidence {} ({})",
          action.address.value, action.name, catalogue::to_text(action.evidence), action.source),
      .hint = fmt::format("{}; then add --accept-unverified, or list it under 'verified' in the "
                          "tools file",
                          action.check),
      .name = action.name,
      .register_address = action.address.value});
}

Result<void> ask_for_hazards(const std::vector<Deed>& deeds, const Target& target,
                             const Context& context) {
  std::vector<std::string> hazardous;
  for (const Deed& deed : deeds) {
    if (deed.action.hazard != Hazard::none) hazardous.push_back(deed.action.name);
  }
  if (hazardous.empty()) return {};
  return ask_consent(fmt::format("{} on {}", fmt::join(hazardous, ", "), target.shown), context);
}

std::string_view to_text(device::ActionResult result) {
  switch (result) {
    case device::ActionResult::confirmed:
      return "confirmed";
    case device::ActionResult::sent:
      return "sent";
    case device::ActionResult::not_confirmed:
      return "not-confirmed";
  }
  return "";
}

report::Record deed_record(const Deed& deed, device::ActionResult result, const Target& target,
                           const Clock& clock) {
  return {.type = "action",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"action", deed.action.name},
                     {"value", number(deed.value)},
                     {"result", std::string(to_text(result))}}};
}

Error not_confirmed(const Deed& deed, const Target& target) {
  return target.blamed(
      {.code = Errc::mismatch,
       .message = fmt::format("the tool acknowledged it, but {} does not show the effect",
                              deed.action.confirm),
       .hint = "is the tool running or locked? its register may also mean something else here",
       .name = deed.action.name,
       .register_address = deed.action.address.value});
}

std::span<const Column> deed_columns() { return columns; }

}  // namespace spindle::commands
