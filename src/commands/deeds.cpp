#include "deeds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "consent.hpp"
#include "driver.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/danger.hpp"
#include "stops.hpp"

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

/// What a value does to who works with the tool; empty where that is not known.
std::string effect_of(const Deed& deed) {
  for (const catalogue::Label& effect : deed.action.effects) {
    if (effect.number == deed.value) return effect.text;
  }
  switch (deed.action.hazard) {
    case Hazard::moves:
      return "the tool may turn";
    case Hazard::locks:
      return "takes the tool from its operator, or gives it back";
    default:
      return {};
  }
}

void add_once(std::string text, std::vector<std::string>& to) {
  const bool is_new = !text.empty() && std::find(to.begin(), to.end(), text) == to.end();
  if (is_new) to.push_back(std::move(text));
}

/// What is asked: each deed once, to however many tools it is done.
class Question {
 public:
  void add(const Deed& deed) {
    if (deed.action.hazard == Hazard::link) {
      dangerous_.emplace(deed.action.name, deed.action.note);
      return;
    }
    add_once(words_of(deed), deeds_);
    add_once(effect_of(deed), effects_);
  }

  Result<void> ask(const std::string& tools, const Context& context) const {
    for (const auto& [name, note] : dangerous_) {
      const std::string what = fmt::format("{} on {}: {}", name, tools, note);
      if (auto given = ask_typed_consent(what, name, context); !given) return given;
    }
    if (deeds_.empty()) return {};
    std::string what = fmt::format("{} on {}", fmt::join(deeds_, ", "), tools);
    if (!effects_.empty()) what += fmt::format(": {}", fmt::join(effects_, "; "));
    return ask_consent(what, context);
  }

 private:
  std::vector<std::string> deeds_ = {};
  std::vector<std::string> effects_ = {};
  std::map<std::string, std::string> dangerous_ = {};  ///< what a deed may cost, by its name
};

const std::array<Column, 3> columns = {
    {{"ACTION", "action"}, {"VALUE", "value", report::Align::right}, {"RESULT", "result"}}};

catalogue::Secrecy secrecy_of(const Action& action, const Profile& profile) {
  catalogue::Parameter written;
  written.address = action.address;
  return profile.with_secrecy(std::move(written)).secrecy;
}

}  // namespace

Result<Deed> parse_deed(const std::string& text, const Profile& profile) {
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
    if (!given) return Deed{*action, action->value.value_or(0), secrecy_of(*action, profile)};
    return tl::unexpected(bad_action_value(*action, "it takes no value",
                                           fmt::format("write '{}' alone", action->name)));
  }
  if (!given) {
    return tl::unexpected(bad_action_value(*action, "a value is missing",
                                           fmt::format("write {}=VALUE", action->name)));
  }
  return parse_action_value(*action, std::string_view(text).substr(equals + 1))
      .map([&](std::int64_t value) {
        return Deed{*action, value, secrecy_of(*action, profile)};
      });
}

std::string words_of(const Deed& deed) {
  const Action& action = deed.action;
  const bool fixed = action.value || action.motion != catalogue::Motion::none;
  if (fixed || deed.secrecy == catalogue::Secrecy::secret) return action.name;
  const auto label =
      std::find_if(action.labels.begin(), action.labels.end(),
                   [&](const catalogue::Label& one) { return one.number == deed.value; });
  const bool labelled = label != action.labels.end();
  return fmt::format("{}={}", action.name, labelled ? label->text : std::to_string(deed.value));
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
  Question question;
  for (const Deed& deed : deeds) {
    const bool is_asked = deed.action.hazard != Hazard::none || target.reach == Reach::everybody;
    if (is_asked) question.add(deed);
  }
  return question.ask(target.shown, context);
}

namespace {

/// Whether the question itself tells what the deed may cost.
bool is_told_by_question(const Deed& deed, const Context& context) {
  return deed.action.hazard == Hazard::link && context.common.consent != Consent::given;
}

}  // namespace

Result<void> ask_for_group(const PlannedDeeds& planned, std::size_t of, const Context& context) {
  std::vector<std::string> names;
  Question question;
  for (const auto& [target, deeds] : planned) {
    names.push_back(target.shown);
    for (const Deed& deed : deeds) {
      if (!is_told_by_question(deed, context)) tell_notes(deed, target, context);
      question.add(deed);
    }
  }
  return question.ask(tools_in_words(names, of), context);
}

std::string_view to_text(device::ActionResult result) {
  switch (result) {
    case device::ActionResult::confirmed:
      return "confirmed";
    case device::ActionResult::sent:
      return "sent";
    case device::ActionResult::finished:
      return "finished";
    case device::ActionResult::not_confirmed:
      return "not-confirmed";
  }
  return "";
}

void tell_notes(const Deed& deed, const Target& target, const Context& context) {
  const Action& action = deed.action;
  if (!action.note.empty()) {
    context.renderer.note(fmt::format("{}: {}: {}", target.shown, action.name, action.note));
  }
  if (target.reach == Reach::everybody && action.prepare) {
    context.renderer.note(fmt::format("{}: {}: every motor on the line is stopped for it",
                                      target.shown, action.name));
  }
}

Result<device::ActionResult> perform_deed(const Deed& deed, OpenTool& tool,
                                          const Context& context) {
  const Action& action = deed.action;
  const bool everybody = tool.target.reach == Reach::everybody;
  if (action.motion == catalogue::Motion::stop) {
    return stop_motor(tool, catalogue::StopMode::decelerate, context).map(in_words_of_actions);
  }
  if (!everybody) return tool.device.perform(action, deed.value);
  return tool.device.broadcast(action, deed.value).map([] { return device::ActionResult::sent; });
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
  const bool busy = deed.action.confirm.empty();
  return target.blamed(
      {.code = Errc::mismatch,
       .message = busy ? "the tool acknowledged it, but does not show that it is done"
                       : fmt::format("the tool acknowledged it, but {} does not show the effect",
                                     deed.action.confirm),
       .hint = "is the tool running or locked? its register may also mean something else here",
       .name = deed.action.name,
       .register_address = deed.action.address.value});
}

std::span<const Column> deed_columns() { return columns; }

}  // namespace spindle::commands
