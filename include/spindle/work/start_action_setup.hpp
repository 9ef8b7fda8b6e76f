#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spindle/device/action_undo.hpp"
#include "spindle/work/run.hpp"
#include "spindle/work/uninterruptible_line.hpp"

namespace spindle::work {

/// Everything about the run of such a tool that is decided before it is touched.
struct StartActionPlan {
  catalogue::StartActionSpec facts;
  std::vector<ActionRequest> selections;  ///< what may be selected before, as far as it was given
  catalogue::Action start;
};

/// What a tool is set to before it is started, and what of it is set back afterwards.
class StartActionSetup {
 public:
  /// All must outlive it.
  StartActionSetup(const StartActionPlan& plan, OpenTool& tool, const Environment& environment,
                   ChangeLog& log)
      : plan_(&plan),
        tool_(&tool),
        environment_(&environment),
        log_(&log),
        uninterruptible_line_(tool, environment) {}

  /// Checks that the tool has no alarm and stands still (whether it is locked cannot be read on
  /// every product), and reads what is going to be changed. Only reads.
  Result<void> look();

  /// With what the tool would be started now, for the question: "preset 2 (target torque 1.20
  /// N.m), forward". Only reads.
  Result<std::string> describe();

  /// Selects what was asked for, each proven by reading back.
  Result<void> select();

  /// Of a tool that stands still, also after select() failed: sets back what was selected. Not
  /// ended by an interrupt, and reopens a lost link. Returns what could not be set back.
  std::vector<Left> put_back();

  /// What was selected and not set back, of a tool that may still run.
  [[nodiscard]] std::vector<Left> left() const;

 private:
  /// A selection and what the tool showed before it.
  struct Selected {
    ActionRequest request;
    std::optional<std::int64_t> before;  ///< empty: it cannot be read
    bool tried = false;
  };

  Result<std::optional<catalogue::Value>> shown_by(const catalogue::Action& action);
  Result<std::optional<std::string>> describe(std::string_view action);
  Result<std::string> describe_value(const ActionRequest& request);
  [[nodiscard]] static Left left_of(const Selected& selected, std::string trouble);

  const StartActionPlan* plan_;
  OpenTool* tool_;
  const Environment* environment_;
  ChangeLog* log_;
  UninterruptibleLine uninterruptible_line_;
  std::vector<Selected> selected_ = {};
};

}  // namespace spindle::work
