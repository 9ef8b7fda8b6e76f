#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "last_words.hpp"
#include "listing.hpp"
#include "patient_out.hpp"
#include "progress.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/device/run_guard.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/uninterruptible_line.hpp"

namespace spindle::commands {

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

/// An error that ended a run before its start, with what was left behind.
Error with_left(Error error, const std::vector<Left>& left);

/// What the change log says of a run. That its stop could not be confirmed matters more than its
/// result.
std::string log_word(std::string_view result, const device::StopReport& stop);

/// Why a tool was not started, or did not run to its end: an answer that is no.
Error not_ready(const Target& target, std::string message, std::string hint);

/// What every guarded run has in common, whatever runs: a line for stopping that signals do not
/// end, the one changing line on a terminal, its errors, and what is told at its end.
class GuardedRun {
 public:
  GuardedRun(OpenTool& tool, Context& context);

  ~GuardedRun() { tell_guardian(); }
  GuardedRun(const GuardedRun&) = delete;
  GuardedRun& operator=(const GuardedRun&) = delete;

  /// Starts the process that stops the tool when this one dies before it has done so itself. Comes
  /// before everything that a run changes; `settings` says what that is, in words or not at all:
  /// nothing but the stop is done for a program that died. An error means that there is none, so
  /// do not start. A simulated tool ends with the program and needs none.
  Result<void> set_guardian(std::string settings,
                            catalogue::StopMode mode = catalogue::StopMode::decelerate);

  /// Starts, follows and stops, whatever happens meanwhile: the pair of what `follow` says and how
  /// the stop went. `begin` is called before the start is sent.
  std::pair<Result<void>, device::StopReport> run(device::GuardedMotion motion,
                                                  const std::function<void()>& begin,
                                                  const std::function<Result<void>()>& follow);

  /// Error `closed_pipe` when the output has no reader any more.
  Result<void> check_reader() const;

  /// On a terminal, while something goes on.
  void show_running(Duration elapsed, std::string_view more = {});

  /// Remembers an error for the end; it also makes the outcome.
  void fail(const Error& error);
  /// What ended the following of a run.
  void fail_following(const Error& error);

  /// Remembers what is left behind, to be told at the end.
  void leave(std::vector<Left> left) { left_ = std::move(left); }

  [[nodiscard]] Outcome& outcome() { return outcome_; }

  /// Ends the list of what happened; then come the errors and the summary.
  Result<Outcome> end(Listing& listing, const device::StopReport& stop, const RunEnd& run_end);

 private:
  /// In the guardian's process: stops the tool, and says in words what became of it.
  std::string take_over(const std::string& settings, catalogue::StopMode mode) const;
  /// That all is safe.
  void tell_guardian();
  [[nodiscard]] std::string words_of_death() const;
  /// A line that signals do not end, for a stop after the first one broke.
  device::RunGuard::Reopen reopener();
  /// A stop that could not be confirmed: nothing else matters as much.
  void fail(const device::StopReport& unconfirmed);
  /// Each on its own: they reach people even where the records have no reader any more.
  Result<void> tell_errors();
  void tell_left() const;
  /// Waits until what was told is taken.
  Result<void> drain();
  [[nodiscard]] Result<Outcome> ended_with(const Result<void>& written) const;
  Result<void> summarise(const device::StopReport& stop, const RunEnd& run_end);

  OpenTool* tool_;
  Context* context_;
  ProgressLine progress_;
  /// From the start on: a motor must not run on because its reader is slow.
  std::optional<PatientOut> out_ = std::nullopt;
  UninterruptibleLine uninterruptible_line_;
  std::function<void()> tell_safe_ = {};  ///< empty: there is no guardian, or it knows
  Outcome outcome_ = {};
  std::vector<Error> errors_ = {};
  std::vector<Left> left_ = {};
};

}  // namespace spindle::commands
