#pragma once

#include <functional>
#include <optional>
#include <string>

#include "spindle/device/device.hpp"

namespace spindle::device {

/// How surely a started motion has ended.
enum class StopResult : std::uint8_t {
  confirmed,    ///< the tool says that it does not run
  sent,         ///< acknowledged; nothing that can be read proves it
  unconfirmed,  ///< the link is gone, or the tool still says that it runs
};

struct StopReport {
  StopResult result = StopResult::unconfirmed;
  unsigned attempts = 0;     ///< how often the stop was sent, or a connection tried for it
  Duration tried = {};       ///< for how long
  std::string trouble = {};  ///< the last trouble, for `unconfirmed`
};

/// What a guard starts and stops.
struct GuardedMotion {
  /// Sends the start, exactly once.
  std::function<Result<void>(Device&)> start;
  /// Sends the stop and waits for the proof; may be called again and again.
  std::function<Result<StopResult>(Device&, Clock&)> stop;
  Duration stopping = {};  ///< how long a stop that works may take
  /// Whether no further try makes sense after this error, because it will be the same. Empty: every
  /// error may be the last one.
  std::function<bool(const Error&)> hopeless = {};
};

/// The motion of an action with a stop value, which must outlive it.
GuardedMotion motion_of(const catalogue::Action& start);

/// From the moment a start is sent, a stop is sent on every way out. The holder of a guard calls
/// stop(); else the destructor does it. Stopping is not ended by an interrupt, and it
/// reopens a lost link. It cannot stop a tool that cannot be reached: this is not a safety
/// function.
class RunGuard {
 public:
  /// Between two tries, so that a refusing tool is not flooded.
  static constexpr Duration pause = std::chrono::milliseconds(200);

  /// Opens the tool anew for a stop, on a line that interrupts do not end, within `patience`.
  using Reopen = std::function<Result<Device>(Duration patience)>;

  /// `calm` is a clock whose sleeps are not interrupted.
  RunGuard(Device& device, GuardedMotion motion, Reopen reopen, Clock& calm);
  /// `start` is an action with a stop value.
  RunGuard(Device& device, const catalogue::Action& start, Reopen reopen, Clock& calm)
      : RunGuard(device, motion_of(start), std::move(reopen), calm) {}
  /// Only stops what another program has started; the first try opens the tool. `settles` is how
  /// long a start that was sent before may still be under way to it.
  RunGuard(GuardedMotion motion, Reopen reopen, Clock& calm, Duration settles);
  ~RunGuard();
  RunGuard(const RunGuard&) = delete;
  RunGuard& operator=(const RunGuard&) = delete;

  /// Sends the start, exactly once. The guard is armed even when no acknowledgement comes: the tool
  /// may run all the same.
  Result<void> start();

  /// Sends the stop until it is proven to have worked, for about ten seconds at most and the time
  /// that the stop itself may take. Further calls
  /// do nothing and report the same. The device goes on with the connection that it ended with.
  StopReport stop();

  /// One try of stop(): the report when it was the last one. Who stops several tools in turns calls
  /// this with a pause between.
  std::optional<StopReport> try_stop();

 private:
  enum class Line : std::uint8_t { open, lost };
  static constexpr Duration longest_settling = std::chrono::seconds(2);

  Result<StopResult> try_to_stop(unsigned attempt);
  void begin_stop();
  StopReport end_stop();
  Result<void> reopen(Duration patience);
  Duration patience_of(unsigned attempt) const;
  void judge_line(const Error& error);
  [[nodiscard]] bool is_hopeless(const Error& error) const;
  [[nodiscard]] bool is_proven(const StopReport& report) const;

  std::optional<Device> own_ = std::nullopt;
  Device* device_;  ///< null until the first one is open
  GuardedMotion motion_;
  Reopen reopen_;
  Clock* calm_;
  std::optional<Duration> answer_timeout_;  ///< the user's or the profile's
  Duration settles_ = longest_settling;
  bool armed_ = false;
  bool acknowledged_ = false;
  TimePoint settled_at_ = {};  ///< before this, a start of the old connection may still come true
  Line line_ = Line::open;
  unsigned silences_ = 0;  ///< stops without an answer on this connection
  std::optional<TimePoint> began_ = std::nullopt;
  TimePoint limit_ = {};
  bool extended_ = false;  ///< once, by a stop that was acknowledged and took its time
  StopReport trying_ = {};
  std::optional<StopReport> report_ = std::nullopt;
};

/// Sends the stop of an action and waits until its confirming parameter shows it. The stop may be
/// repeated without harm. A tool that still runs at the deadline is `unconfirmed`.
Result<StopResult> stop_and_confirm(Device& device, const catalogue::Action& start, Clock& clock);

}  // namespace spindle::device
