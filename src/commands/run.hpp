#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "run_output.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/work/change_log.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// One run of one tool, which its model also asks for and tells of.
class ToolRun : public work::Run {
 public:
  /// Both must outlive it.
  ToolRun(OpenTool& tool, Context& context);

  /// Asks the user with what the tool itself says. Changes nothing.
  virtual Result<void> ask() = 0;

  [[nodiscard]] virtual std::vector<report::Column> columns() const = 0;

  /// Where it is shown from now on. It must outlive the run.
  void show_on(RunOutput& output) { output_ = &output; }
  /// Where it is recorded.
  [[nodiscard]] work::ChangeLog& log() { return log_; }

 protected:
  [[nodiscard]] OpenTool& tool() const { return *tool_; }
  [[nodiscard]] Context& context() const { return *context_; }
  /// Requires show_on().
  [[nodiscard]] RunOutput& output() const { return *output_; }

 private:
  OpenTool* tool_;
  Context* context_;
  work::ChangeLog log_;
  RunOutput* output_ = nullptr;
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
/// Calls `on_prepared` before the start.
Result<Outcome> run_and_tell(ToolRun& run, catalogue::StopMode mode, OpenTool& tool,
                             Context& context, const std::function<void()>& on_prepared);

}  // namespace spindle::commands
