#pragma once

#include <cstddef>
#include <functional>

#include "spindle/commands/context.hpp"
#include "spindle/report/progress.hpp"

namespace spindle::commands {

/// The line on a terminal, as the options of this command line want it.
class ProgressLine : public report::Progress {
 public:
  explicit ProgressLine(const Context& context)
      : Progress(context.io, context.clock, context.user.progress) {}

  /// For what reads one tool.
  [[nodiscard]] link::Progress counter(std::string what) {
    return [this, what = std::move(what)](std::size_t done, std::size_t total) {
      advance({.what = what, .done = done, .total = total});
    };
  }
};

}  // namespace spindle::commands
