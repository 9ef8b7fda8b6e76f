#include "change_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace spindle::commands {

CommonRun::CommonRun(std::string_view command, const std::vector<Target>& tools,
                     const Context& context) {
  if (tools.size() < 2) return;
  for (const Target& target : tools) tools_.push_back(target.shown);
  id_ = work::new_run(command, tools_.front(), context);
}

std::string CommonRun::of(const Target& target) const {
  if (id_.empty()) return {};
  const auto found = std::find(tools_.begin(), tools_.end(), target.shown);
  return fmt::format("{}-{}", id_, found - tools_.begin() + 1);
}

work::ChangeLog change_log(std::string_view command, const OpenTool& tool, const Context& context,
                           std::string run, std::map<std::string, std::string> undoes) {
  const auto warn = [&context](const std::string& sentence) { context.renderer.note(sentence); };
  return work::change_log(command, tool, context, warn, std::move(run), std::move(undoes));
}

Summary with_change(Summary summary, const std::string& id) {
  if (id.empty()) return summary;
  summary.counts.push_back({"change_id", id});
  summary.sentence += fmt::format(" (change {})", id);
  return summary;
}

Summary with_change(Summary summary, const work::ChangeLog& log) {
  return with_change(std::move(summary), log.run());
}

}  // namespace spindle::commands
