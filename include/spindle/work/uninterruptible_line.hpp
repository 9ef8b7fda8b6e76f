#pragma once

#include "spindle/work/connect.hpp"

namespace spindle::work {

/// The way back to a tool whose line broke, on a clock and lines that signals do not end: for the
/// last words that leave a tool safe.
class UninterruptibleLine {
 public:
  /// Both must outlive it, and it must outlive the devices that it opens.
  UninterruptibleLine(const OpenTool& tool, const Environment& environment);

  /// Connects within `patience`, or the usual time where that is shorter, and asks nothing.
  Result<device::Device> connect(Duration patience);

 private:
  const OpenTool* tool_;
  Duration usual_;
  Environment environment_;  ///< lines that are opened on it refer to it
};

}  // namespace spindle::work
