#include "change_log.hpp"

namespace spindle::commands {

work::ChangeLog change_log(std::string_view command, const OpenTool& tool, const Context& context) {
  return work::change_log(command, tool, context, [&context](const std::string& sentence) {
    context.renderer.note(sentence);
  });
}

}  // namespace spindle::commands
