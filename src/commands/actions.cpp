#include "actions.hpp"

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

namespace spindle::commands {
namespace {

using catalogue::Action;
using catalogue::Evidence;
using catalogue::Hazard;
using catalogue::Profile;
using report::Column;

/// What a value does to who works with the tool; empty where that is not known.
std::string effect_of(const ActionRequest& request) {
  for (const catalogue::Label& effect : request.action.effects) {
    if (effect.number == request.value) return effect.text;
  }
  switch (request.action.hazard) {
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

/// What is asked: each request once, to however many tools it is done.
class Question {
 public:
  void add(const ActionRequest& request) {
    if (request.action.hazard == Hazard::link) {
      dangerous_.emplace(request.action.name, request.action.note);
      return;
    }
    add_once(words_of(request), requests_);
    add_once(effect_of(request), effects_);
  }

  Result<void> ask(const std::string& tools, const Context& context) const {
    for (const auto& [name, note] : dangerous_) {
      const std::string what = fmt::format("{} on {}: {}", name, tools, note);
      TRY(ask_typed_consent(what, name, context));
    }
    if (requests_.empty()) return {};
    std::string what = fmt::format("{} on {}", fmt::join(requests_, ", "), tools);
    if (!effects_.empty()) what += fmt::format(": {}", fmt::join(effects_, "; "));
    return ask_consent(what, context);
  }

 private:
  std::vector<std::string> requests_ = {};
  std::vector<std::string> effects_ = {};
  std::map<std::string, std::string> dangerous_ = {};  ///< what a request may cost, by its name
};

const std::array<Column, 3> columns = {
    {{"ACTION", "action"}, {"VALUE", "value", report::Align::right}, {"RESULT", "result"}}};

}  // namespace

Result<void> ask_for_hazards(const std::vector<ActionRequest>& requests, const Target& target,
                             const Context& context) {
  Question question;
  for (const ActionRequest& request : requests) {
    const bool is_asked =
        request.action.hazard != Hazard::none || target.addressing == Addressing::broadcast;
    if (is_asked) question.add(request);
  }
  return question.ask(target.shown, context);
}

namespace {

/// Whether the question itself tells what the request may cost.
bool is_told_by_question(const ActionRequest& request, const Context& context) {
  return request.action.hazard == Hazard::link && context.user.consent != Consent::given;
}

}  // namespace

Result<void> ask_for_group(const PlannedRequests& planned, std::size_t of, const Context& context) {
  std::vector<std::string> names;
  Question question;
  for (const auto& [target, requests] : planned) {
    names.push_back(target.shown);
    for (const ActionRequest& request : requests) {
      if (!is_told_by_question(request, context)) tell_notes(request, target, context);
      question.add(request);
    }
  }
  return question.ask(tools_in_words(names, of), context);
}

void tell_notes(const ActionRequest& request, const Target& target, const Context& context) {
  const Action& action = request.action;
  if (!action.note.empty()) {
    context.renderer.note(fmt::format("{}: {}: {}", target.shown, action.name, action.note));
  }
  if (target.addressing == Addressing::broadcast && action.prepare) {
    context.renderer.note(fmt::format("{}: {}: every motor on the line is stopped for it",
                                      target.shown, action.name));
  }
}

report::Record performed_record(const ActionRequest& request, device::ActionResult result,
                                const Target& target, const Clock& clock) {
  return {.type = "action",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"action", request.action.name},
                     {"value", number(request.value)},
                     {"result", std::string(to_text(result))}}};
}

std::span<const Column> performed_columns() { return columns; }

}  // namespace spindle::commands
