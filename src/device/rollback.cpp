#include "spindle/device/rollback.hpp"

#include <algorithm>
#include <utility>

namespace spindle::device {
namespace {

/// How long a tool that cannot be reached is tried before it is given up and said so.
constexpr Duration patience = std::chrono::seconds(10);
/// Pause before the next try.
constexpr Duration pause = std::chrono::milliseconds(200);
/// However patient the user is with answers: the user waits for a tool that is half written.
constexpr Duration longest_answer = std::chrono::seconds(2);
/// A connection on which so many requests in a row stayed without an answer is given up.
constexpr unsigned silences_allowed = 2;

}  // namespace

std::vector<PutBackReport> Rollback::run(std::span<const JournalEntry> writes,
                                         const RollbackObserver& observer) {
  std::vector<PutBackReport> reports;
  reports.reserve(writes.size());
  TimePoint deadline = calm_->now() + patience;
  for (auto write = writes.rbegin(); write != writes.rend(); ++write) {
    reports.push_back(put_back({.write = &*write, .observer = &observer}, deadline));
    if (observer.end) observer.end(reports.back());
  }
  return reports;
}

/// Every sign of life gives the tool its time anew; what comes after the time is up is tried once.
PutBackReport Rollback::put_back(Attempt attempt, TimePoint& deadline) {
  while (true) {
    auto tried = connect(deadline).and_then([&] { return try_once(attempt); });
    if (tried) {
      silences_ = 0;
      deadline = calm_->now() + patience;
      return *std::move(tried);
    }
    const Error& error = tried.error();
    lost_ = lost_ || !link::is_lost_answer(error) || ++silences_ >= silences_allowed;
    const TimePoint next = calm_->now() + pause;
    if (next > deadline || !calm_->sleep_until(next)) {
      return {.write = *attempt.write, .found = attempt.found, .trouble = message_of(error)};
    }
  }
}

/// A refusal is an answer; errors are those of the line. A try whose answer was lost may have
/// worked, so what was there at first is kept. Before a write is over that may act late, the
/// reading proves nothing: the old value is written behind it.
Result<PutBackReport> Rollback::try_once(Attempt& attempt) {
  const JournalEntry& write = *attempt.write;
  PutBackReport report{.write = write};
  TRY_LET(const auto readings, device_->read_each({write.parameter}, Limits::skip));
  const auto value = readings.front().held();
  if (!value) {
    report.result = RollbackResult::refused;
    report.trouble = message_of(value.error());
    return report;
  }
  if (!attempt.found) attempt.found = *value;
  report.found = attempt.found;
  report.now = *value;
  if (*value == write.before && write.doubt == Doubt::none) {
    report.result = attempt.begun ? RollbackResult::done : RollbackResult::kept;
    return report;
  }
  if (!attempt.begun && attempt.observer->begin) attempt.observer->begin(write);
  attempt.begun = true;
  auto put_back = write_back(report);
  const bool overtaken = write.doubt == Doubt::may_act_late && put_back &&
                         put_back->result == RollbackResult::refused &&
                         put_back->now == write.tried;
  if (!overtaken) return put_back;
  report.now = write.tried;  // it acted behind the old value, so it is over
  return write_back(std::move(report));
}

Result<PutBackReport> Rollback::write_back(PutBackReport report) {
  const JournalEntry& write = report.write;
  const Proof proof =
      write.doubt == Doubt::may_act_late ? Proof::after_settling : Proof::first_right;
  const Written written = device_->write(write.parameter, *report.now, write.before, proof);
  const bool answered = written.done() || written.error->code == Errc::exception_response ||
                        written.error->code == Errc::mismatch;
  if (!answered || written.result == WriteResult::unknown) {
    return tl::unexpected(*written.error);
  }
  report.now = written.now;
  report.result = written.done() ? RollbackResult::done : RollbackResult::refused;
  if (!written.done()) {
    report.trouble = written.error->code == Errc::mismatch
                         ? "the tool acknowledged its old value, but does not hold it"
                         : message_of(*written.error);
  }
  return report;
}

Result<void> Rollback::connect(TimePoint deadline) {
  if (lost_) {
    device_->disconnect();
    TRY_LET(auto opened, reopen_(std::max(deadline - calm_->now(), pause)));
    *device_ = std::move(opened);
    lost_ = false;
    silences_ = 0;
  }
  device_->shield(*calm_);
  link::Session& session = device_->session();
  session.set_answer_timeout(std::min(session.options().answer_timeout, longest_answer));
  return {};
}

Result<std::vector<Reading>> Rollback::read_again(
    const std::vector<catalogue::Parameter>& parameters) {
  auto connected = connect(calm_->now() + patience);
  if (!connected) return tl::unexpected(std::move(connected.error()));
  return device_->read_each(parameters, Limits::skip);
}

}  // namespace spindle::device
