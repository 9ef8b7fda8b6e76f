#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/device/device.hpp"
#include "spindle/device/rollback.hpp"
#include "spindle/work/change_log.hpp"

namespace spindle::work {

bool is_interruption(const Error& error);

/// The error of a write; of one that was cut off it also says that its effect is not known.
Error of_write(const std::string& parameter, Error error);

/// A tool that was planned for is not as it was then, so nothing is written to it. Error
/// `mismatch`; `what` says what differs.
Error changed_meanwhile(std::string_view what);

/// The result of an action that failed: "refused" by the tool, or "unknown" where it cannot be
/// said whether it was done.
std::string_view result_of_failure(const Error& error);

/// How one write of several went, for write_in_passes().
enum class Step : std::uint8_t {
  unchanged,  ///< there was nothing to write
  done,       ///< the tool holds what it should
  refused,    ///< it refused, and holds what it held
  ended,      ///< nothing more is to be written
};

/// Calls `write(item)` for each item in turn. Where values bound each other, what is
/// refused may be taken behind the others: it is tried once more, if something else was written
/// meanwhile. `refuse(item)` is told of what is refused for good.
template <typename Items, typename Write, typename Refuse>
void write_in_passes(const Items& items, Write write, Refuse refuse) {
  struct Refused {
    const typename Items::value_type* item;
    std::size_t written_before;
  };
  std::vector<Refused> refused;
  std::size_t written = 0;
  for (const auto& item : items) {
    const Step step = write(item);
    if (step == Step::ended) return;
    if (step == Step::refused) refused.push_back({&item, written});
    if (step == Step::done) ++written;
  }
  for (const Refused& one : refused) {
    const bool is_worth_it = written > one.written_before;
    const Step step = is_worth_it ? write(*one.item) : Step::refused;
    if (step == Step::ended) return;
    if (step == Step::refused) return refuse(*one.item);
    ++written;
  }
}

/// Changes values of one tool, by the same rule whatever the command: the intent is recorded, the
/// value is written, what became of it is read back and recorded, and all of it can be put back.
class Changer {
 public:
  /// All must outlive it. `target` says the unit of torques, whenever one is written.
  Changer(device::Device& device, ChangeLog& log, const Target& target)
      : device_(&device), log_(&log), target_(&target) {}

  /// Writes one value; see Device::write. `before` is the value read before.
  device::Written make(const catalogue::Parameter& parameter, const catalogue::Value& before,
                       const catalogue::Value& value);

  /// Everything that was written since the last put_back() and that the tool may hold, now or in a
  /// moment, in the order in which it was sent.
  [[nodiscard]] const std::vector<device::JournalEntry>& sent() const { return sent_; }

  /// Puts all of sent() back, the last first, and records each as `rolled-back` or
  /// `not-rolled-back`; what was found as before is not written. One report a write, in that order.
  std::vector<device::PutBackReport> put_back(device::Rollback& rollback);

 private:
  device::Device* device_;
  ChangeLog* log_;
  const Target* target_;
  std::vector<device::JournalEntry> sent_ = {};
};

}  // namespace spindle::work
