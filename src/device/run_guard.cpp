#include "spindle/device/run_guard.hpp"

#include <algorithm>
#include <utility>

namespace spindle::device {
namespace {

/// How long a stop is tried before it is given up and said so.
constexpr Duration stop_patience = std::chrono::seconds(10);
/// The first stop is sent again when its answer takes longer than this; a slow tool's answer is
/// waited for by the later ones.
constexpr Duration first_answer = std::chrono::milliseconds(500);
/// However patient the user is with answers: a motor runs.
constexpr Duration longest_answer = std::chrono::seconds(2);
/// A connection on which so many stops in a row stayed without an answer is given up.
constexpr unsigned silences_allowed = 2;
constexpr Duration confirm_interval = std::chrono::milliseconds(20);

}  // namespace

Result<StopResult> stop_and_confirm(Device& device, const catalogue::Action& start, Clock& clock) {
  auto stopped = device.send_stop(start);
  if (!stopped) return tl::unexpected(std::move(stopped.error()));
  if (start.confirm.empty()) return StopResult::sent;
  const TimePoint deadline = clock.now() + device.session().options().answer_timeout;
  while (true) {
    TRY_LET(const auto running, device.shows(start.confirm, *start.stop_value));
    if (running == Shown::yes) return StopResult::confirmed;
    const TimePoint next = clock.now() + confirm_interval;
    if (next > deadline) return StopResult::unconfirmed;
    TRY(clock.sleep_until(next));
  }
}

GuardedMotion motion_of(const catalogue::Action& start) {
  return {.start = [&start](Device& device) { return device.send(start, *start.value); },
          .stop = [&start](Device& device,
                           Clock& clock) { return stop_and_confirm(device, start, clock); }};
}

RunGuard::RunGuard(Device& device, GuardedMotion motion, Reopen reopen, Clock& calm)
    : device_(&device),
      motion_(std::move(motion)),
      reopen_(std::move(reopen)),
      calm_(&calm),
      answer_timeout_(device.session().options().answer_timeout) {}

RunGuard::RunGuard(GuardedMotion motion, Reopen reopen, Clock& calm, Duration settles)
    : device_(nullptr),
      motion_(std::move(motion)),
      reopen_(std::move(reopen)),
      calm_(&calm),
      settles_(settles),
      line_(Line::lost) {}

RunGuard::~RunGuard() {
  if (armed_) stop();
}

Result<void> RunGuard::start() {
  armed_ = true;
  auto started = motion_.start(*device_);
  acknowledged_ = started.has_value();
  return started;
}

StopReport RunGuard::stop() {
  while (true) {
    if (auto report = try_stop()) return *report;
    if (!calm_->sleep_until(calm_->now() + pause)) return end_stop();
  }
}

StopReport RunGuard::end_stop() {
  trying_.tried = calm_->now() - *began_;
  report_ = trying_;
  return trying_;
}

void RunGuard::begin_stop() {
  if (began_) return;
  armed_ = false;
  began_ = calm_->now();
  limit_ = *began_ + stop_patience + motion_.stopping;
}

std::optional<StopReport> RunGuard::try_stop() {
  if (report_) return report_;
  begin_stop();
  const TimePoint tried_at = calm_->now();
  const auto stopped = try_to_stop(++trying_.attempts);
  trying_.result = stopped.value_or(StopResult::unconfirmed);
  trying_.trouble = stopped ? "the tool still says that it runs" : message_of(stopped.error());
  if (!stopped) judge_line(stopped.error());
  // A motor that needs long to stand still, and does not, is still braked.
  if (stopped && !std::exchange(extended_, true)) limit_ += calm_->now() - tried_at;
  const bool over = calm_->now() + pause > limit_;
  const bool hopeless = !stopped && is_hopeless(stopped.error());
  if (!is_proven(trying_) && !over && !hopeless) return std::nullopt;
  return end_stop();
}

/// One stop, on the connection that is there or on a new one.
Result<StopResult> RunGuard::try_to_stop(unsigned attempt) {
  if (line_ == Line::lost) {
    TRY(reopen(limit_ - calm_->now()));
  }
  link::Session& session = device_->session();
  session.set_uninterruptible();
  session.skip_verification();
  session.set_answer_timeout(patience_of(attempt));
  device_->set_retries(0);  // it is better to send the stop again
  return motion_.stop(*device_, *calm_);
}

Result<void> RunGuard::reopen(Duration patience) {
  if (device_ != nullptr) device_->disconnect();
  TRY_LET(auto opened, reopen_(patience));
  if (device_ == nullptr) {
    own_.emplace(std::move(opened));
    device_ = &*own_;
  } else {
    *device_ = std::move(opened);
  }
  line_ = Line::open;
  silences_ = 0;
  if (!answer_timeout_) answer_timeout_ = device_->session().options().answer_timeout;
  if (!acknowledged_) settled_at_ = calm_->now() + std::min(*answer_timeout_, settles_);
  return {};
}

Duration RunGuard::patience_of(unsigned attempt) const {
  return std::min(*answer_timeout_, attempt == 1 ? first_answer : longest_answer);
}

/// A refusal says that the line works, and one lost answer does not say that it is gone.
void RunGuard::judge_line(const Error& error) {
  if (error.code == Errc::exception_response) return;
  const bool silent = link::is_lost_answer(error) && ++silences_ < silences_allowed;
  if (!silent) line_ = Line::lost;
}

bool RunGuard::is_hopeless(const Error& error) const {
  return motion_.hopeless && motion_.hopeless(error);
}

/// On one connection a stop comes after its start. On another one it may come before a start that
/// was not acknowledged and that is still under way.
bool RunGuard::is_proven(const StopReport& report) const {
  return report.result != StopResult::unconfirmed && calm_->now() >= settled_at_;
}

}  // namespace spindle::device
