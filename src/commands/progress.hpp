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
      : Progress(context.io, context.clock,
                 is_free(context.user) ? context.user.progress : report::Showing::unwanted) {}

  /// For what reads one tool.
  [[nodiscard]] link::Progress counter(std::string what) {
    return [this, what = std::move(what)](std::size_t done, std::size_t total) {
      advance({.what = what, .done = done, .total = total});
    };
  }

 private:
  static bool is_free(const UserOptions& user) {
    return user.verbosity == report::Verbosity::normal && user.frames == Frames::hidden;
  }
};

}  // namespace spindle::commands
