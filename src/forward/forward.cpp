#include "spindle/forward/forward.hpp"

namespace spindle::forward {

Result<commands::Outcome> run(const commands::ForwardOptions& options, commands::Context&) {
  return tl::unexpected(Error{.code = Errc::bad_target,
                              .message = "a sink of this kind is not known",
                              .name = options.sink});
}

}  // namespace spindle::forward
