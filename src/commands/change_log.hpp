#pragma once

#include <optional>
#include <string>

#include "deeds.hpp"
#include "spindle/commands/target.hpp"
#include "spindle/files/change_log.hpp"

namespace spindle::commands {

/// What is recorded of one change; the rest is the same for a whole command.
struct LoggedChange {
  std::string name;
  std::optional<std::uint16_t> register_address = std::nullopt;
  std::optional<Decimal> old_value = std::nullopt;
  std::optional<Decimal> new_value = std::nullopt;
  std::string result = {};
};

/// A change of a parameter. The values of a secret are not recorded.
LoggedChange logged(const catalogue::Parameter& parameter, const catalogue::Value& before,
                    const catalogue::Value& after, std::string_view result);

/// The result of a change that failed: "refused" by the tool, or "unknown" where nobody can say
/// whether it was made.
std::string_view result_of_failure(const Error& error);

/// An action as it was sent, and what became of it.
LoggedChange logged(const Deed& deed, const Result<device::ActionResult>& result);

/// The record of changes of one command on one tool. One that can not be written is a single
/// warning and never an error: a tool must not be left half-way because of it.
class ChangeLog {
 public:
  /// `tool` and `context` must outlive it.
  ChangeLog(std::string_view command, const OpenTool& tool, const Context& context)
      : command_(command), tool_(&tool), context_(&context) {}

  void add(const LoggedChange& change);

 private:
  Result<void> append(const std::string& line);

  std::string command_;
  const OpenTool* tool_;
  const Context* context_;
  bool folder_made_ = false;
  bool warned_ = false;
};

}  // namespace spindle::commands
