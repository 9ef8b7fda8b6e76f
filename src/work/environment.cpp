#include "spindle/work/environment.hpp"

namespace spindle::work {
namespace {

Environment with(const Environment& environment, Clock& clock, const Interrupt& interrupt,
                 const device::OpenTransport& open) {
  return {.clock = clock,
          .interrupt = interrupt,
          .open = open,
          .uninterruptible = environment.uninterruptible,
          .disk = environment.disk,
          .state_folder = environment.state_folder,
          .version = environment.version,
          .profiles = environment.profiles,
          .tools = environment.tools,
          .show_frames = environment.show_frames,
          .common = environment.common};
}

}  // namespace

Environment uninterruptible(const Environment& environment) {
  const Uninterruptible& calm = environment.uninterruptible;
  return with(environment, calm.clock, calm.interrupt, calm.open);
}

Environment with_lines(const Environment& environment, const device::OpenTransport& open) {
  return with(environment, environment.clock, environment.interrupt, open);
}

}  // namespace spindle::work
