#include "set_writer.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "records.hpp"
#include "spindle/base/text.hpp"
#include "storing.hpp"

namespace spindle::commands {

using catalogue::Value;

Result<SetResult> SetWriter::send(const std::vector<SetStep>& steps) {
  for (const SetStep& step : steps) {
    if (result_.outcome.failed() > 0) break;
    send_one(step);
  }
  tell_effects(steps, tool_->target, *context_);
  const SetCounts& counts = result_.counts;
  return end({.counts = {{"sent", count(counts.changed)}, {"failed", count(counts.failed)}},
              .sentence = fmt::format("{} sent, not acknowledged", counts.changed),
              .target = tool_->target.shown});
}

void SetWriter::look_behind(std::span<const SetStep> guarded) {
  if (context_->interrupt.signalled()) return;
  std::vector<catalogue::Parameter> written;
  std::vector<std::string> names;
  for (const SetStep& step : guarded) {
    written.push_back(step.assignment.parameter);
    if (step.changes()) names.push_back(step.assignment.parameter.name);
  }
  auto changes = bystanders_.read_behind(written);
  if (!changes) {
    Error error = std::move(changes.error());
    error.hint = "what else the tool changed is not known: compare it with a backup";
    return fail(error);
  }
  for (const catalogue::Difference& one : changes->values) {
    listing_.add(
        change_record(one.parameter, one.a, Ending::changed_along,
                      one.b.value_or(catalogue::Value{.content = catalogue::Content::none}),
                      tool_->target, context_->clock));
  }
  const auto named = [](const std::string& unit) {
    return unit.empty() ? std::string("a unit that is not known") : unit;
  };
  if (!changes->values.empty()) {
    context_->renderer.note(
        fmt::format("{}: the tool changed {} along with {}", tool_->target.shown,
                    counted(changes->values.size(), "value"), fmt::join(names, ", ")));
  }
  if (changes->torques > 0) {
    context_->renderer.note(fmt::format("{}: {} kept their numbers, and are now in {}, not in {}",
                                        tool_->target.shown, counted(changes->torques, "torque"),
                                        named(changes->unit_now), named(changes->unit_before)));
  }
}

void SetWriter::write_all(std::span<const SetStep> steps) {
  work::write_in_passes(
      steps, [&](const SetStep& step) { return write_one(step); },
      [&](const SetStep& step) { give_up(step); });
}

/// What is guarded may change the others, so they are read before and behind it.
Result<SetResult> SetWriter::write(const std::vector<SetStep>& steps) {
  const auto first_guarded = std::find_if(steps.begin(), steps.end(), [](const SetStep& step) {
    return step.assignment.parameter.guarding == catalogue::Guarding::alone;
  });
  const std::span<const SetStep> others(steps.begin(), first_guarded);
  const std::span<const SetStep> guarded(first_guarded, steps.end());
  const bool looks = std::any_of(guarded.begin(), guarded.end(),
                                 [](const SetStep& step) { return step.changes(); });
  SetCounts& counts = result_.counts;
  write_all(others);
  if (looks && result_.outcome.failed() == 0) {
    auto read = bystanders_.read_before();
    if (!read && others.empty()) return tl::unexpected(std::move(read.error()));
    if (!read) fail(read.error());
  }
  if (result_.outcome.failed() == 0) {
    write_all(guarded);
    if (looks) look_behind(guarded);
  }
  counts.left = steps.size() - counts.changed - counts.unchanged - counts.failed;
  tell_effects(steps, tool_->target, *context_);
  return end(set_summary(counts, tool_->target.shown));
}

void SetWriter::note(const SetStep& step, Ending ending, const Value& now) {
  listing_.add(step_record(step, ending, now, tool_->target, context_->clock));
}

void SetWriter::succeed(const SetStep& step, Ending ending, const Value& now) {
  note(step, ending, now);
  ++(ending == Ending::unchanged ? result_.counts.unchanged : result_.counts.changed);
  result_.outcome.succeed();
}

void SetWriter::fail(const Error& error) {
  result_.outcome.fail(error);
  listing_.add(error);
}

void SetWriter::send_one(const SetStep& step) {
  const auto& [parameter, value, text, converted, relative] = step.assignment;
  work::LoggedChange change =
      work::logged(parameter, value, value, ending_words.text(Ending::sent), tool_->target);
  change.old_value.reset();
  change.old_label.clear();
  const std::string id = log_.begin(change);
  const auto sent = tool_->device.broadcast(parameter, value);
  if (!sent) {
    change.result = "unknown";
    fail(sent.error());
    ++result_.counts.failed;
  } else {
    succeed(step, Ending::sent, value);
  }
  log_.end(id, change);
}

work::Step SetWriter::write_one(const SetStep& step) {
  if (context_->interrupt.signalled()) {
    fail(context_->interrupt.error());
    return work::Step::ended;
  }
  if (!step.changes()) {
    succeed(step, Ending::unchanged, *step.before);
    return work::Step::unchanged;
  }
  const auto& [parameter, value, text, converted, relative] = step.assignment;
  device::Written written = changer_.make(parameter, *step.before, value);
  if (written.done()) {
    Value now = *written.now;
    if (value.is_rounded()) now = value;
    succeed(step, Ending::written, now);
    return work::Step::done;
  }
  const bool is_refused = written.result == device::WriteResult::refused;
  refused_.insert_or_assign(&step, std::move(written));
  if (is_refused) return work::Step::refused;
  give_up(step);
  return work::Step::ended;
}

void SetWriter::give_up(const SetStep& step) {
  const auto& [parameter, value, text, converted, relative] = step.assignment;
  const device::Written& written = refused_.at(&step);
  ++result_.counts.failed;
  note(step, ending_of(written.result), written.now.value_or(value));
  fail(work::of_write(parameter.name, *written.error));
}

Result<SetResult> SetWriter::end(Summary summary) {
  auto drawn = listing_.end();
  const bool stores = storing_ == Storing::yes && result_.outcome.failed() == 0;
  if (drawn && stores) drawn = store(*tool_, log_, result_.outcome, *context_);
  if (drawn) {
    result_.change = log_.run();
    drawn = tell(with_change(std::move(summary), log_), result_.outcome, *context_);
  }
  return drawn.map([&] { return result_; });
}

}  // namespace spindle::commands
