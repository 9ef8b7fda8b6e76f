#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "listing.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/work/action.hpp"

namespace spindle::commands {

/// What the ids of all changes of one command begin with: a part that is the same for all of its
/// tools, and behind it a number for each where there are several.
class CommonRun {
 public:
  CommonRun(std::string_view command, const std::vector<Target>& tools, const Context& context);

  /// Empty where there is one tool: it has an id of its own.
  [[nodiscard]] std::string of(const Target& target) const;
  /// What is the same for all; empty where there is one tool.
  [[nodiscard]] const std::string& id() const { return id_; }

 private:
  std::string id_ = {};
  std::vector<std::string> tools_ = {};
};

/// The record of changes of a command on this tool. `context` must outlive it. `run` and `undoes`
/// as in work::LogOptions.
work::ChangeLog change_log(std::string_view command, const OpenTool& tool, const Context& context,
                           std::string run = {}, std::map<std::string, std::string> undoes = {});

/// The summary with the id by which `undo` knows what was changed; empty: nothing was.
Summary with_change(Summary summary, const std::string& id);

/// The summary of a command that may have changed something, with the id by which `undo` knows it.
Summary with_change(Summary summary, const work::ChangeLog& log);

}  // namespace spindle::commands
