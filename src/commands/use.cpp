#include <fmt/format.h>

#include <optional>
#include <utility>

#include "listing.hpp"
#include "records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/default_target.hpp"

namespace spindle::commands {
namespace {

/// A group of another tools file, or a name that is gone, is told when it is chosen.
Result<void> check(const std::string& text, const Context& context) {
  return resolve_targets({text}, context).map([](const auto&) {});
}

}  // namespace

Result<Outcome> use(const UseOptions& options, Context& context) {
  if (options.forget == Forgetting::yes) {
    TRY(work::forget_default(context));
  } else if (!options.target.empty()) {
    TRY(check(options.target, context));
    TRY(work::keep_default(options.target, context));
  }
  TRY_LET(const auto usual, work::default_target(context));
  const std::string plain = usual ? fmt::format("{}, by {}", usual->text, usual->origin)
                                  : std::string("no default target");
  Outcome outcome;
  outcome.succeed();
  return context.renderer
      .line({.type = "default",
             .target = usual ? usual->text : std::string(),
             .time = context.clock.wall(),
             .fields = {{"origin", text_or_null(usual ? usual->origin : std::string())}}},
            plain)
      .map([&] { return outcome; });
}

}  // namespace spindle::commands
