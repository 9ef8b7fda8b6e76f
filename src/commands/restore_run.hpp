#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "change_log.hpp"
#include "progress.hpp"
#include "restore_records.hpp"
#include "set_records.hpp"
#include "spindle/work/uninterruptible_line.hpp"

namespace spindle::commands {

/// How a restore ended on one tool.
struct RestoreResult {
  Outcome outcome = {};
  RestoreCounts counts = {};
  std::string change = {};  ///< id of what was changed; empty: nothing was
};

/// The summary of several tools with the id of all that was changed on them.
Summary with_change_of(Summary summary, const std::vector<Result<RestoreResult>>& done,
                       const CommonRun& run);

/// Carries out a plan: writes in its order, reads each back, compares everything at the end. On
/// failure, an interrupt or a lost link it puts back what it wrote, and tells what the tool holds
/// where that fails too.
class RestoreRun {
 public:
  /// All must outlive it. `run` as in work::LogOptions.
  RestoreRun(const RestoreOptions& options, const RestoreTask& task, OpenTool& tool,
             const std::string& run, Context& context);
  RestoreRun(const RestoreRun&) = delete;
  RestoreRun& operator=(const RestoreRun&) = delete;

  Result<RestoreResult> run();

 private:
  Result<void> save_present();
  void write_all();
  void write(const std::vector<catalogue::PlannedWrite>& writes);
  Result<ToolSnapshot> read_again(std::string_view what);
  void plan_rest();
  work::Step write_one(const catalogue::PlannedWrite& write);
  [[nodiscard]] bool is_missing(const std::string& name) const;
  /// Of a write that did not succeed.
  void give_up(const catalogue::PlannedWrite& write);
  void verify();
  void compare_everything();
  void roll_back();
  void report_put_back(const device::PutBackReport& report);
  void check_rolled_back(device::Rollback& rollback);
  device::Rollback::Reopen reopener();
  Result<void> same_tool(const device::Device& opened) const;

  void note(const catalogue::Parameter& parameter, const catalogue::Value& before, Ending ending,
            const catalogue::Value& now);
  void fail(const Error& error);
  [[nodiscard]] std::string command_to_finish() const;
  void tell_what_stays();
  Result<RestoreResult> end();

  const RestoreOptions* options_;
  const RestoreTask* task_;
  OpenTool* tool_;
  Context* context_;
  UninterruptibleLine uninterruptible_line_;
  work::ChangeLog log_;
  work::Changer changer_;
  ProgressLine progress_;
  std::optional<Listing> listing_ = std::nullopt;
  Outcome outcome_ = {};
  std::vector<Error> errors_ = {};  ///< told last, where they are not overlooked
  std::string saved_ = {};
  RestoreCounts counts_;
  std::vector<catalogue::PlannedWrite> guarded_ = {};  ///< written before all others
  std::vector<catalogue::PlannedWrite> rest_ = {};
  std::map<const catalogue::PlannedWrite*, device::Written> refused_ = {};
};

}  // namespace spindle::commands
