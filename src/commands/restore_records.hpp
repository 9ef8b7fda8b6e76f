#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "listing.hpp"
#include "restore_plan.hpp"

namespace spindle::commands {

struct RestoreCounts {
  std::size_t planned = 0;
  std::size_t written = 0;
  std::size_t unchanged = 0;
  std::size_t skipped = 0;
  std::size_t rolled_back = 0;

  void add(const RestoreCounts& other);
};
/// Those of a plan of which nothing is written yet.
RestoreCounts counts_of(const catalogue::RestorePlan& plan);

std::span<const report::Column> restore_columns();

/// What would be written, as part of a list.
void add_plan(const RestoreTask& task, const Target& target, Listing& listing, const Clock& clock);
/// "3 to write, 717 unchanged, 1 skipped".
std::string in_words(const RestoreCounts& counts);
Summary restore_plan_summary(const RestoreCounts& counts, const std::string& target);

/// What was written; `saved` is the file with the state before it, empty where there is none.
Summary restore_summary(const RestoreCounts& counts, const std::string& saved,
                        const std::string& target);

/// Everything that is wrong with a plan.
Result<void> tell_findings(const RestoreTask& task, const Target& target, Context& context);

}  // namespace spindle::commands
