#pragma once

#include "spindle/commands/target.hpp"

namespace spindle::commands {

/// The way back to a tool whose line broke, on a clock and lines that signals do not end: for the
/// last words that leave a tool safe.
class CalmLine {
 public:
  /// Both must outlive it, and it must outlive the devices that it opens.
  CalmLine(const OpenTool& tool, const Context& context);

  /// Connects within `patience`, or the usual time where that is shorter, and asks nothing.
  Result<device::Device> connect(Duration patience);

 private:
  const OpenTool* tool_;
  Duration usual_;
  Context context_;  ///< lines that are opened on it refer to it
};

}  // namespace spindle::commands
