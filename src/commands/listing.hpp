#pragma once

#include <span>
#include <string>
#include <vector>

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// One list of records on its way to the user. Remembers the first failure of the stream (a closed
/// pipe) and draws nothing after it, so that the loops of commands stay straight.
class Listing {
 public:
  Listing(Context& context, std::span<const report::Column> columns)
      : context_(&context), drawn_(context.renderer.begin(columns)) {}

  void add(const report::Record& record) {
    if (drawn_) drawn_ = context_->renderer.record(record);
  }
  /// As one of the tool that the context is about.
  void add(const Error& error);
  /// Whether there is still a reader.
  [[nodiscard]] bool open() const { return drawn_.has_value(); }
  Result<void> end() {
    if (drawn_) drawn_ = context_->renderer.end();
    return drawn_;
  }

 private:
  Context* context_;
  Result<void> drawn_;
};

/// The outcome of a command whose list ended: the stream's failure comes first.
inline Result<Outcome> finish(Listing& listing, const Outcome& outcome) {
  return listing.end().map([&] { return outcome; });
}

/// What a command did, as its last record and as a sentence for people.
struct Summary {
  std::vector<report::Field> counts;
  std::string sentence;
  std::string target = {};  ///< empty: it is about several
};

/// Tells the summary of something that ended like this.
Result<void> tell(Summary summary, const Outcome& outcome, Context& context);

/// The same for a command that ends with a summary behind its list.
Result<Outcome> finish(Listing& listing, const Outcome& outcome, Summary summary, Context& context);

}  // namespace spindle::commands
