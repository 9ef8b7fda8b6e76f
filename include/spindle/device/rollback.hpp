#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spindle/device/device.hpp"

namespace spindle::device {

/// A write that may have reached the tool.
struct JournalEntry {
  catalogue::Parameter parameter;
  catalogue::Value before;
  catalogue::Value tried;
  /// A write that may act late is put back even where the tool reads as before.
  Doubt doubt = Doubt::none;
};

/// Whether a register holds what it held before.
enum class RollbackResult : std::uint8_t {
  done,     ///< it holds its old value again
  kept,     ///< it held its old value still
  refused,  ///< the tool does not take it back
  unknown,  ///< the tool could not be asked
};

struct PutBackReport {
  JournalEntry write;
  RollbackResult result = RollbackResult::unknown;
  std::optional<catalogue::Value> found = std::nullopt;  ///< before anything was put back
  std::optional<catalogue::Value> now = std::nullopt;    ///< as last read; empty: not known
  std::string trouble = {};                              ///< why it is not done
};

/// Is told of every write that a put-back needs, so that it can be recorded.
struct RollbackObserver {
  std::function<void(const JournalEntry& write)> begin = {};  ///< before the first one is sent
  std::function<void(const PutBackReport& report)> end = {};  ///< of every write, also without one
};

/// Puts a tool back to what it was after writing to it failed, the last write first. Not ended by
/// an interrupt, and reopens a lost link; gives up when the tool could not be reached for about
/// ten seconds.
class Rollback {
 public:
  /// Opens the same tool anew, on a line that interrupts do not end, within `patience`.
  using Reopen = std::function<Result<Device>(Duration patience)>;

  /// `calm` is a clock whose sleeps are not interrupted. The device goes on with the connection
  /// that it ended with.
  Rollback(Device& device, Reopen reopen, Clock& calm)
      : device_(&device), reopen_(std::move(reopen)), calm_(&calm) {}

  /// One report a write, in the order in which they were put back.
  std::vector<PutBackReport> run(std::span<const JournalEntry> writes,
                                 const RollbackObserver& observer = {});

  /// What differs from before, once everything was put back: a tool may have changed more than it
  /// was told to.
  Result<std::vector<Reading>> read_again(const std::vector<catalogue::Parameter>& parameters);

 private:
  /// One write while it is put back.
  struct Attempt {
    const JournalEntry* write;
    const RollbackObserver* observer;
    std::optional<catalogue::Value> found = std::nullopt;  ///< before anything was put back
    bool begun = false;                                    ///< something was sent
  };

  PutBackReport put_back(Attempt attempt, TimePoint& deadline);
  Result<PutBackReport> try_once(Attempt& attempt);
  Result<PutBackReport> write_back(PutBackReport report);
  Result<void> connect(TimePoint deadline);

  Device* device_;
  Reopen reopen_;
  Clock* calm_;
  bool lost_ = false;
  unsigned silences_ = 0;  ///< requests in a row without an answer on this connection
};

}  // namespace spindle::device
