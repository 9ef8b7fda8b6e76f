#include "bystanders.hpp"

#include <algorithm>
#include <utility>

#include "progress.hpp"

namespace spindle::commands {

Result<catalogue::Snapshot> Bystanders::read() {
  ProgressLine progress(*context_);
  TRY_LET(auto taken, take_snapshot(*tool_, Secrets::include, *context_,
                                    progress.counter(tool_->target.shown + ": reading")));
  return std::move(taken.snapshot);
}

Result<void> Bystanders::read_before() {
  TRY_LET(auto before, read());
  before_ = std::move(before);
  return {};
}

Result<Bystanders::Changes> Bystanders::read_behind(
    const std::vector<catalogue::Parameter>& written) {
  Changes changes{.unit_before = tool_->target.torque_unit};
  TRY(work::read_torque_unit(*tool_));
  changes.unit_now = tool_->target.torque_unit;
  TRY_LET(const auto now, read());
  for (auto& difference : catalogue::compare(before_, now, {}).differences) {
    const bool is_written =
        std::any_of(written.begin(), written.end(), [&](const catalogue::Parameter& one) {
          return catalogue::share_registers(difference.parameter, one);
        });
    if (is_written) continue;
    if (difference.a == difference.b) {
      ++changes.torques;
    } else {
      changes.values.push_back(std::move(difference));
    }
  }
  return changes;
}

}  // namespace spindle::commands
