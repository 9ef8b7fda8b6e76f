#pragma once

#include <string_view>

#include "spindle/work/environment.hpp"

namespace spindle::work {

/// While it lives: what is told when a second signal ends the program at once, while a tool may
/// still run.
class LastWords {
 public:
  /// `environment` must outlive it.
  LastWords(const Environment& environment, std::string_view words) : environment_(&environment) {
    set(words);
  }
  LastWords(const LastWords&) = delete;
  LastWords& operator=(const LastWords&) = delete;
  ~LastWords() { set({}); }

 private:
  void set(std::string_view words) {
    if (environment_->uninterruptible.set_last_words)
      environment_->uninterruptible.set_last_words(words);
  }

  const Environment* environment_;
};

}  // namespace spindle::work
