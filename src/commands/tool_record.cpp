#include "tool_record.hpp"

#include <utility>

#include "records.hpp"

namespace spindle::commands {

report::Record tool_record(const files::Tool& tool, std::vector<std::string> groups,
                           const Clock& clock) {
  return {.type = "tool",
          .target = tool.name,
          .time = clock.wall(),
          .fields = {{"name", tool.name},
                     {"endpoint", tool.url},
                     {"profile", text_or_null(tool.profile)},
                     {"torque_unit", text_or_null(tool.torque_unit)},
                     {"groups", std::move(groups)},
                     {"verified", tool.verified},
                     {"serial", text_or_null(tool.serial)}}};
}

}  // namespace spindle::commands
