#pragma once

#include <optional>
#include <string>
#include <vector>

#include "change_log.hpp"
#include "set_plan.hpp"
#include "set_writer.hpp"
#include "verb.hpp"

namespace spindle::commands {

/// What is asked for of each tool of one command: the same of all by `set`, of each its own by
/// `undo`.
class SetRequest {
 public:
  /// `options` must outlive it.
  SetRequest(const SetOptions& options, std::vector<PlacedText> texts,
             const std::vector<Target>& tools, const Context& context)
      : options_(&options),
        texts_(std::move(texts)),
        run_(options.undoing ? "undo" : "set", tools, context) {}

  /// Of all tools.
  [[nodiscard]] const std::vector<PlacedText>& texts() const { return texts_; }
  [[nodiscard]] std::vector<PlacedText> texts_for(const Target& target) const;
  /// What has to be known of the registers: nothing where no names are used.
  [[nodiscard]] Need need() const;

  /// As parse_assignments(). `set` writes what is guarded alone.
  [[nodiscard]] Result<std::vector<Assignment>> parse(const catalogue::Profile& profile,
                                                      const Target& target,
                                                      TorqueUnit torque) const;

  /// How many values were asked for of the tools for which nothing could be planned.
  [[nodiscard]] std::size_t left_of_others(const GroupResult<SetPlan, SetResult>& all) const;

  [[nodiscard]] work::ChangeLog log_for(const OpenTool& tool, const Context& context) const;

  /// The summary with the id of all that was changed.
  [[nodiscard]] Summary with_change_of(Summary summary,
                                       const std::vector<Result<SetResult>>& done) const;

 private:
  const SetOptions* options_;
  std::vector<PlacedText> texts_;
  CommonRun run_;
};

}  // namespace spindle::commands
