#pragma once

#include <string_view>
#include <vector>

#include "progress.hpp"
#include "spindle/commands/target.hpp"
#include "spindle/device/run_guard.hpp"

namespace spindle::commands {

/// What every guarded run has in common, whatever runs: a line for stopping that signals do not
/// end, the one changing line on a terminal, and its errors.
class GuardedRun {
 public:
  GuardedRun(OpenTool& tool, Context& context);

  /// A line that signals do not end, for a stop after the first one broke.
  device::RunGuard::Reopen reopener();

  /// Error `closed_pipe` when nobody reads the output any more.
  Result<void> check_reader() const;

  /// On a terminal, while something goes on.
  void show_running(Duration elapsed, std::string_view more = {});

  void clear_state() { progress_.clear(); }

  /// Remembers an error for the end; it also makes the outcome.
  void fail(const Error& error);
  /// A stop that could not be confirmed: nothing else matters as much.
  void fail(const device::StopReport& unconfirmed);
  /// Each on its own: they reach people even where nobody reads the records any more.
  Result<void> tell_errors();

  [[nodiscard]] Outcome& outcome() { return outcome_; }

 private:
  OpenTool* tool_;
  Context* context_;
  ProgressLine progress_;
  Context calm_context_;  ///< lines that are opened on it refer to it
  Outcome outcome_ = {};
  std::vector<Error> errors_ = {};
};

}  // namespace spindle::commands
