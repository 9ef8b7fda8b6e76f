#include "change_log.hpp"

#include <string>

namespace spindle::commands {

work::ChangeLog change_log(std::string_view command, const OpenTool& tool, const Context& context) {
  const auto& identity = tool.device.identity();
  return {{.command = std::string(command),
           .target = tool.target.shown,
           .serial = identity ? identity->serial : std::string(),
           .folder = context.state_folder},
          context.disk,
          context.clock,
          [&context](const std::string& sentence) { context.renderer.note(sentence); }};
}

}  // namespace spindle::commands
