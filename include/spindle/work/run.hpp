#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/device/run_guard.hpp"
#include "spindle/work/action.hpp"
#include "spindle/work/change_log.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::work {

/// What a user may say of a run. Each run model declares which of it it takes.
struct RunOptions {
  std::string preset = {};     ///< value of the action select-preset; empty: leave as it is
  std::string direction = {};  ///< value of the action direction; empty: leave as it is
  std::optional<Duration> limit = std::nullopt;  ///< stop after this time
  Acceptance acceptance = Acceptance::verified_only;
  // Of a motor that a command word or a command register runs.
  std::string speed = {};  ///< in the unit of its parameter
  catalogue::Direction direction_of_motor = catalogue::Direction::forward;
  std::optional<std::uint16_t> operation = std::nullopt;  ///< operation data; empty: the profile's
  std::string acceleration = {};                          ///< seconds; empty: leave as it is
  std::string deceleration = {};                          ///< seconds; empty: leave as it is
  std::optional<Duration> watchdog = std::nullopt;        ///< the driver's own; empty: leave it
  std::optional<catalogue::StopMode> stop = std::nullopt;
};

/// How a run ended, in words.
struct RunEnd {
  std::string result;       ///< for records, such as "fastening-ok" or "ran"; empty: none
  std::string subject;      ///< begins the sentence on whether it stands still: "OK; the tool"
  std::string logged = {};  ///< the result, as the change log says it; empty: none
};

/// Something that a run set and that was not set back.
struct Left {
  std::string name;     ///< of the parameter or action
  std::string set;      ///< what the run set it to
  std::string before;   ///< what it was; empty: not known
  std::string trouble;  ///< why it was not set back; may be empty
};

/// "select-preset: set to 2, before it was 1 (no answer); …".
std::string words_of(const std::vector<Left>& left);

/// One run of one tool, as its run model sets it up and follows it. run_guarded() calls these in
/// the order in which they stand here.
class Run {
 public:
  Run() = default;
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  virtual ~Run() = default;

  /// What it sets beside the motion, in words; empty: nothing.
  [[nodiscard]] virtual std::string settings_in_words() const = 0;
  /// Checks that the tool may be started, and sets it. Nothing moves.
  virtual Result<void> prepare() = 0;
  /// The start, as the change log names it.
  [[nodiscard]] virtual LoggedChange start_change() const = 0;
  [[nodiscard]] virtual device::GuardedMotion motion() = 0;
  /// Just before the start is sent: the time allowed begins.
  virtual void begin() = 0;
  /// Returns when the run is over or has to be ended.
  virtual Result<void> follow() = 0;
  /// Behind the stop: what can be read now may say more of how it ended.
  virtual void look_back(Result<void>& followed, const device::StopReport& stop) = 0;
  /// Of a tool that stands still, also after prepare() failed. Returns what could not be set back.
  virtual std::vector<Left> put_back() = 0;
  /// What was set and not set back, of a tool that may still run.
  [[nodiscard]] virtual std::vector<Left> left() const = 0;
  /// How it ended.
  virtual RunEnd judge(const Result<void>& followed) = 0;
};

/// What shows a run to a user.
class RunObserver {
 public:
  RunObserver() = default;
  RunObserver(const RunObserver&) = delete;
  RunObserver& operator=(const RunObserver&) = delete;
  virtual ~RunObserver() = default;

  virtual void on_prepared() = 0;
  /// Just before the start is sent. From now on it may hold up nothing.
  virtual void on_start() = 0;
  virtual void on_lost_link() = 0;
  virtual void on_stopped() = 0;
  /// A sentence that the user should know.
  virtual void note(const std::string& sentence) = 0;
};

/// A run that was begun.
struct RunReport {
  device::StopReport stop;
  RunEnd end;
  std::vector<Left> left;  ///< what is not as it was found
};

/// Sets, starts, follows and always stops; sets back and records. `mode` is how a second process
/// stops the tool when this one dies before it has done so itself; a simulated tool ends with the
/// program and needs none. Errors: those of prepare(), with what was left behind, and no second
/// process. `tool`, `log` and `environment` must outlive the run.
Result<RunReport> run_guarded(Run& run, catalogue::StopMode mode, OpenTool& tool, ChangeLog& log,
                              const Environment& environment, RunObserver& observer);

/// Why a tool was not started, or did not run to its end: an answer that is no.
Error not_ready(const Target& target, std::string message, std::string hint);

/// An option that is missing or wrong.
Error bad_option(std::string_view option, std::string message, std::string hint = {});

}  // namespace spindle::work
