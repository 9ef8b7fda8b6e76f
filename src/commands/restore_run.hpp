#pragma once

#include <optional>
#include <string>
#include <vector>

#include "change_log.hpp"
#include "listing.hpp"
#include "progress.hpp"
#include "set_records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/snapshot.hpp"
#include "spindle/work/uninterruptible_line.hpp"

namespace spindle::commands {

/// Everything about one restore that is known before the first write.
struct RestoreTask {
  catalogue::Snapshot backup = {};
  catalogue::Snapshot present = {};
  catalogue::Selection selection = {};
  catalogue::Destination destination = catalogue::Destination::other_tool;
  catalogue::RestorePlan plan = {};
};

std::span<const report::Column> restore_columns();
report::Record plan_record(const catalogue::PlannedWrite& write, const Target& target,
                           const Clock& clock);

/// Carries out a plan: writes in its order, reads each back, compares everything at the end. On
/// failure, an interrupt or a lost link it puts back what it wrote, and tells what the tool holds
/// where that fails too.
class RestoreRun {
 public:
  /// All must outlive it.
  RestoreRun(const RestoreOptions& options, const RestoreTask& task, OpenTool& tool,
             Context& context);
  RestoreRun(const RestoreRun&) = delete;
  RestoreRun& operator=(const RestoreRun&) = delete;

  Result<Outcome> run();

 private:
  Result<void> save_present();
  void write_all();
  Result<void> write_one(const catalogue::PlannedWrite& write);
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
  Result<Outcome> end();
  Result<void> summarise();

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
  std::vector<Error> errors_ = {};  ///< told last, where nobody overlooks them
  std::string saved_ = {};
  std::size_t written_ = 0;
  std::size_t rolled_back_ = 0;
};

}  // namespace spindle::commands
