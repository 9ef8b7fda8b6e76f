#include "spindle/work/environment.hpp"

namespace spindle::work {
namespace {

Environment with(const Environment& environment, Clock& clock, const Interrupt& interrupt,
                 const device::OpenTransport& open, const files::Tools& tools) {
  return {.clock = clock,
          .interrupt = interrupt,
          .open = open,
          .uninterruptible = environment.uninterruptible,
          .disk = environment.disk,
          .state_folder = environment.state_folder,
          .version = environment.version,
          .profiles = environment.profiles,
          .tools = tools,
          .show_frames = environment.show_frames,
          .common = environment.common,
          .make_doors = environment.make_doors,
          .cache_folder = environment.cache_folder,
          .network = environment.network,
          .target_variable = environment.target_variable};
}

}  // namespace

Environment uninterruptible(const Environment& environment) {
  const Uninterruptible& calm = environment.uninterruptible;
  return with(environment, calm.clock, calm.interrupt, calm.open, environment.tools);
}

Environment with_lines(const Environment& environment, const device::OpenTransport& open) {
  return with(environment, environment.clock, environment.interrupt, open, environment.tools);
}

Environment with_tools(const Environment& environment, const files::Tools& tools) {
  return with(environment, environment.clock, environment.interrupt, environment.open, tools);
}

}  // namespace spindle::work
