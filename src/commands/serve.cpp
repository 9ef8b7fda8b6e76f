#include "owning.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {

Result<Outcome> serve(const ServeOptions& options, Context& context) {
  if (!options.targets.empty()) return hold_tools(options, context);
  return context.companions.page(options, context);
}

}  // namespace spindle::commands
