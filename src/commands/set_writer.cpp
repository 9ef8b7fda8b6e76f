#include "set_writer.hpp"

#include <fmt/format.h>

#include <utility>

#include "group.hpp"
#include "records.hpp"
#include "storing.hpp"

namespace spindle::commands {

using catalogue::Value;

Result<SetResult> SetWriter::send(const std::vector<SetStep>& steps) {
  for (const SetStep& step : steps) {
    const Assignment& assignment = step.assignment;
    const auto sent = tool_->device.broadcast(assignment.parameter, assignment.value);
    if (!sent) {
      fail(sent.error());
      ++result_.counts.failed;
      break;
    }
    succeed(step, Ending::sent, assignment.value);
  }
  tell_effects(steps, tool_->target, *context_);
  const SetCounts& counts = result_.counts;
  return end({.counts = {{"sent", count(counts.changed)}, {"failed", count(counts.failed)}},
              .sentence = fmt::format("{} sent, not acknowledged", counts.changed),
              .target = tool_->target.shown});
}

Result<SetResult> SetWriter::write(const std::vector<SetStep>& steps) {
  SetCounts& counts = result_.counts;
  for (const SetStep& step : steps) {
    if (result_.outcome.failed() > 0) break;
    if (context_->interrupt.signalled()) {
      fail(tool_->target.blamed(context_->interrupt.error()));
    } else if (step.changes()) {
      write_one(step);
    } else {
      succeed(step, Ending::unchanged, *step.before);
    }
  }
  counts.left = steps.size() - counts.changed - counts.unchanged - counts.failed;
  tell_effects(steps, tool_->target, *context_);
  return end(set_summary(counts, tool_->target.shown));
}

void SetWriter::note(const SetStep& step, Ending ending, const Value& now) {
  listing_.add(step_record(step, ending, now, tool_->target, context_->clock));
}

void SetWriter::log(const SetStep& step, std::string_view result, const Value& now) {
  LoggedChange change = logged(step.assignment.parameter, step.before.value_or(now), now, result);
  if (!step.before) change.old_value.reset();
  log_.add(change);
}

void SetWriter::succeed(const SetStep& step, Ending ending, const Value& now) {
  note(step, ending, now);
  if (ending != Ending::unchanged) log(step, to_text(ending), now);
  ++(ending == Ending::unchanged ? result_.counts.unchanged : result_.counts.changed);
  result_.outcome.succeed();
}

void SetWriter::fail(const Error& error) {
  result_.outcome.fail(error);
  listing_.add(error);
}

void SetWriter::write_one(const SetStep& step) {
  const Value& wanted = step.assignment.value;
  auto written = tool_->device.write(step.assignment.parameter, *step.before, wanted);
  if (written && written->result == device::WriteResult::written) {
    return succeed(step, Ending::written, written->now);
  }
  ++result_.counts.failed;
  if (!written) {
    const Error& error = written.error();
    const bool refused = error.code == Errc::exception_response;
    if (refused) note(step, Ending::refused, *step.before);
    log(step, result_of_failure(error), refused ? *step.before : wanted);
    return fail(of_write(step.assignment.parameter.name, error));
  }
  const bool same = written->result == device::WriteResult::mismatch;
  const Ending ending = same ? Ending::mismatch : Ending::coerced;
  note(step, ending, written->now);
  log(step, to_text(ending), written->now);
  fail(not_stored(step, *written, tool_->target));
}

Result<SetResult> SetWriter::end(Summary summary) {
  auto drawn = listing_.end();
  const bool stores = storing_ == Storing::yes && result_.outcome.failed() == 0;
  if (drawn && stores) drawn = store(*tool_, log_, result_.outcome, *context_);
  if (drawn) drawn = tell(std::move(summary), result_.outcome, *context_);
  return drawn.map([&] { return result_; });
}

}  // namespace spindle::commands
