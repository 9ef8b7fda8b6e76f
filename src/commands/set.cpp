#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <optional>
#include <utility>

#include "change_log.hpp"
#include "consent.hpp"
#include "deeds.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/catalogue/snapshot.hpp"
#include "spindle/catalogue/value.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"
#include "storing.hpp"

namespace spindle::commands {
namespace {

using catalogue::Parameter;
using catalogue::Profile;
using catalogue::Value;
using report::Align;
using report::Column;

struct Assignment {
  Parameter parameter;
  Value value;
  std::string text;  ///< as typed: names of bits may mean others once the tool was read
};

/// How one assignment ended, as in the contract's record `write`.
enum class Ending : std::uint8_t { planned, written, unchanged, coerced, mismatch, refused, sent };

std::string_view to_text(Ending ending) {
  switch (ending) {
    case Ending::planned:
      return "planned";
    case Ending::written:
      return "written";
    case Ending::unchanged:
      return "unchanged";
    case Ending::coerced:
      return "coerced";
    case Ending::mismatch:
      return "mismatch";
    case Ending::refused:
      return "refused";
    case Ending::sent:
      return "sent";
  }
  return "";
}

/// Why a parameter can not be written. A raw register says what it belongs to instead.
Error not_writable(const Parameter& parameter, const Profile& profile) {
  Error error{
      .code = Errc::read_only, .name = parameter.name, .register_address = parameter.address.value};
  if (!parameter.name.starts_with('@') || parameter.table == modbus::RegisterTable::input) {
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

Result<Assignment> parse_assignment(const std::string& text, const Profile& profile) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = fmt::format("'{}' is not of the form NAME=VALUE", text),
                                .hint = "write it like preset.1.target-torque=2.71"});
  }
  auto parameter = profile.find(text.substr(0, equals));
  if (!parameter) return tl::unexpected(std::move(parameter.error()));
  if (parameter->access == catalogue::Access::read_only) {
    return tl::unexpected(not_writable(*parameter, profile));
  }
  auto value = catalogue::parse_value(*parameter, std::string_view(text).substr(equals + 1));
  if (!value) {
    value.error().name = parameter->name;
    value.error().register_address = parameter->address.value;
    return tl::unexpected(std::move(value.error()));
  }
  return Assignment{std::move(*parameter), std::move(*value), text.substr(equals + 1)};
}

bool overlap(const Parameter& a, const Parameter& b) {
  const auto end = [](const Parameter& p) {
    return p.address.value + catalogue::register_count(p.encoding.kind);
  };
  return a.table == b.table && a.address.value < end(b) && b.address.value < end(a);
}

/// A motor that this would start needs somebody who stays to stop it.
Result<void> check_motion(const Assignment& assignment, const Profile& profile) {
  if (!profile.run) return {};
  const auto command = profile.find(profile.run->command);
  if (!command || !overlap(*command, assignment.parameter)) return {};
  const auto registers = catalogue::encode(assignment.parameter, assignment.value.number);
  if (!registers) return tl::unexpected(registers.error());
  const unsigned end = assignment.parameter.address.value + unsigned(registers->size());
  const unsigned low_word =
      command->address.value + catalogue::register_count(command->encoding.kind) - 1U;
  const bool starts = end > low_word && (registers->back() & profile.run->starting) != 0;
  if (!starts) return {};
  return tl::unexpected(
      Error{.code = Errc::usage,
            .message = "it may start the motor, and 'set' does not stay to stop it",
            .hint = "'spindle remote-start' starts it under a guard that always ends in a stop",
            .name = assignment.parameter.name,
            .register_address = assignment.parameter.address.value});
}

