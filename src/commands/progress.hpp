#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// The one line on a terminal that says how far long work has come. Says nothing elsewhere, and
/// never waits for a terminal that does not take it. Several threads may call it.
class ProgressLine {
 public:
  explicit ProgressLine(const Context& context) : io_(&context.io) {}
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(std::string_view text) {
    const std::lock_guard lock(mutex_);
    draw(text);
  }
  /// Shows "WHAT, 3 of 20" whenever it is told how far something has come; must not outlive this.
  link::Progress counting(std::string what) {
    return [this, what = std::move(what)](std::size_t done, std::size_t total) {
      show(fmt::format("{}, {} of {}", what, done, total));
    };
  }
  /// To be called before anything else is printed.
  void clear() {
    const std::lock_guard lock(mutex_);
    if (shown_) draw("");
    shown_ = false;
  }

 private:
  void draw(std::string_view text) {
    const bool ready = !io_->err_is_ready || io_->err_is_ready();
    if (!io_->err_is_terminal || !ready) return;
    io_->err(std::string("\r\x1b[K").append(text));
    shown_ = true;
  }

  const report::Streams* io_;
  std::mutex mutex_ = {};
  bool shown_ = false;
};

}  // namespace spindle::commands
