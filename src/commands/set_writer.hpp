#pragma once

#include <map>
#include <string_view>
#include <vector>

#include "bystanders.hpp"
#include "change_log.hpp"
#include "set_records.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {

/// How `set` ended on one tool.
struct SetResult {
  Outcome outcome = {};
  SetCounts counts = {};
};

/// Carries out the steps of one tool, records every change, and stops at the first that fails or
/// when a signal asks for it. What the tool refuses is tried once more behind the others.
class SetWriter {
 public:
  /// All must outlive it. `command` is who makes the changes.
  SetWriter(std::string_view command, OpenTool& tool, Storing storing, Context& context)
      : tool_(&tool),
        storing_(storing),
        context_(&context),
        listing_(context, set_columns()),
        log_(change_log(command, tool, context)),
        changer_(tool.device, log_),
        bystanders_(tool, context) {}
  SetWriter(const SetWriter&) = delete;
  SetWriter& operator=(const SetWriter&) = delete;

  /// Writes what differs, reads each back, and ends with a summary.
  Result<SetResult> write(const std::vector<SetStep>& steps);

  /// To all units on the line. None says what it holds now.
  Result<SetResult> send(const std::vector<SetStep>& steps);

 private:
  void note(const SetStep& step, Ending ending, const catalogue::Value& now);
  void succeed(const SetStep& step, Ending ending, const catalogue::Value& now);
  void fail(const Error& error);
  void send_one(const SetStep& step);
  work::Step write_one(const SetStep& step);
  /// Of a write that did not succeed.
  void give_up(const SetStep& step);
  Result<void> look_before(const std::vector<SetStep>& steps);
  void look_behind();
  Result<SetResult> end(Summary summary);

  OpenTool* tool_;
  Storing storing_;
  Context* context_;
  Listing listing_;
  work::ChangeLog log_;
  work::Changer changer_;
  std::map<const SetStep*, device::Written> refused_ = {};
  SetResult result_ = {};
  Bystanders bystanders_;
  const SetStep* guarded_ = nullptr;  ///< the one step that is written alone; null: none is
};

}  // namespace spindle::commands
