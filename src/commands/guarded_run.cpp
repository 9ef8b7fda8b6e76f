#include "guarded_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "records.hpp"

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
  return target.blamed(
      {.code = Errc::negative, .message = std::move(message), .hint = std::move(hint)});
}

GuardedRun::GuardedRun(OpenTool& tool, Context& context)
    : tool_(&tool), context_(&context), progress_(context), calm_line_(tool, context) {}

device::RunGuard::Reopen GuardedRun::reopener() {
  return [this](Duration patience) {
    progress_.show("the link is lost; trying to stop the tool");
    return calm_line_.connect(patience);
  };
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
  if (error.code != Errc::closed_pipe) fail(tool_->target.blamed(error));
}

void GuardedRun::fail(const device::StopReport& unconfirmed) {
  outcome_ = {};
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(unconfirmed.tried).count();
  fail(tool_->target.blamed(
      {.code = Errc::no_answer,
       .message = fmt::format("THE TOOL MAY STILL RUN: the stop was tried for {} s ({} times) and "
                              "could not be confirmed: {}",
                              seconds, unconfirmed.attempts, unconfirmed.trouble),
       .hint = "stop it at the tool"}));
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
  const auto listed = listing.end();
  const auto told = tell_errors();
  tell_left();
  if (outcome_.failed() == 0 && !listed) return tl::unexpected(listed.error());
  if (!listed || !told) return outcome_;
  return summarise(stop, run_end).map([&] { return outcome_; });
}

}  // namespace spindle::commands
