#include "run_output.hpp"

#include <fmt/format.h>

#include <utility>

#include "change_log.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/work/stop.hpp"

namespace spindle::commands {
namespace {

using work::Left;

/// By name, what each was before.
report::Cell cell_of(const std::vector<Left>& left) {
  if (left.empty()) return {};
  report::Pairs pairs;
  for (const Left& one : left) pairs.emplace_back(one.name, one.before);
  return pairs;
}

}  // namespace

Result<void> RunOutput::check_reader() const {
  const bool closed = context_->io.out_is_open && !context_->io.out_is_open();
  if (!closed) return {};
  return tl::unexpected(Error{.code = Errc::closed_pipe});
}

void RunOutput::show_running(Duration elapsed, std::string_view more) {
  const auto tenths = std::chrono::duration_cast<std::chrono::milliseconds>(elapsed).count() / 100;
  progress_.refresh(fmt::format("running {}.{} s{}", tenths / 10, tenths % 10, more));
}

void RunOutput::fail(const Error& error) {
  outcome_.fail(error);
  errors_.push_back(error);
}

void RunOutput::fail_following(const Error& error) {
  if (error.code != Errc::closed_pipe) {
    fail(with_target(error, tool_->target));
    return;
  }
  fail(not_ready(tool_->target,
                 "the output has no reader any more, so the run was ended before its time", ""));
}

void RunOutput::fail(const device::StopReport& unconfirmed) {
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

Result<void> RunOutput::tell_errors() {
  Result<void> told;
  for (const Error& error : errors_) {
    auto written = context_->renderer.error(error, context_->clock.wall());
    if (told) told = std::move(written);
  }
  return told;
}

/// A tool that is not as it was found is no talk that --quiet leaves out.
void RunOutput::tell_left(const std::vector<Left>& left) const {
  if (left.empty()) return;
  report::say_line(
      context_->io, report::Severity::error,
      fmt::format("spindle: {}: not set back: {}", tool_->target.shown, words_of(left)));
}

Result<void> RunOutput::summarise(const work::RunReport& report) {
  const auto& [stop, run_end, left] = report;
  const bool stopped = stop.result == device::StopResult::confirmed;
  return tell(with_change({.counts = {{"result", text_or_null(run_end.result)},
                                      {"stop_confirmed", stopped},
                                      {"left", cell_of(left)}},
                           .sentence = fmt::format("{} {}", run_end.subject,
                                                   stopped ? "stands still"
                                                           : "may still run: the stop could not be "
                                                             "confirmed"),
                           .target = tool_->target.shown},
                          *log_),
              outcome_, *context_);
}

Result<Outcome> RunOutput::end(const work::RunReport& report) {
  if (report.stop.result == device::StopResult::unconfirmed) fail(report.stop);
  const auto listed = listing_->end().and_then([&] { return drain(); });
  const auto told = tell_errors();
  tell_left(report.left);
  if (!listed || !told) return ended_with(listed);
  return ended_with(summarise(report).and_then([&] { return drain(); }));
}

/// A reader that has gone changes nothing about how the run ended.
Result<Outcome> RunOutput::ended_with(const Result<void>& written) const {
  const bool is_worse = !written && written.error().code != Errc::closed_pipe;
  if (is_worse && outcome_.failed() == 0) return tl::unexpected(written.error());
  return outcome_;
}

Result<void> RunOutput::drain() {
  if (!out_) return {};
  TRY_LET(const auto left, out_->drain());
  if (left > 0) {
    report::say_line(context_->io, report::Severity::error,
                     fmt::format("spindle: {}: the reader of standard output did not take {}",
                                 tool_->target.shown, counted(left, "record")));
  }
  return {};
}

}  // namespace spindle::commands
