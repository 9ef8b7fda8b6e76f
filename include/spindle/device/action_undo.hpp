#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "spindle/device/rollback.hpp"

namespace spindle::device {

/// An action that was done, or tried, and what its confirming parameter showed before.
struct DoneAction {
  catalogue::Action action;  ///< with a confirming parameter that shows its value
  std::int64_t done = 0;     ///< the value that was sent
  std::int64_t before = 0;
};

/// Whether a tool shows again what it showed before an action.
struct UndoReport {
  RollbackResult result = RollbackResult::unknown;
  std::optional<std::int64_t> found = std::nullopt;  ///< before anything was put back
  std::string trouble = {};                          ///< why it is not done
};

/// Sends an action with its value of before, and waits until the tool shows it. A tool that shows
/// a third value was changed by another hand meanwhile, and is left so (`refused`). Not ended by an
/// interrupt, and reopens a lost link; gives up when the tool could not be reached for about ten
/// seconds. `calm` is a clock whose sleeps are not interrupted. The device goes on with the
/// connection that it ended with.
UndoReport undo(const DoneAction& action, Device& device, const Rollback::Reopen& reopen,
                Clock& calm);

}  // namespace spindle::device
