#include "spindle/commands/commands.hpp"

namespace spindle::commands {

Result<Outcome> forward(const ForwardOptions& options, Context& context) {
  return context.companions.forward(options, context);
}

}  // namespace spindle::commands
