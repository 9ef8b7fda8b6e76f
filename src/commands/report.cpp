#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "listing.hpp"
#include "records.hpp"
#include "report_assessment.hpp"
#include "report_page.hpp"
#include "report_records.hpp"
#include "report_selection.hpp"
#include "report_text.hpp"
#include "spindle/base/text.hpp"
#include "spindle/work/store_place.hpp"

namespace spindle::commands {
namespace {

constexpr std::string_view standard_output = "-";

/// Limits of one joint for results of several would be one index over different things.
Result<void> check_limits(const ReportOptions& options, const work::Study& study) {
  if (options.limits.empty() && options.angle_limits.empty()) return {};
  std::set<std::pair<std::optional<std::int64_t>, std::optional<std::int64_t>>> joints;
  for (const Stratum* stratum : study.strata()) {
    joints.emplace(stratum->facts.preset, stratum->facts.target);
  }
  if (joints.size() <= 1) return {};
  Error error{.code = Errc::usage,
              .message = fmt::format(
                  "limits are those of one joint, and these results are of {} presets or targets",
                  joints.size()),
              .hint = "choose one by --preset, --tool and --since"};
  error.name = options.limits.empty() ? "--angle-limits" : "--limits";
  return tl::unexpected(std::move(error));
}

/// Before anything is read for it.
Result<void> check_file(const ReportOptions& options, const Context& context) {
  const bool is_kept = !options.file.empty() && options.file != standard_output &&
                       options.overwrite == Overwrite::refuse && context.disk.exists(options.file);
  if (!is_kept) return {};
  Error error{.code = Errc::usage,
              .message = "this file exists already",
              .hint = "choose another name, or add --force to replace it"};
  error.name = options.file;
  return tl::unexpected(std::move(error));
}

/// The zone of the user at the end of what is told.
ReportZone zone_of(const Assessed& assessed, const Clock& clock) {
  const auto period = period_of(assessed.strata);
  const WallTime at = period ? period->to : clock.wall();
  return {std::chrono::duration_cast<std::chrono::minutes>(clock.utc_offset(at))};
}

Result<void> write_page(const Assessed& assessed, const ReportZone& zone,
                        const ReportOptions& options, store::Reader& reader, Context& context) {
  TRY_LET(const auto curves, load_curves(assessed, reader));
  const std::string page = report_page(assessed, {.zone = zone,
                                                  .made = context.clock.wall(),
                                                  .version = std::string(context.version),
                                                  .options = options,
                                                  .curves = curves});
  if (options.file == standard_output) return context.io.out(page);
  return context.disk.write(options.file, page, options.overwrite, Privacy::usual);
}

/// On a terminal no line is wider than it, unless all was wanted.
std::string fitted_to_screen(const std::string& line, const Context& context) {
  const auto& columns = context.io.out_columns;
  const bool is_fitted = context.user.format == report::Format::table && columns && columns() > 0;
  return is_fitted ? report::wrapped(line, columns()) : line;
}

Result<void> tell_report(const Assessed& assessed, const ReportZone& zone,
                         const ReportOptions& options, store::Reader& reader, Context& context) {
  if (!options.file.empty()) {
    auto written = write_page(assessed, zone, options, reader, context);
    if (!written) return written;
  }
  if (report::is_table(context.user.format)) {
    if (!options.file.empty()) return {};
    for (const std::string& line : report_lines(assessed, zone)) {
      const std::string fitting = fitted_to_screen(line, context);
      for (const std::string_view part : split(fitting, '\n')) {
        TRY(context.renderer.line({}, part));
      }
    }
    return {};
  }
  const auto columns = report_columns();
  Listing listing(context, columns);
  for (const report::Record& record : report_records(assessed, zone, context.clock)) {
    listing.add(record);
  }
  return listing.end();
}

Summary summary_of(const Assessed& assessed, const ReportOptions& options) {
  std::size_t results = 0;
  for (const AssessedStratum& each : assessed.strata) results += each.stratum->results.size();
  std::uint64_t missed = 0;
  std::size_t gaps = 0;
  for (const work::StudiedTool* tool : assessed.study->tools()) {
    missed += tool->missed;
    gaps += tool->gaps.size();
  }
  std::string sentence =
      fmt::format("{} in {}, {}", counted(results, "result"),
                  assessed.strata.size() == 1 ? std::string("1 stratum")
                                              : fmt::format("{} strata", assessed.strata.size()),
                  counted(gaps, "gap"));
  if (!assessed.unmet.empty()) {
    sentence += fmt::format(", {} not met", counted(assessed.unmet.size(), "requirement"));
  }
  if (!options.file.empty() && options.file != standard_output) sentence += ": " + options.file;
  return {.counts = {{"strata", count(assessed.strata.size())},
                     {"results", count(results)},
                     {"missed", number(static_cast<std::int64_t>(missed))},
                     {"gaps", count(gaps)},
                     {"not_met", report::Texts(assessed.unmet)},
                     {"file", text_or_null(options.file)}},
          .sentence = std::move(sentence)};
}

/// Limits of joints that are not known, as their tool's entry has a fault.
void tell_faults(const Context& context) {
  for (const files::Tool& tool : context.tools.tools) {
    const auto fault = context.tools.faults.find(tool.name);
    if (fault == context.tools.faults.end()) continue;
    context.renderer.note(
        fmt::format("warning: {}: limits of joints in the tools file are not used, as its entry "
                    "has a fault: {}",
                    tool.name, fault->second.message));
  }
}

}  // namespace

Result<Outcome> report(const ReportOptions& options, Context& context) {
  const auto requirements = read_requirements(options.required);
  if (!requirements) return tl::unexpected(requirements.error());
  const auto study_options = study_options_of(options, context.tools);
  if (!study_options) return tl::unexpected(study_options.error());
  auto exclusions = exclusions_of(options);
  if (!exclusions) return tl::unexpected(std::move(exclusions.error()));
  if (auto checked = check_file(options, context); !checked) {
    return tl::unexpected(std::move(checked.error()));
  }
  auto reader =
      work::store_place(options.store, context.state_folder).and_then(&store::Reader::open);
  if (!reader) return tl::unexpected(std::move(reader.error()));
  const auto selection = select_for_report(options, **reader, context);
  if (!selection) return tl::unexpected(selection.error());
  tell_faults(context);

  work::Study study(selection->facts, *study_options, std::move(*exclusions));
  auto read = (*reader)->events(selection->filter, [&](const store::EventView& event) {
    study.add(event);
    return true;
  });
  read = std::move(read).and_then([&] { return check_limits(options, study); });
  if (!read) return tl::unexpected(std::move(read.error()));

  Assessed assessed = assess_study(study, options);
  if (assessed.strata.empty()) {
    context.renderer.note("there is no result to report");
    if (!requirements->empty()) assessed.unmet.emplace_back("there is no result to judge");
  }
  const ReportZone zone = zone_of(assessed, context.clock);
  Outcome outcome;
  outcome.succeed();
  if (!assessed.unmet.empty()) outcome.negate();
  return tell_report(assessed, zone, options, **reader, context)
      .and_then([&] { return tell(summary_of(assessed, options), outcome, context); })
      .map([&] { return outcome; });
}

}  // namespace spindle::commands
