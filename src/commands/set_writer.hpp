#pragma once

#include <map>
#include <span>
#include <string>
#include <utility>
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
  std::string change = {};  ///< id of what was changed; empty: nothing was
};

/// Carries out the steps of one tool, records every change, and stops at the first that fails or
/// when a signal asks for it. What the tool refuses is tried once more behind the others.
class SetWriter {
 public:
  /// The tool and the context must outlive it.
  SetWriter(work::ChangeLog log, OpenTool& tool, Storing storing, Context& context)
      : tool_(&tool),
        storing_(storing),
        context_(&context),
        listing_(context, set_columns()),
        log_(std::move(log)),
        changer_(tool.device, log_, tool.target),
        bystanders_(tool, context) {}
  SetWriter(const SetWriter&) = delete;
  SetWriter& operator=(const SetWriter&) = delete;

  /// Writes what differs, reads each back, and ends with a summary. What is guarded stands behind
  /// all others, and is written only where those succeeded.
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
  void write_all(std::span<const SetStep> steps);
  void look_behind(std::span<const SetStep> guarded);
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
};

}  // namespace spindle::commands