Result<std::vector<Assignment>> parse_assignments(const std::vector<std::string>& texts,
                                                  const Profile& profile) {
  std::vector<Assignment> assignments;
  for (const std::string& text : texts) {
    auto assignment = parse_assignment(text, profile);
    if (!assignment) return tl::unexpected(std::move(assignment.error()));
    if (auto calm = check_motion(*assignment, profile); !calm) {
      return tl::unexpected(std::move(calm.error()));
    }
    for (const Assignment& earlier : assignments) {
      if (!overlap(earlier.parameter, assignment->parameter)) continue;
      return tl::unexpected(Error{.code = Errc::usage,
                                  .message = "its register is assigned twice",
                                  .hint = "give it one value",
                                  .name = assignment->parameter.name,
                                  .register_address = assignment->parameter.address.value});
    }
    assignments.push_back(std::move(*assignment));
  }
  return assignments;
}

std::optional<Decimal> number_of(const std::optional<Value>& value) {
  return value ? std::optional(value->number) : std::nullopt;
}

/// The tool's own limits; a parameter whose limits should exist but can not be read is not written.
Result<void> check_own_limits(const Assignment& assignment, const device::Reading& reading,
                              const Profile& profile) {
  if (reading.limits_error) return tl::unexpected(*reading.limits_error);
  return catalogue::check_own_limits(assignment.parameter, assignment.value.number,
                                     number_of(reading.minimum), number_of(reading.maximum),
                                     profile);
}

/// One assignment with what the tool holds now.
struct Step {
  const Assignment* assignment;
  std::optional<Value> before;  ///< empty: it can not be asked

  [[nodiscard]] bool changes() const { return before != assignment->value; }
};

/// Names of bits as they count on this tool.
Result<void> resolve_bits(Assignment& assignment, const device::Reading& reading,
                          const Profile& profile) {
  if (assignment.parameter.bits_by.empty()) return {};
  assignment.parameter = reading.parameter;
  auto value = catalogue::parse_value(assignment.parameter, assignment.text);
  if (!value) return tl::unexpected(std::move(value.error()));
  assignment.value = std::move(*value);
  return check_motion(assignment, profile);
}

Result<std::vector<Step>> check_against_tool(std::vector<Assignment>& assignments,
                                             device::Device& device) {
  std::vector<Parameter> parameters;
  parameters.reserve(assignments.size());
  for (const Assignment& assignment : assignments) parameters.push_back(assignment.parameter);
  const auto readings = device.read_each(parameters, device::Limits::read);
  if (!readings) return tl::unexpected(readings.error());
  std::vector<Step> steps;
  for (std::size_t index = 0; index < assignments.size(); ++index) {
    const device::Reading& reading = (*readings)[index];
    if (!reading.value) return tl::unexpected(reading.value.error());
    if (auto known = resolve_bits(assignments[index], reading, device.profile()); !known) {
      return tl::unexpected(std::move(known.error()));
    }
    auto allowed = check_own_limits(assignments[index], reading, device.profile());
    if (!allowed) return tl::unexpected(std::move(allowed.error()));
    steps.push_back({&assignments[index], *reading.value});
  }
  return steps;
}

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

report::Record step_record(const Step& step, Ending ending, const Value& now, const Target& target,
                           const Clock& clock) {
  const Parameter& parameter = step.assignment->parameter;
  report::Record record{.type = ending == Ending::planned ? "plan" : "write",
                        .target = target.shown,
                        .time = clock.wall(),
                        .fields = {}};
  record.fields = {{"name", parameter.name},
                   {"register", number(parameter.address.value)},
                   {"old", step.before ? report::Cell(step.before->number) : report::Cell(),
                    step.before ? step.before->to_string() : std::string()},
                   {"new", now.number, now.to_string()},
                   {"unit", text_or_null(unit_of(parameter, target))}};
  if (ending == Ending::planned) {
    record.fields.push_back({"changes", step.changes(), step.changes() ? "yes" : "no"});
  } else {
    record.fields.push_back({"result", std::string(to_text(ending))});
  }
  return record;
}

Error not_stored(const Step& step, const device::Written& written, const Target& target) {
  const std::string asked = step.assignment->value.to_string();
  const std::string holds = written.now.to_string();
  const std::string_view how = written.result == device::WriteResult::mismatch ? "still" : "now";
  return target.blamed(
      {.code = Errc::mismatch,
       .message = fmt::format("the tool acknowledged {} but {} holds {}", asked, how, holds),
       .hint = "is the tool running, locked, or set to refuse changes?",
       .name = step.assignment->parameter.name,
       .register_address = step.assignment->parameter.address.value});
}

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

