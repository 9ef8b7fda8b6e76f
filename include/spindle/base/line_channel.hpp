#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"

namespace spindle {

/// Lines to another program and back. One thread.
class LineChannel {
 public:
  LineChannel() = default;
  LineChannel(const LineChannel&) = delete;
  LineChannel& operator=(const LineChannel&) = delete;
  virtual ~LineChannel() = default;

  /// The line without its end. Error `closed`: the other program has ended, or takes nothing.
  virtual Result<void> send(std::string_view line) = 0;

  /// The next line without its end; empty: none came before the deadline. Errors: `closed`: the
  /// other program has ended; an interrupt.
  virtual Result<std::optional<std::string>> receive(TimePoint deadline) = 0;
};

}  // namespace spindle
