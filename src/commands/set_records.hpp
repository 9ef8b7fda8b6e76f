#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "listing.hpp"
#include "set_plan.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/work/connect.hpp"
#include "verb.hpp"

namespace spindle::commands {

/// How one assignment ended, as in the contract's record `write`.
enum class Ending : std::uint8_t {
  planned,
  written,
  unchanged,
  coerced,
  mismatch,
  refused,
  unknown,
  rolled_back,
  sent,
  changed_along  ///< it was not written: the tool changed it when another one was
};

inline constexpr auto ending_words = enum_table<Ending>({{"planned", Ending::planned},
                                                         {"written", Ending::written},
                                                         {"unchanged", Ending::unchanged},
                                                         {"coerced", Ending::coerced},
                                                         {"mismatch", Ending::mismatch},
                                                         {"refused", Ending::refused},
                                                         {"unknown", Ending::unknown},
                                                         {"rolled-back", Ending::rolled_back},
                                                         {"sent", Ending::sent},
                                                         {"changed-along", Ending::changed_along}});
Ending ending_of(device::WriteResult result);

std::span<const report::Column> set_plan_columns();
std::span<const report::Column> set_columns();

/// The `plan` or `write` record of one value, whatever the command; `now` is what the tool holds or
/// is to hold.
report::Record change_record(const catalogue::Parameter& parameter,
                             const std::optional<catalogue::Value>& before, Ending ending,
                             const catalogue::Value& now, const Target& target, const Clock& clock);
/// The same of a step.
report::Record step_record(const SetStep& step, Ending ending, const catalogue::Value& now,
                           const Target& target, const Clock& clock);

/// What would become of a step.
report::Record planned_step_record(const SetStep& step, const Target& target, const Clock& clock);

/// What was written, or would be, of one tool or of several.
struct SetCounts {
  std::size_t changed = 0;
  std::size_t unchanged = 0;
  std::size_t failed = 0;
  std::size_t left = 0;  ///< not tried

  void add(const SetCounts& other);
};

/// What would be written.
SetCounts counts_of(const std::vector<SetStep>& steps);

Summary plan_summary(const SetCounts& counts, const std::string& target);
Summary set_summary(const SetCounts& counts, const std::string& target);

/// What is planned for each tool, in one list.
Result<void> show_set_plans(const std::vector<Planned<SetPlan>>& planned, Context& context);

/// What a change may cost, before it is made.
void tell_risks(const std::vector<SetStep>& steps, const Target& target, const Context& context);

/// "write control.torque-unit, which may change what other values mean": what of these is guarded
/// and would change; empty where nothing is.
std::string guarded_in_words(const std::vector<SetStep>& steps);

/// When what was written acts, where that is not at once.
void tell_effects(const std::vector<SetStep>& steps, const Target& target, const Context& context);

/// Tells what means another quantity from now on, as the steps that it is counted in change.
void tell_other_steps(const std::vector<SetStep>& steps, const catalogue::Profile& profile,
                      const Target& target, const Context& context);

/// Tells which values are not what was typed, because that is in another unit or lies between two
/// steps.
void tell_roundings(const std::vector<SetStep>& steps, const Target& target,
                    const Context& context);

}  // namespace spindle::commands
