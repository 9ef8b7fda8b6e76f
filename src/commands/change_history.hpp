#pragma once

#include <string>
#include <vector>

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// One change that a command made, or tried to make: what was recorded of it when it was begun,
/// and how it ended.
struct PastChange {
  std::string id;
  std::string time;
  std::string user;
  std::string command;
  std::string target;
  std::string serial;  ///< empty: not known
  std::string name;
  report::Cell register_address;
  report::Cell before;
  report::Cell after;
  std::string result;     ///< `begun`: the program ended before it was known
  std::string unit = {};  ///< empty: none, or not recorded
  std::string label_before = {};
  std::string label_after = {};
  std::string undoes = {};  ///< id of the change that it took back; empty: none
};

struct ChangeHistory {
  std::vector<PastChange> changes = {};  ///< in the order in which they were begun
  std::size_t unreadable = 0;            ///< lines that are no record of a change
};

/// The record of changes of this user. Where there is none, nothing was changed.
Result<ChangeHistory> read_changes(const Context& context);

}  // namespace spindle::commands
