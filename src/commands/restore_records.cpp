#include "restore_records.hpp"

#include <fmt/format.h>

#include <array>

#include "records.hpp"
#include "set_records.hpp"

namespace spindle::commands {

using catalogue::Skip;
using report::Align;
using report::Column;

void RestoreCounts::add(const RestoreCounts& other) {
  planned += other.planned;
  written += other.written;
  unchanged += other.unchanged;
  skipped += other.skipped;
  rolled_back += other.rolled_back;
}

RestoreCounts counts_of(const catalogue::RestorePlan& plan) {
  const std::size_t unchanged = plan.count(Skip::equal);
  return {.planned = plan.writes.size(),
          .unchanged = unchanged,
          .skipped = plan.skipped.size() - unchanged};
}

std::span<const Column> restore_columns() {
  static const std::array<Column, 5> columns = {{{"NAME", "name"},
                                                 {"OLD", "old", Align::right},
                                                 {"NEW", "new", Align::right},
                                                 {"UNIT", "unit"},
                                                 {"RESULT", "result"}}};
  return columns;
}

void add_plan(const RestoreTask& task, const Target& target, Listing& listing, const Clock& clock) {
  for (const catalogue::PlannedWrite& write : task.plan.writes) {
    listing.add(
        change_record(write.parameter, write.before, Ending::planned, write.after, target, clock));
  }
}

std::string in_words(const RestoreCounts& counts) {
  const std::string skipped =
      counts.skipped > 0 ? fmt::format(", {} skipped", counts.skipped) : std::string();
  return fmt::format("{} to write, {} unchanged{}", counts.planned, counts.unchanged, skipped);
}

Summary restore_plan_summary(const RestoreCounts& counts, const std::string& target) {
  return {.counts = {{"planned", count(counts.planned)},
                     {"unchanged", count(counts.unchanged)},
                     {"skipped", count(counts.skipped)}},
          .sentence = in_words(counts),
          .target = target};
}

Summary restore_summary(const RestoreCounts& counts, const std::string& saved,
                        const std::string& target) {
  return {.counts = {{"planned", count(counts.planned)},
                     {"written", count(counts.written)},
                     {"unchanged", count(counts.unchanged)},
                     {"skipped", count(counts.skipped)},
                     {"rolled_back", count(counts.rolled_back)},
                     {"saved_state", text_or_null(saved)}},
          .sentence = fmt::format("{} written, {} unchanged", counts.written, counts.unchanged),
          .target = target};
}

Result<void> tell_findings(const RestoreTask& task, const Target& target, Context& context) {
  Listing listing(context, restore_columns());
  for (const Error& finding : task.plan.findings) listing.add(with_target(finding, target));
  return listing.end();
}

}  // namespace spindle::commands
