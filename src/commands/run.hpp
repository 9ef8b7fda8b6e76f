#pragma once

#include <memory>
#include <string>
#include <vector>

#include "guarded_run.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/work/change_log.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// One guarded run of one tool, as its run model sets it up, follows it and tells of it. The order
/// of the calls is that of run_guarded().
class ToolRun {
 public:
  /// Both must outlive it.
  ToolRun(OpenTool& tool, Context& context);
  ToolRun(const ToolRun&) = delete;
  ToolRun& operator=(const ToolRun&) = delete;
  virtual ~ToolRun() = default;

  /// Asks the user with what the tool itself says. Changes nothing.
  virtual Result<void> ask() = 0;

  /// What it sets beside the motion, in words; empty: nothing.
  [[nodiscard]] virtual std::string settings_in_words() const = 0;
  /// Checks that the tool may be started, and sets it. Nothing moves.
  virtual Result<void> prepare() = 0;
  [[nodiscard]] virtual std::vector<report::Column> columns() const = 0;
  /// The start, as the change log names it.
  [[nodiscard]] virtual work::LoggedChange start_change() const = 0;
  [[nodiscard]] virtual device::GuardedMotion motion() = 0;
  /// Just before the start is sent: the time allowed begins. Both outlive follow() and judge().
  virtual void begin(GuardedRun& guarded, Listing& listing) = 0;
  /// Returns when the run is over or has to be ended.
  virtual Result<void> follow() = 0;
  /// Behind the stop: what can be read now may say more of how it ended.
  virtual void look_back(Result<void>& followed, const device::StopReport& stop) = 0;
  /// Of a tool that stands still, also after prepare() failed. Returns what could not be set back.
  virtual std::vector<Left> put_back() = 0;
  /// What was set and not set back, of a tool that may still run.
  [[nodiscard]] virtual std::vector<Left> left() const = 0;
  /// How it ended; what is wrong with that is an error of the guarded run.
  virtual RunEnd judge(const Result<void>& followed) = 0;

  /// Where it is recorded.
  [[nodiscard]] work::ChangeLog& log() { return log_; }

 protected:
  [[nodiscard]] OpenTool& tool() const { return *tool_; }
  [[nodiscard]] Context& context() const { return *context_; }

 private:
  OpenTool* tool_;
  Context* context_;
  work::ChangeLog log_;
};

/// Everything about a run that is decided before its tool is touched.
class RunPlan {
 public:
  RunPlan() = default;
  RunPlan(const RunPlan&) = delete;
  RunPlan& operator=(const RunPlan&) = delete;
  virtual ~RunPlan() = default;

  /// What is going to happen, as far as it is known before the tool is asked.
  [[nodiscard]] virtual std::string in_words(const Target& target) const = 0;
  /// The plan, the tool and the context must outlive the run.
  [[nodiscard]] virtual std::unique_ptr<ToolRun> on(OpenTool& tool, Context& context) const = 0;
};

/// By the run model of the profile. Errors name the option that is missing or wrong, and an option
/// that the model does not declare is one.
Result<std::unique_ptr<RunPlan>> plan_run(const RemoteStartOptions& options,
                                          const catalogue::Profile& profile, const Target& target);

/// Sets, starts, follows and always stops; sets back, logs and tells. `mode` is how it is stopped.
Result<Outcome> run_guarded(ToolRun& run, catalogue::StopMode mode, OpenTool& tool,
                            Context& context);

/// An option that is missing or wrong.
Error bad_option(std::string_view option, std::string message, std::string hint = {});

}  // namespace spindle::commands
