#include "spindle/device/run_guard.hpp"

#include <algorithm>
#include <utility>

namespace spindle::device {
namespace {

/// How long a stop is tried before it is given up and said so.
constexpr Duration stop_patience = std::chrono::seconds(10);
/// Pause before the next try, so that a refusing tool is not flooded.
constexpr Duration stop_pause = std::chrono::milliseconds(200);
/// An answer that takes longer than this is not worth waiting for while a motor runs: send again.
constexpr Duration stop_answer = std::chrono::milliseconds(500);

}  // namespace

Result<StopResult> stop_and_confirm(Device& device, const catalogue::Action& start, Clock& clock) {
  auto stopped = device.send_stop(start);
  if (!stopped) return tl::unexpected(std::move(stopped.error()));
  if (start.confirm.empty()) return StopResult::sent;
  const TimePoint deadline = clock.now() + device.session().options().answer_timeout;
  while (true) {
    const auto running = device.shows(start.confirm, *start.stop_value);
    if (!running) return tl::unexpected(running.error());
    if (*running == Shown::yes) return StopResult::confirmed;
    const TimePoint next = clock.now() + stop_pause / 10;
    if (next > deadline) return StopResult::unconfirmed;
    if (auto slept = clock.sleep_until(next); !slept) return tl::unexpected(slept.error());
  }
}

RunGuard::RunGuard(Device& device, const catalogue::Action& start, Reopen reopen, Clock& calm)
    : device_(&device), action_(&start), reopen_(std::move(reopen)), calm_(&calm) {}

RunGuard::~RunGuard() {
  if (armed_) stop();
}

Result<void> RunGuard::start() {
  armed_ = true;
  return device_->send(*action_, *action_->value);
}

Result<StopResult> RunGuard::try_to_stop(Device& device) {
  link::Session& session = device.session();
  session.shield();
  session.set_answer_timeout(std::min(session.options().answer_timeout, stop_answer));
  return stop_and_confirm(device, *action_, *calm_);
}

StopReport RunGuard::stop() {
  if (report_) return *report_;
  armed_ = false;
  StopReport report;
  const TimePoint began = calm_->now();
  const TimePoint limit = began + stop_patience;
  std::optional<Device> reopened;
  Device* device = device_;
  while (true) {
    ++report.attempts;
    if (device == nullptr) {
      if (auto opened = reopen_()) {
        reopened.emplace(std::move(*opened));
        device = &*reopened;
      } else {
        report.trouble = message_of(opened.error());
      }
    }
    if (device != nullptr) {
      const auto stopped = try_to_stop(*device);
      report.result = stopped.value_or(StopResult::unconfirmed);
      if (report.result != StopResult::unconfirmed) break;
      report.trouble = stopped ? "the tool still says that it runs" : message_of(stopped.error());
      if (!stopped && stopped.error().code != Errc::exception_response) device = nullptr;
    }
    if (calm_->now() + stop_pause > limit) break;
    if (!calm_->sleep_until(calm_->now() + stop_pause)) break;
  }
  report.tried = calm_->now() - began;
  report_ = report;
  return report;
}

}  // namespace spindle::device
