#include "report_curves.hpp"

#include <fmt/format.h>

#include <optional>
#include <utility>
#include <vector>

namespace spindle::commands {
namespace {

/// So many OK curves, and so many NG ones, of one stratum.
constexpr std::size_t most_of_each = 40;

bool is_ng(const work::StudiedResult& result) {
  return result.completeness != work::Completeness::ok;
}

/// The newest results, of each sort so many.
std::vector<const work::StudiedResult*> wanted_of(const Stratum& stratum) {
  std::vector<const work::StudiedResult*> wanted;
  std::size_t good = 0;
  std::size_t bad = 0;
  for (auto result = stratum.results.rbegin(); result != stratum.results.rend(); ++result) {
    std::size_t& sort = is_ng(*result) ? bad : good;
    if (++sort <= most_of_each) wanted.push_back(&*result);
  }
  return wanted;
}

std::string figure_of(Subject subject, const work::Study& study, const StoredCurves& curves,
                      CurveAxis axis) {
  chart::Curves figure;
  const StoredCurve* newest = nullptr;
  WallTime newest_at = {};
  for (const AssessedStratum& each : subject) {
    for (const work::StudiedResult& result : each.stratum->results) {
      const auto found = curves.find(result.id);
      if (found == curves.end()) continue;
      const report::Field* number = found->second.header.find("number");
      chart::Curve drawn = drawn_curve(
          found->second, axis, number == nullptr ? std::string() : report::to_text(number->cell),
          is_ng(result));
      if (drawn.points.empty()) continue;
      const bool is_newer = newest == nullptr || result.at >= newest_at;
      if (is_newer) {
        newest = &found->second;
        newest_at = result.at;
      }
      figure.curves.push_back(std::move(drawn));
    }
  }
  if (newest == nullptr) return {};
  const Stratum& first = *subject.front().stratum;
  std::string name = study.facts().place(first.place).name;
  if (first.facts.preset) name += fmt::format(", preset {}", *first.facts.preset);
  figure.caption = {.title = fmt::format("Torque over {}, {}",
                                         axis == CurveAxis::angle ? "angle" : "time", name)};
  figure.x = quantity_along(*newest, axis);
  figure.y = torque_of(*newest);
  figure.steps = drawn_steps(*newest, axis);
  return chart::pair(chart::curves(figure, chart::Format::wide),
                     chart::curves(figure, chart::Format::narrow));
}

}  // namespace

Result<StoredCurves> load_curves(const Assessed& assessed, store::Reader& reader) {
  StoredCurves curves;
  bool are_there = false;
  TRY(reader.curves(0, [&](const store::Curve&) {
    are_there = true;
    return false;
  }));
  if (!are_there) return curves;
  for (const AssessedStratum& each : assessed.strata) {
    for (const work::StudiedResult* result : wanted_of(*each.stratum)) {
      TRY_LET(const auto row, reader.curve(result->id));
      if (!row) continue;
      if (auto curve = stored_curve(*row)) curves.emplace(result->id, std::move(*curve));
    }
  }
  return curves;
}

std::string curve_figures(Subject subject, const work::Study& study, const StoredCurves& curves) {
  if (curves.empty()) return {};
  return figure_of(subject, study, curves, CurveAxis::angle) +
         figure_of(subject, study, curves, CurveAxis::time);
}

}  // namespace spindle::commands
