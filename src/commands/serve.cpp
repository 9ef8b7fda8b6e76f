#include "spindle/commands/commands.hpp"

namespace spindle::commands {

Result<Outcome> serve(const ServeOptions& options, Context& context) {
  return context.companions.page(options, context);
}

}  // namespace spindle::commands
