#include "spindle/work/uninterruptible_line.hpp"

#include <algorithm>

namespace spindle::work {

UninterruptibleLine::UninterruptibleLine(const OpenTool& tool, const Environment& environment)
    : tool_(&tool),
      usual_(environment.common.connect_timeout.value_or(tool.profile->link.connect)),
      environment_(uninterruptible(environment)) {}

Result<device::Device> UninterruptibleLine::connect(Duration patience) {
  environment_.common.connect_timeout = std::min(usual_, patience);
  Target target = tool_->target;
  target.endpoint.claim =
      link::Claim::beside;  // what leaves a tool safe waits for no other program
  return connect_device(target, *tool_->profile, environment_);
}

}  // namespace spindle::work