/// What has to be asked before anything is written.
Result<void> ask_first(const SetOptions& options, const Profile& profile, const Target& target,
                       const Context& context) {
  std::vector<std::string> what;
  if (options.reach == Reach::everybody) what.emplace_back("set");
  if (auto storing = check_storing(options.storing, profile); !storing) return storing;
  if (options.storing == Storing::yes) what.emplace_back(store_action);
  if (what.empty() || options.execution == Execution::dry_run) return {};
  return ask_consent(fmt::format("{} on {}", fmt::join(what, ", "), target.shown), context);
}

/// Carries out one plan, and stops at the first write that fails.
class Writer {
 public:
  Writer(OpenTool& tool, const SetOptions& options, Context& context)
      : tool_(&tool),
        options_(&options),
        context_(&context),
        listing_(context, options.execution == Execution::dry_run ? plan_columns : write_columns),
        log_("set", tool, context) {}

  Result<Outcome> plan(const std::vector<Step>& steps) {
    for (const Step& step : steps) {
      note(step, Ending::planned, step.assignment->value);
      step.changes() ? ++changed_ : ++unchanged_;
      outcome_.succeed();
    }
    return end({{"planned", count(changed_)}, {"unchanged", count(unchanged_)}},
               fmt::format("{} to write, {} unchanged; nothing was written (dry run)", changed_,
                           unchanged_));
  }

  /// Nobody says what they hold now.
  Result<Outcome> send(const std::vector<Step>& steps) {
    tell_risks(steps);
    for (const Step& step : steps) {
      const Assignment& assignment = *step.assignment;
      const auto sent = tool_->device.broadcast(assignment.parameter, assignment.value);
      if (!sent) {
        fail(sent.error());
        break;
      }
      note(step, Ending::sent, assignment.value);
      log(step, to_text(Ending::sent), assignment.value);
      ++changed_;
      outcome_.succeed();
    }
    tell_effects(steps);
    return end({{"sent", count(changed_)}, {"failed", count(outcome_.failed())}},
               fmt::format("{} sent, not acknowledged", changed_));
  }

  Result<Outcome> write(const std::vector<Step>& steps) {
    tell_risks(steps);
    for (const Step& step : steps) {
      if (outcome_.failed() > 0) break;
      step.changes() ? write_one(step) : keep(step);
    }
    const std::size_t left = steps.size() - outcome_.succeeded() - outcome_.failed();
    tell_effects(steps);
    std::string sentence = fmt::format("{} written, {} unchanged", changed_, unchanged_);
    if (outcome_.failed() > 0) {
      sentence += fmt::format(", {} failed, {} not tried", outcome_.failed(), left);
    }
    return end({{"written", count(changed_)},
                {"unchanged", count(unchanged_)},
                {"failed", count(outcome_.failed())},
                {"not_tried", count(left)}},
               sentence);
  }

 private:
  static report::Cell count(std::size_t things) {
    return number(static_cast<std::int64_t>(things));
  }

  void note(const Step& step, Ending ending, const Value& now) {
    listing_.add(step_record(step, ending, now, tool_->target, context_->clock));
  }

  void keep(const Step& step) {
    note(step, Ending::unchanged, *step.before);
    ++unchanged_;
    outcome_.succeed();
  }

  void fail(const Error& error) {
    outcome_.fail(error);
    listing_.add(error);
  }

  void log(const Step& step, std::string_view result, const Value& now) {
    LoggedChange change =
        logged(step.assignment->parameter, step.before.value_or(now), now, result);
    if (!step.before) change.old_value.reset();
    log_.add(change);
  }

