#include "spindle/work/change.hpp"

#include <fmt/format.h>

#include <utility>

namespace spindle::work {

using catalogue::Parameter;
using catalogue::Value;
using device::JournalEntry;
using device::PutBackReport;
using device::RollbackResult;
using device::Written;

bool is_interruption(const Error& error) {
  return error.code == Errc::interrupted || error.code == Errc::terminated;
}

Error of_write(const std::string& parameter, Error error) {
  if (!is_interruption(error)) return error;
  error.name = parameter;
  error.hint = "whether it was written is not known: read it again";
  return error;
}

Error changed_meanwhile(std::string_view what) {
  return {.code = Errc::mismatch,
          .message = fmt::format("{}, so nothing was written to this tool", what),
          .hint = "look why, then give the command again"};
}

std::string_view result_of_failure(const Error& error) {
  return device::is_refusal(error) ? "refused" : "unknown";
}

/// Where it is not known what the tool holds, the record names both candidates.
Written Changer::make(const Parameter& parameter, const Value& before, const Value& value) {
  const std::string id = log_->begin(logged(parameter, before, value, {}, *target_));
  Written written = device_->write(parameter, before, value);
  log_->end(id, logged(parameter, before, written.now.value_or(value), to_text(written.result),
                       *target_));
  if (written.may_have_changed()) sent_.push_back({parameter, before, value, written.doubt});
  return written;
}

std::vector<PutBackReport> Changer::put_back(device::Rollback& rollback) {
  std::string id;
  device::RollbackObserver observer;
  observer.begin = [&](const JournalEntry& write) {
    id = log_->begin(logged(write.parameter, write.tried, write.before, {}, *target_));
  };
  observer.end = [&](const PutBackReport& report) {
    const auto& write = report.write;
    if (report.result == RollbackResult::kept) return;
    if (id.empty())
      id = log_->begin(logged(write.parameter, write.tried, write.before, {}, *target_));
    const bool done = report.result == RollbackResult::done;
    log_->end(std::exchange(id, {}),
              done ? logged(write.parameter, report.found.value_or(write.tried), write.before,
                            "rolled-back", *target_)
                   : logged(write.parameter, write.before, report.now.value_or(write.tried),
                            "not-rolled-back", *target_));
  };
  auto reports = rollback.run(sent_, observer);
  sent_.clear();
  return reports;
}

}  // namespace spindle::work
