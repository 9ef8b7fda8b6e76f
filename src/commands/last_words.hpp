#pragma once

#include <string_view>

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// While it lives: what is told when a second signal ends the program at once, while a tool may
/// still run.
class LastWords {
 public:
  /// `context` must outlive it.
  LastWords(const Context& context, std::string_view words) : context_(&context) { set(words); }
  LastWords(const LastWords&) = delete;
  LastWords& operator=(const LastWords&) = delete;
  ~LastWords() { set({}); }

 private:
  void set(std::string_view words) {
    if (context_->uninterruptible.set_last_words) context_->uninterruptible.set_last_words(words);
  }

  const Context* context_;
};

}  // namespace spindle::commands
