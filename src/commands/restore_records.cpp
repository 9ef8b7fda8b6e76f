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

namespace {

/// What is written behind another unit of torques is shown in that.
report::Record plan_record(const catalogue::PlannedWrite& write, Target target,
                           const Clock& clock) {
  const auto& [parameter, before, after, unit, needs] = write;
  const std::string unit_before = unit_of(parameter, target);
  const bool is_torque = parameter.unit == catalogue::torque_unit;
  if (is_torque) target.torque_unit = unit;
  report::Record record = change_record(parameter, before, Ending::planned, after, target, clock);
  if (!is_torque || unit == unit_before) return record;
  for (report::Field& field : record.fields) {
    if (field.key == "old") field.shown = fmt::format("{} {}", before.to_string(), unit_before);
  }
  record.fields.push_back({"old_unit", text_or_null(unit_before)});
  return record;
}

}  // namespace

void add_plan(const RestoreTask& task, const Target& target, Listing& listing, const Clock& clock) {
  for (const catalogue::PlannedWrite& write : task.plan.writes) {
    listing.add(plan_record(write, target, clock));
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
