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
  std::optional<catalogue::Value> found;
  while (true) {
    auto tried = connect(deadline).and_then([&] { return try_once(write, found); });
    if (tried) {
      silences_ = 0;
      deadline = calm_->now() + patience;
      return *std::move(tried);
    }
    const Error& error = tried.error();
    lost_ = lost_ || error.code != Errc::no_answer || ++silences_ >= silences_allowed;
    const TimePoint next = calm_->now() + pause;
    if (next > deadline || !calm_->sleep_until(next)) {
      return {.write = write, .found = found, .trouble = message_of(error)};
    }
  }
}

/// A refusal is an answer; errors are those of the line. `found` is what was there at first: a try
/// whose answer was lost may have worked.
Result<PutBackReport> Rollback::try_once(const TriedWrite& write,
                                         std::optional<catalogue::Value>& found) {
  PutBackReport report{.write = write};
  const auto readings = device_->read_each({write.parameter}, Limits::skip);
  if (!readings) return tl::unexpected(readings.error());
  const auto& value = readings->front().value;
  if (!value) {
    report.result = PutBack::refused;
    report.trouble = message_of(value.error());
    return report;
  }
  if (!found) found = *value;
  report.found = found;
  report.now = *value;
  if (*value == write.before) {
    report.result = *found == write.before ? PutBack::kept : PutBack::done;
    return report;
  }
  return write_back(std::move(report));
}

Result<PutBackReport> Rollback::write_back(PutBackReport report) {
  const TriedWrite& write = report.write;
  const auto written = device_->write(write.parameter, *report.now, write.before);
  if (!written && written.error().code != Errc::exception_response) {
    return tl::unexpected(written.error());
  }
  report.result = PutBack::refused;
  if (!written) {
    report.trouble = message_of(written.error());
    return report;
  }
  report.now = written->now;
  if (written->result == WriteResult::written) {
    report.result = PutBack::done;
  } else {
    report.trouble = "the tool acknowledged its old value, but does not hold it";
  }
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