  void write_one(const Step& step) {
    const Value& wanted = step.assignment->value;
    const auto written = tool_->device.write(step.assignment->parameter, *step.before, wanted);
    if (!written) {
      const bool refused = written.error().code == Errc::exception_response;
      if (refused) note(step, Ending::refused, *step.before);
      log(step, refused ? to_text(Ending::refused) : "unknown", refused ? *step.before : wanted);
      fail(written.error());
      return;
    }
    if (written->result == device::WriteResult::written) {
      note(step, Ending::written, written->now);
      log(step, to_text(Ending::written), written->now);
      ++changed_;
      outcome_.succeed();
      return;
    }
    const bool same = written->result == device::WriteResult::mismatch;
    const Ending ending = same ? Ending::mismatch : Ending::coerced;
    note(step, ending, written->now);
    log(step, to_text(ending), written->now);
    fail(not_stored(step, *written, tool_->target));
  }

  /// What a change may cost, before it is made.
  void tell_risks(const std::vector<Step>& steps) {
    for (const Step& step : steps) {
      const Parameter& parameter = step.assignment->parameter;
      if (parameter.risk.empty() || !step.changes()) continue;
      context_->renderer.note(
          fmt::format("{}: {}: {}", tool_->target.shown, parameter.name, parameter.risk));
    }
  }

  /// When what was written acts, where that is not at once.
  void tell_effects(const std::vector<Step>& steps) {
    for (const Step& step : steps) {
      const Parameter& parameter = step.assignment->parameter;
      const std::string_view words = effect_words(parameter.effect);
      if (words.empty() || !step.changes()) continue;
      context_->renderer.note(fmt::format("{}: {} {}", tool_->target.shown, parameter.name, words));
    }
  }

  Result<Outcome> end(std::vector<report::Field> counts, const std::string& sentence) {
    auto drawn = listing_.end();
    const bool stores = options_->storing == Storing::yes && outcome_.failed() == 0;
    if (drawn && stores && options_->execution == Execution::real) {
      drawn = store(*tool_, log_, outcome_, *context_);
    }
    if (drawn) {
      drawn = context_->renderer.summary(summary_record(std::move(counts), outcome_.status(),
                                                        tool_->target.shown, context_->clock),
                                         sentence);
    }
    return drawn.map([&] { return outcome_; });
  }

  OpenTool* tool_;
  const SetOptions* options_;
  Context* context_;
  Listing listing_;
  ChangeLog log_;
  Outcome outcome_ = {};
  std::size_t changed_ = 0;
  std::size_t unchanged_ = 0;
};

/// Everybody may have another setting, so only names that always count can be sent.
Result<Outcome> send_to_all(std::vector<Assignment>& assignments, Writer& writer,
                            const SetOptions& options) {
  std::vector<Step> steps;
  for (Assignment& assignment : assignments) {
    if (!assignment.parameter.bits_by.empty()) {
      assignment.parameter = catalogue::with_bits_for(assignment.parameter, std::nullopt);
      auto value = catalogue::parse_value(assignment.parameter, assignment.text);
      if (!value) return tl::unexpected(std::move(value.error()));
      assignment.value = std::move(*value);
    }
    steps.push_back({&assignment, std::nullopt});
  }
  return options.execution == Execution::dry_run ? writer.plan(steps) : writer.send(steps);
}

}  // namespace

Result<Outcome> set(const SetOptions& options, Context& context) {
  auto target = resolve_target(options.target, context);
  if (!target) return tl::unexpected(target.error());
  target->reach = options.reach;
  auto opened = open_prepared(*target, Need::named_registers, context, [&](const Profile& profile) {
    return parse_assignments(options.assignments, profile)
        .and_then([&](std::vector<Assignment> assignments) {
          return ask_first(options, profile, *target, context).map([&] {
            return std::move(assignments);
          });
        });
  });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  Writer writer(opened->tool, options, context);
  if (options.reach == Reach::everybody) return send_to_all(opened->prepared, writer, options);
  const auto steps = check_against_tool(opened->prepared, opened->tool.device);
  if (!steps) return tl::unexpected(steps.error());
  return options.execution == Execution::dry_run ? writer.plan(*steps) : writer.write(*steps);
}

}  // namespace spindle::commands
