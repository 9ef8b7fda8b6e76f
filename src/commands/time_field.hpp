#pragma once

#include <string>
#include <utility>

#include "spindle/base/local_time.hpp"
#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// A time as programs have it; on a terminal people see it in their own zone, to the second.
inline report::Field time_field(std::string key, WallTime time, const Context& context) {
  constexpr std::size_t to_the_second = 19;  // "2026-11-30 14:00:05"
  std::string shown;
  if (context.io.out_is_terminal) {
    shown = to_local_text(time, context.clock).substr(0, to_the_second);
  }
  return {std::move(key), report::to_text(time), std::move(shown)};
}

}  // namespace spindle::commands
