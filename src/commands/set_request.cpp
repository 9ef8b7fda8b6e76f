#include "set_request.hpp"

#include <algorithm>
#include <utility>

#include "undo_plan.hpp"

namespace spindle::commands {

std::vector<PlacedText> SetRequest::texts_for(const Target& target) const {
  return options_->undoing ? texts_to_undo(*options_->undoing, target) : texts_;
}

Need SetRequest::need() const {
  const auto raw = std::count_if(texts_.begin(), texts_.end(),
                                 [](const PlacedText& text) { return is_raw(text.text); });
  if (options_->raw != RawWrites::ask || raw == 0) return Need::named_registers;
  return raw == std::ssize(texts_) ? Need::raw_writes : Need::mixed_writes;
}

Result<std::vector<Assignment>> SetRequest::parse(const catalogue::Profile& profile,
                                                  const Target& target, TorqueUnit torque) const {
  TRY_LET(auto assignments,
          parse_assignments(texts_for(target), profile, target, options_->raw, torque));
  if (!options_->undoing) {
    TRY(check_guarded(assignments));
  }
  return assignments;
}

std::size_t SetRequest::left_of_others(const GroupResult<SetPlan, SetResult>& all) const {
  if (!options_->undoing) return (all.tools - all.planned.size()) * texts_.size();
  std::size_t left = texts_.size();
  for (const auto& one : all.planned) left -= texts_for(one.target).size();
  return left;
}

work::ChangeLog SetRequest::log_for(const OpenTool& tool, const Context& context) const {
  const std::string run = run_.of(tool.target);
  if (!options_->undoing) return change_log("set", tool, context, run);
  return change_log("undo", tool, context, run, undone_ids(*options_->undoing, tool.target));
}

Summary SetRequest::with_change_of(Summary summary,
                                   const std::vector<Result<SetResult>>& done) const {
  const bool is_changed = std::any_of(done.begin(), done.end(),
                                      [](const auto& one) { return one && !one->change.empty(); });
  return is_changed ? with_change(std::move(summary), run_.id()) : summary;
}

}  // namespace spindle::commands
