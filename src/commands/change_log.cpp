#include "change_log.hpp"

#include <fmt/format.h>

namespace spindle::commands {

work::ChangeLog change_log(std::string_view command, const OpenTool& tool, const Context& context) {
  return work::change_log(command, tool, context, [&context](const std::string& sentence) {
    context.renderer.note(sentence);
  });
}

Summary with_change(Summary summary, const work::ChangeLog& log) {
  if (log.run().empty()) return summary;
  summary.counts.push_back({"change_id", log.run()});
  summary.sentence += fmt::format(" (change {})", log.run());
  return summary;
}

}  // namespace spindle::commands
