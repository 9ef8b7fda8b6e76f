#include "calm_line.hpp"

#include <algorithm>

namespace spindle::commands {

CalmLine::CalmLine(const OpenTool& tool, const Context& context)
    : tool_(&tool),
      usual_(context.common.connect_timeout.value_or(tool.profile->link.connect)),
      context_(calm_context(context)) {}

Result<device::Device> CalmLine::connect(Duration patience) {
  context_.common.connect_timeout = std::min(usual_, patience);
  Target target = tool_->target;
  target.endpoint.claim =
      link::Claim::beside;  // what leaves a tool safe waits for no other program
  return connect_device(target, *tool_->profile, context_);
}

}  // namespace spindle::commands
