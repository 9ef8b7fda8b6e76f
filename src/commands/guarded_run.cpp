#include "guarded_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "change_log.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "stop_pursuit.hpp"
#include "stops.hpp"

namespace spindle::commands {

namespace {

std::string words_of(const std::vector<Left>& left) {
  std::vector<std::string> words;
  for (const auto& [name, set, before, trouble] : left) {
    words.push_back(fmt::format("{}: set to {}, before it {}{}", name, set,
                                before.empty() ? "is not known" : "was " + before,
                                trouble.empty() ? "" : fmt::format(" ({})", trouble)));
  }
  return fmt::format("{}", fmt::join(words, "; "));
}

/// By name, what each was before.
report::Cell cell_of(const std::vector<Left>& left) {
  if (left.empty()) return {};
  report::Pairs pairs;
  for (const Left& one : left) pairs.emplace_back(one.name, one.before);
  return pairs;
}

}  // namespace

Error with_left(Error error, const std::vector<Left>& left) {
  if (left.empty()) return error;
  error.message = fmt::format("{}; not set back: {}", message_of(error), words_of(left));
  return error;
}

std::string log_word(std::string_view result, const device::StopReport& stop) {
  if (stop.result == device::StopResult::unconfirmed) return "stop-not-confirmed";
  return std::string(result.empty() ? "no-result" : result);
}

Error not_ready(const Target& target, std::string message, std::string hint) {
  return with_target(
      Error{.code = Errc::negative, .message = std::move(message), .hint = std::move(hint)},
      target);
}

GuardedRun::GuardedRun(OpenTool& tool, Context& context)
    : tool_(&tool), context_(&context), progress_(context), uninterruptible_line_(tool, context) {}

Result<void> GuardedRun::set_guardian(std::string settings, catalogue::StopMode mode) {
  const bool simulated = tool_->target.endpoint.medium == link::Medium::simulated;
  if (simulated || !context_->uninterruptible.start_guardian) return {};
  auto tell_safe = context_->uninterruptible.start_guardian(
      [this, mode, settings = std::move(settings)] { return take_over(settings, mode); });
  if (!tell_safe) return tl::unexpected(with_target(std::move(tell_safe.error()), tool_->target));
  tell_safe_ = std::move(*tell_safe);
  return {};
}

std::string GuardedRun::take_over(const std::string& settings, catalogue::StopMode mode) const {
  const Context calm = uninterruptible_context(*context_);
  StopPursuit pursuit(*tool_, mode, calm);
  const device::StopReport report = pursuit.stop();
  const bool stopped = report.result != device::StopResult::unconfirmed;
  work::ChangeLog log = change_log("guardian", *tool_, *context_);
  // Behind the stop, which waits for no disk.
  log.end(log.begin({.name = "stop"}),
          {.name = "stop", .result = stopped ? "stopped" : "stop-not-confirmed"});
  const std::string who = fmt::format("{}: the program that ran it ended before it had stopped it",
                                      tool_->target.shown);
  const std::string left =
      settings.empty() ? "" : fmt::format("; what this run set may not be set back: {}", settings);
  if (stopped) return fmt::format("{}; its guardian did, and the tool stands still{}", who, left);
  return fmt::format(
      "{}. THE TOOL MAY STILL RUN: its guardian tried for {} s ({} times) and could "
      "not confirm a stop: {}; stop it at the tool{}",
      who, std::chrono::duration_cast<std::chrono::seconds>(report.tried).count(), report.attempts,
      report.trouble, left);
}

void GuardedRun::tell_guardian() {
  if (const auto tell = std::exchange(tell_safe_, nullptr)) tell();
}

std::string GuardedRun::words_of_death() const {
  const std::string guardian = tell_safe_ ? "; its guardian goes on trying to stop it" : "";
  return fmt::format(
      "{}: THE TOOL MAY STILL RUN: a second signal ended the program before the stop "
      "was confirmed{}; stop it at the tool",
      tool_->target.shown, guardian);
}

device::RunGuard::Reopen GuardedRun::reopener() {
  return [this](Duration patience) {
    progress_.show("the link is lost; trying to stop the tool");
    return uninterruptible_line_.connect(patience);
  };
}

std::pair<Result<void>, device::StopReport> GuardedRun::run(
    device::GuardedMotion motion, const std::function<void()>& begin,
    const std::function<Result<void>()>& follow) {
  if (context_->uninterruptible.refuse_suspend) context_->uninterruptible.refuse_suspend();
  out_.emplace(context_->io, context_->interrupt);
  device::RunGuard guard(tool_->device, std::move(motion), reopener(),
                         context_->uninterruptible.clock);
  const LastWords last_words(*context_, words_of_death());
  begin();
  auto followed = guard.start().and_then(follow);
  const device::StopReport stop = guard.stop();
  tell_guardian();
  progress_.clear();  // not before the stop: a terminal may keep its writer waiting
  return std::pair(std::move(followed), stop);
}

Result<void> GuardedRun::check_reader() const {
  const bool closed = context_->io.out_is_open && !context_->io.out_is_open();
  if (!closed) return {};
  return tl::unexpected(Error{.code = Errc::closed_pipe});
}

void GuardedRun::show_running(Duration elapsed, std::string_view more) {
  const auto tenths = std::chrono::duration_cast<std::chrono::milliseconds>(elapsed).count() / 100;
  progress_.refresh(fmt::format("running {}.{} s{}", tenths / 10, tenths % 10, more));
}

void GuardedRun::fail(const Error& error) {
  outcome_.fail(error);
  errors_.push_back(error);
}

void GuardedRun::fail_following(const Error& error) {
  if (error.code != Errc::closed_pipe) {
    fail(with_target(error, tool_->target));
    return;
  }
  fail(not_ready(tool_->target,
                 "the output has no reader any more, so the run was ended before its time", ""));
}

void GuardedRun::fail(const device::StopReport& unconfirmed) {
  outcome_ = {};
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(unconfirmed.tried).count();
  fail(with_target(Error{.code = Errc::no_answer,
                         .message = fmt::format(
                             "THE TOOL MAY STILL RUN: the stop was tried for {} s ({} times) and "
                             "could not be confirmed: {}",
                             seconds, unconfirmed.attempts, unconfirmed.trouble),
                         .hint = where_to_stop(tool_->profile.get())},
                   tool_->target));
}

Result<void> GuardedRun::tell_errors() {
  Result<void> told;
  for (const Error& error : errors_) {
    auto written = context_->renderer.error(error, context_->clock.wall());
    if (told) told = std::move(written);
  }
  return told;
}

/// A tool that is not as it was found is no talk that --quiet leaves out.
void GuardedRun::tell_left() const {
  if (left_.empty()) return;
  context_->io.err(
      fmt::format("spindle: {}: not set back: {}\n", tool_->target.shown, words_of(left_)));
}

Result<void> GuardedRun::summarise(const device::StopReport& stop, const RunEnd& run_end) {
  const bool stopped = stop.result == device::StopResult::confirmed;
  return context_->renderer.summary(
      summary_record({{"result", text_or_null(run_end.result)},
                      {"stop_confirmed", stopped},
                      {"left", cell_of(left_)}},
                     outcome_.status(), tool_->target.shown, context_->clock),
      fmt::format("{} {}", run_end.subject,
                  stopped ? "stands still" : "may still run: the stop could not be confirmed"));
}

Result<Outcome> GuardedRun::end(Listing& listing, const device::StopReport& stop,
                                const RunEnd& run_end) {
  if (stop.result == device::StopResult::unconfirmed) fail(stop);
  const auto listed = listing.end().and_then([&] { return drain(); });
  const auto told = tell_errors();
  tell_left();
  if (!listed || !told) return ended_with(listed);
  return ended_with(summarise(stop, run_end).and_then([&] { return drain(); }));
}

/// A reader that has gone changes nothing about how the run ended.
Result<Outcome> GuardedRun::ended_with(const Result<void>& written) const {
  const bool is_worse = !written && written.error().code != Errc::closed_pipe;
  if (is_worse && outcome_.failed() == 0) return tl::unexpected(written.error());
  return outcome_;
}

Result<void> GuardedRun::drain() {
  if (!out_) return {};
  const auto left = out_->drain();
  if (!left) return tl::unexpected(left.error());
  if (*left > 0) {
    context_->io.err(fmt::format("spindle: {}: the reader of standard output did not take {}\n",
                                 tool_->target.shown, counted(*left, "record")));
  }
  return {};
}

}  // namespace spindle::commands
