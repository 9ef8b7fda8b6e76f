#pragma once

#include <set>
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

/// What the ids of the changes of one command have in common.
std::string run_of(const std::string& id);

/// Whether it left a value that is no longer the one before.
bool has_changed(const PastChange& change);

/// Whether it may have. What an action found is never recorded.
bool may_have_changed(const PastChange& change);

/// A value of a tool, whichever change of the command it was.
std::string value_of(const PastChange& change);

/// The values, by value_of(), that an undo took back already. One that takes back an undo makes its
/// change again.
std::set<std::string> taken_back(const ChangeHistory& history);

}  // namespace spindle::commands
