#include "spindle/device/action_undo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace spindle::device {
namespace {

/// How long a tool that cannot be reached is tried before it is given up and said so.
constexpr Duration patience = std::chrono::seconds(10);
/// Pause before the next try.
constexpr Duration pause = std::chrono::milliseconds(200);
constexpr Duration confirm_interval = std::chrono::milliseconds(20);
/// However patient the user is with answers.
constexpr Duration longest_answer = std::chrono::seconds(2);

class Undo {
 public:
  Undo(const DoneAction& action, Device& device, const Rollback::Reopen& reopen, Clock& calm)
      : action_(&action), device_(&device), reopen_(&reopen), calm_(&calm) {}

  UndoReport run() {
    const TimePoint deadline = calm_->now() + patience;
    while (true) {
      auto tried = connect(deadline).and_then([&] { return try_once(); });
      if (tried) return *std::move(tried);
      report_.trouble = message_of(tried.error());
      lost_ = lost_ || !link::is_lost_answer(tried.error()) || ++silences_ > 1;
      const TimePoint next = calm_->now() + pause;
      if (next > deadline || !calm_->sleep_until(next)) return report_;
    }
  }

 private:
  Result<void> connect(TimePoint deadline) {
    if (lost_) {
      device_->disconnect();
      TRY_LET(auto opened, (*reopen_)(std::max(deadline - calm_->now(), pause)));
      *device_ = std::move(opened);
      lost_ = false;
      silences_ = 0;
    }
    link::Session& session = device_->session();
    session.set_uninterruptible();
    session.set_answer_timeout(std::min(session.options().answer_timeout, longest_answer));
    return {};
  }

  Result<std::int64_t> shown() {
    TRY_LET(const auto parameter, device_->profile().find(action_->action.confirm));
    TRY_LET(const auto readings, device_->read_each({parameter}, Limits::skip));
    const auto& value = readings.front().value;
    if (!value) return tl::unexpected(value.error());
    return value->number.mantissa();
  }

  /// A refusal is an answer; errors are those of the line.
  Result<UndoReport> try_once() {
    auto now = shown();
    if (!now) return refused_or(std::move(now.error()));
    if (!report_.found) report_.found = *now;
    if (*now == action_->before) {
      return ended(*report_.found == action_->before ? RollbackResult::kept : RollbackResult::done,
                   {});
    }
    if (*now != action_->done) {
      return ended(RollbackResult::refused, fmt::format("it was changed to {} meanwhile", *now));
    }
    auto sent = device_->send(action_->action, action_->before);
    if (!sent) return refused_or(std::move(sent.error()));
    const TimePoint deadline = calm_->now() + device_->session().options().answer_timeout;
    while (true) {
      now = shown();
      if (!now) return refused_or(std::move(now.error()));
      if (*now == action_->before) return ended(RollbackResult::done, {});
      const TimePoint next = calm_->now() + confirm_interval;
      if (next > deadline || !calm_->sleep_until(next)) break;
    }
    return ended(RollbackResult::refused, "the tool acknowledged it, and does not show it");
  }

  UndoReport ended(RollbackResult result, std::string trouble) {
    report_.result = result;
    report_.trouble = std::move(trouble);
    return report_;
  }

  Result<UndoReport> refused_or(Error error) {
    if (!is_refusal(error)) return tl::unexpected(std::move(error));
    return ended(RollbackResult::refused, message_of(error));
  }

  const DoneAction* action_;
  Device* device_;
  const Rollback::Reopen* reopen_;
  Clock* calm_;
  UndoReport report_ = {};
  bool lost_ = false;
  unsigned silences_ = 0;  ///< requests in a row without an answer on this connection
};

}  // namespace

UndoReport undo(const DoneAction& action, Device& device, const Rollback::Reopen& reopen,
                Clock& calm) {
  return Undo(action, device, reopen, calm).run();
}

}  // namespace spindle::device
