#include "spindle/device/rollback.hpp"

#include <algorithm>
#include <utility>

namespace spindle::device {
namespace {

/// How long a tool that can not be reached is tried before it is given up and said so.
constexpr Duration patience = std::chrono::seconds(10);
/// Pause before the next try.
constexpr Duration pause = std::chrono::milliseconds(200);
/// However patient the user is with answers: somebody waits for a tool that is half written.
constexpr Duration longest_answer = std::chrono::seconds(2);
/// A connection on which so many requests in a row stayed without an answer is given up.
constexpr unsigned silences_allowed = 2;

}  // namespace

std::vector<PutBackReport> Rollback::run(std::span<const TriedWrite> writes) {
  std::vector<PutBackReport> reports;
  reports.reserve(writes.size());
  TimePoint deadline = calm_->now() + patience;
  for (auto write = writes.rbegin(); write != writes.rend(); ++write) {
    reports.push_back(put_back(*write, deadline));
  }
  return reports;
}

/// Every sign of life gives the tool its time anew; what comes after the time is up is tried once.
PutBackReport Rollback::put_back(const TriedWrite& write, TimePoint& deadline) {
  while (true) {
    auto report = connect(deadline).and_then([&] { return try_once(write); });
    if (report) {
      silences_ = 0;
      deadline = calm_->now() + patience;
      return *std::move(report);
    }
    const Error& error = report.error();
    lost_ = lost_ || error.code != Errc::no_answer || ++silences_ >= silences_allowed;
    const TimePoint next = calm_->now() + pause;
    if (next > deadline || !calm_->sleep_until(next)) {
      return {.write = write, .result = PutBack::unknown, .trouble = message_of(error)};
    }
  }
}

/// A refusal is an answer; errors are those of the line.
Result<PutBackReport> Rollback::try_once(const TriedWrite& write) {
  PutBackReport report{.write = write};
  const auto readings = device_->read_each({write.parameter}, Limits::skip);
  if (!readings) return tl::unexpected(readings.error());
  const Reading& reading = readings->front();
  if (!reading.value) {
    report.result = PutBack::refused;
    report.trouble = message_of(reading.value.error());
    return report;
  }
  report.found = *reading.value;
  report.now = report.found;
  if (*report.now == write.before) {
    report.result = PutBack::kept;
    return report;
  }
  const auto written = device_->write(write.parameter, *report.now, write.before);
  const bool is_refused = !written && written.error().code == Errc::exception_response;
  if (!written && !is_refused) return tl::unexpected(written.error());
  if (written) report.now = written->now;
  const bool done = written && written->result == WriteResult::written;
  report.result = done ? PutBack::done : PutBack::refused;
  if (is_refused) report.trouble = message_of(written.error());
  if (!done && !is_refused)
    report.trouble = "the tool acknowledged its old value, but does not hold it";
  return report;
}

Result<void> Rollback::connect(TimePoint deadline) {
  if (lost_) {
    device_->hang_up();
    auto opened = reopen_(std::max(deadline - calm_->now(), pause));
    if (!opened) return tl::unexpected(std::move(opened.error()));
    *device_ = std::move(*opened);
    lost_ = false;
    silences_ = 0;
  }
  link::Session& session = device_->session();
  session.shield();
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
