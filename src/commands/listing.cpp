#include "listing.hpp"

#include <utility>

#include "records.hpp"

namespace spindle::commands {

void Listing::add(const Error& error) {
  if (!drawn_) return;
  const Target* about = context_->about;
  drawn_ = context_->renderer.error(about != nullptr ? with_target(error, *about) : error,
                                    context_->clock.wall());
}

Result<void> tell(Summary summary, const Outcome& outcome, Context& context) {
  return context.renderer.summary(
      summary_record(std::move(summary.counts), outcome.status(), summary.target, context.clock),
      summary.sentence);
}

Result<Outcome> finish(Listing& listing, const Outcome& outcome, Summary summary,
                       Context& context) {
  return listing.end()
      .and_then([&] { return tell(std::move(summary), outcome, context); })
      .map([&] { return outcome; });
}

}  // namespace spindle::commands
