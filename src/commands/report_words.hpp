#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "report_assessment.hpp"

/// What a report says, in words that are the same on a terminal and on a page.
namespace spindle::commands {

/// Times of a report are told in one zone.
struct ReportZone {
  std::chrono::minutes ahead = {};  ///< of UTC

  [[nodiscard]] std::string minute(WallTime time) const;  ///< "2026-11-30 14:00"
  [[nodiscard]] std::string clock(WallTime time) const;   ///< "14:00"
  /// "14:00" on the same day as the other, else with the day.
  [[nodiscard]] std::string beside(WallTime time, WallTime other) const;
  [[nodiscard]] std::string name() const;  ///< "UTC+01:00"
  [[nodiscard]] int offset_minutes() const { return static_cast<int>(ahead.count()); }
};

/// "torque", "angle a3".
std::string name_of(Quantity quantity);
/// Of the tool: "N.m", "deg"; empty: not known.
std::string unit_of(Quantity quantity, const Stratum& stratum);
/// Decimals of the tool's resolution.
int decimals_of(const Decimal& step);

/// "–" for what there is none of.
std::string shown(const std::optional<double>& value, int decimals);
std::string shown(const std::optional<Decimal>& value);

/// "2.439…2.981", "up to 7000", "from 10"; empty: none.
std::string range_of(const work::QuantityLimits& limits);
/// "tool's own, read 07:58", "given".
std::string origin_of(const work::QuantityLimits& limits, const Stratum& stratum,
                      const ReportZone& zone);

/// Whether there is something to say of it: not of the angle where a product measures none.
bool has_values(const AssessedStratum& stratum, Quantity quantity);

/// "E333 11, E335 4".
std::string codes_of(const Stratum& stratum);
/// The same of those that count so.
std::string codes_of(const Stratum& stratum, work::Completeness completeness);
/// "E333"; "no code".
std::string code_name(std::int64_t code);

/// "12", "12 or more", "an unknown number"; "0".
std::string missed_of(const work::StudiedTool& tool);

/// The same, with a word where the tool has other strata, too.
std::string missed_words(const Stratum& stratum, const work::Study& study);

/// "2.80 N.m"; "–".
std::string target_of(const Stratum& stratum);

/// "2.59…2.81"
std::string bounds_of(const statistics::Index& index);
/// Of the performance; "–" where there is none, with the reason.
std::string why_no_index(const AssessedQuantity& quantity);

/// "no", "yes", "not judged".
std::string verdict_of(const AssessedQuantity& quantity);
/// "31 signals, 8 by chance; mean higher 10:12–10:58".
std::string reasons_of(const AssessedQuantity& quantity, const Stratum& stratum,
                       const ReportZone& zone);
/// What else has to be known of an index: few values, a coarse resolution, one limit, percentiles.
std::vector<std::string> remarks_of(const AssessedQuantity& quantity, const Stratum& stratum);

/// What was left out of the statistics of a stratum and why, a line each.
std::vector<std::string> left_out_of(const Stratum& stratum, const work::StudyOptions& options);

/// From the first to the last result of several strata.
struct Period {
  WallTime from = {};
  WallTime to = {};
};
std::optional<Period> period_of(const std::vector<AssessedStratum>& strata);

/// Of the tool's own limits: the manual says so by an example only.
inline constexpr std::string_view limit_assumption =
    "Assumed: a preset's torque limit is \u00b1 % of its target torque.";

inline constexpr std::string_view no_capability_test =
    "Torque as the tool reports it; no capability test by VDI/VDE 2645.";

}  // namespace spindle::commands
