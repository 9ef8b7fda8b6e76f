#pragma once

#include <cstddef>
#include <vector>

#include "spindle/commands/context.hpp"
#include "spindle/work/snapshot.hpp"

namespace spindle::commands {

/// What a tool holds beside the one value that is written, where that may change what the others
/// mean: everything is read before and behind the write.
class Bystanders {
 public:
  /// Both must outlive it.
  Bystanders(OpenTool& tool, Context& context) : tool_(&tool), context_(&context) {}

  Result<void> read_before();

  /// What differs now of the values that were not written.
  struct Changes {
    std::vector<catalogue::Difference> values = {};
    std::size_t torques = 0;  ///< the same numbers, but of another unit
    std::string unit_before = {};
    std::string unit_now = {};
  };
  /// Reads everything again, and the unit of torques, which the target has from then on. Requires
  /// read_before().
  Result<Changes> read_behind(const std::vector<catalogue::Parameter>& written);

 private:
  Result<catalogue::Snapshot> read();

  OpenTool* tool_;
  Context* context_;
  catalogue::Snapshot before_ = {};
};

}  // namespace spindle::commands
