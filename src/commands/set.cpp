#include <fmt/format.h>

#include <array>
#include <optional>
#include <utility>

#include "change_log.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/catalogue/snapshot.hpp"
#include "spindle/catalogue/value.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"

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
};

/// How one assignment ended, as in the contract's record `write`.
enum class Ending : std::uint8_t { planned, written, unchanged, coerced, mismatch, refused };

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
  return Assignment{std::move(*parameter), std::move(*value)};
}

bool overlap(const Parameter& a, const Parameter& b) {
  const auto end = [](const Parameter& p) {
    return p.address.value + catalogue::register_count(p.encoding.kind);
  };
  return a.table == b.table && a.address.value < end(b) && b.address.value < end(a);
}

Result<std::vector<Assignment>> parse_assignments(const std::vector<std::string>& texts,
                                                  const Profile& profile) {
  std::vector<Assignment> assignments;
  for (const std::string& text : texts) {
    auto assignment = parse_assignment(text, profile);
    if (!assignment) return tl::unexpected(std::move(assignment.error()));
    for (const Assignment& earlier : assignments) {
      if (!overlap(earlier.parameter, assignment->parameter)) continue;
      return tl::unexpected(Error{.code = Errc::usage,
                                  .message = "its register is assigned twice",
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
  Value before;

  [[nodiscard]] bool changes() const { return !(before == assignment->value); }
};

Result<std::vector<Step>> check_against_tool(const std::vector<Assignment>& assignments,
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
                   {"old", step.before.number, step.before.to_string()},
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

/// Carries out one plan, and stops at the first write that fails.
class Writer {
 public:
  Writer(OpenTool& tool, Execution execution, Context& context)
      : tool_(&tool),
        context_(&context),
        listing_(context, execution == Execution::dry_run ? plan_columns : write_columns),
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

  Result<Outcome> write(const std::vector<Step>& steps) {
    for (const Step& step : steps) {
      if (outcome_.failed() > 0) break;
      step.changes() ? write_one(step) : keep(step);
    }
    const std::size_t left = steps.size() - outcome_.succeeded() - outcome_.failed();
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
    note(step, Ending::unchanged, step.before);
    ++unchanged_;
    outcome_.succeed();
  }

  void fail(const Error& error) {
    outcome_.fail(error);
    listing_.add(error);
  }

  void log(const Step& step, std::string_view result, const Value& now) {
    log_.add(logged(step.assignment->parameter, step.before, now, result));
  }

  void write_one(const Step& step) {
    const Value& wanted = step.assignment->value;
    const auto written = tool_->device.write(step.assignment->parameter, step.before, wanted);
    if (!written) {
      const bool refused = written.error().code == Errc::exception_response;
      if (refused) note(step, Ending::refused, step.before);
      log(step, refused ? to_text(Ending::refused) : "unknown", refused ? step.before : wanted);
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

  Result<Outcome> end(std::vector<report::Field> counts, const std::string& sentence) {
    auto drawn = listing_.end();
    if (drawn) {
      drawn = context_->renderer.summary(summary_record(std::move(counts), outcome_.status(),
                                                        tool_->target.shown, context_->clock),
                                         sentence);
    }
    return drawn.map([&] { return outcome_; });
  }

  OpenTool* tool_;
  Context* context_;
  Listing listing_;
  ChangeLog log_;
  Outcome outcome_ = {};
  std::size_t changed_ = 0;
  std::size_t unchanged_ = 0;
};

}  // namespace

Result<Outcome> set(const SetOptions& options, Context& context) {
  const auto target = resolve_target(options.target, context);
  if (!target) return tl::unexpected(target.error());
  auto opened = open_prepared(*target, Need::named_registers, context, [&](const Profile& profile) {
    return parse_assignments(options.assignments, profile);
  });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  const auto steps = check_against_tool(opened->prepared, opened->tool.device);
  if (!steps) return tl::unexpected(steps.error());
  Writer writer(opened->tool, options.execution, context);
  return options.execution == Execution::dry_run ? writer.plan(*steps) : writer.write(*steps);
}

}  // namespace spindle::commands
