#include "spindle/work/run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <utility>

#include "spindle/work/last_words.hpp"
#include "spindle/work/stop_pursuit.hpp"
#include "spindle/work/uninterruptible_line.hpp"

namespace spindle::work {
namespace {

/// An error that ended a run before its start, with what was left behind.
Error with_left(Error error, const std::vector<Left>& left) {
  if (left.empty()) return error;
  error.message = fmt::format("{}; not set back: {}", message_of(error), words_of(left));
  return error;
}

/// What the change log says of a run. That its stop could not be confirmed matters more than its
/// result.
std::string log_word(std::string_view result, const device::StopReport& stop) {
  if (stop.result == device::StopResult::unconfirmed) return "stop-not-confirmed";
  return std::string(result.empty() ? "no-result" : result);
}

/// The process that stops the tool when this one dies before it has done so itself.
class Guardian {
 public:
  Guardian(const OpenTool& tool, const Environment& environment, RunObserver& observer)
      : tool_(&tool), environment_(&environment), observer_(&observer) {}
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;
  ~Guardian() { tell_safe(); }

  /// Comes before everything that a run changes; `settings` says what that is, in words or not at
  /// all: nothing but the stop is done for a program that died.
  Result<void> start(std::string settings, catalogue::StopMode mode);

  /// That all is safe.
  void tell_safe() {
    if (const auto tell = std::exchange(tell_safe_, nullptr)) tell();
  }
  [[nodiscard]] bool is_on_guard() const { return tell_safe_ != nullptr; }

 private:
  /// In its own process: stops the tool, and says in words what became of it.
  [[nodiscard]] std::string take_over(const std::string& settings, catalogue::StopMode mode) const;

  const OpenTool* tool_;
  const Environment* environment_;
  RunObserver* observer_;
  std::function<void()> tell_safe_ = {};  ///< empty: there is no guardian, or it knows
};

Result<void> Guardian::start(std::string settings, catalogue::StopMode mode) {
  const bool simulated = tool_->target.endpoint.medium == link::Medium::simulated;
  const auto& start_guardian = environment_->uninterruptible.start_guardian;
  if (simulated || !start_guardian) return {};
  auto tell_safe = start_guardian(
      [this, mode, settings = std::move(settings)] { return take_over(settings, mode); });
  if (!tell_safe) return tl::unexpected(with_target(std::move(tell_safe.error()), tool_->target));
  tell_safe_ = std::move(*tell_safe);
  return {};
}

std::string Guardian::take_over(const std::string& settings, catalogue::StopMode mode) const {
  const Environment calm = uninterruptible(*environment_);
  StopPursuit pursuit(*tool_, mode, calm);
  const device::StopReport report = pursuit.stop();
  const bool stopped = report.result != device::StopResult::unconfirmed;
  ChangeLog log = change_log("guardian", *tool_, *environment_,
                             [this](const std::string& sentence) { observer_->note(sentence); });
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

std::string words_of_death(const Target& target, const Guardian& guardian) {
  return fmt::format(
      "{}: THE TOOL MAY STILL RUN: a second signal ended the program before the stop "
      "was confirmed{}; stop it at the tool",
      target.shown, guardian.is_on_guard() ? "; its guardian goes on trying to stop it" : "");
}

}  // namespace

std::string words_of(const std::vector<Left>& left) {
  std::vector<std::string> words;
  for (const auto& [name, set, before, trouble] : left) {
    words.push_back(fmt::format("{}: set to {}, before it {}{}", name, set,
                                before.empty() ? "is not known" : "was " + before,
                                trouble.empty() ? "" : fmt::format(" ({})", trouble)));
  }
  return fmt::format("{}", fmt::join(words, "; "));
}

Result<RunReport> run_guarded(Run& run, catalogue::StopMode mode, OpenTool& tool, ChangeLog& log,
                              const Environment& environment, RunObserver& observer) {
  UninterruptibleLine line(tool, environment);
  Guardian guardian(tool, environment, observer);
  TRY(guardian.start(run.settings_in_words(), mode));
  if (auto ready = run.prepare(); !ready) {
    return tl::unexpected(with_left(std::move(ready.error()), run.put_back()));
  }
  observer.on_prepared();
  LoggedChange start = run.start_change();
  const std::string id = log.begin(start);
  if (environment.uninterruptible.refuse_suspend) environment.uninterruptible.refuse_suspend();
  observer.on_start();
  const auto reopen = [&](Duration patience) {
    observer.on_lost_link();
    return line.connect(patience);
  };
  device::RunGuard guard(tool.device, run.motion(), reopen, environment.uninterruptible.clock);
  std::optional<LastWords> last_words(std::in_place, environment,
                                      words_of_death(tool.target, guardian));
  run.begin();
  auto followed = guard.start().and_then([&] { return run.follow(); });
  RunReport report{.stop = guard.stop(), .end = {}, .left = {}};
  guardian.tell_safe();
  observer.on_stopped();
  last_words.reset();
  run.look_back(followed, report.stop);
  const bool stands = report.stop.result == device::StopResult::confirmed;
  report.left = stands ? run.put_back() : run.left();
  report.end = run.judge(followed);
  start.result = log_word(report.end.logged, report.stop);
  log.end(id, start);
  return report;
}

Error not_ready(const Target& target, std::string message, std::string hint) {
  return with_target(
      Error{.code = Errc::negative, .message = std::move(message), .hint = std::move(hint)},
      target);
}

Error bad_option(std::string_view option, std::string message, std::string hint) {
  return {.code = Errc::usage,
          .message = std::move(message),
          .hint = std::move(hint),
          .name = std::string(option)};
}

}  // namespace spindle::work
