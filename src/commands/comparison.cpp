#include "comparison.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <optional>
#include <tuple>
#include <utility>

#include "records.hpp"

namespace spindle::commands {
namespace {

using catalogue::Difference;
using catalogue::Lacking;
using catalogue::Profile;
using catalogue::Selection;
using report::Align;
using report::Column;

const std::array<Column, 5> columns = {
    {{"NAME", "name"},
     {"REGISTER", "register", Align::right, 0, report::left_out(1)},
     {"A", "a", Align::right},
     {"B", "b", Align::right},
     {"UNIT", "unit"}}};

Error nothing_left() {
  return {.code = Errc::usage,
          .message = "no parameter is left to compare",
          .hint = "name more of them, or ignore fewer"};
}

/// The unit of both sides, or one beside the other: "N.m / kgf.cm", "N.m / ?".
std::string units_in_words(const Difference& difference) {
  const std::string& common = difference.a ? difference.unit_a : difference.unit_b;
  if (difference.units == catalogue::Units::same) return common;
  const auto shown = [](const std::string& unit) { return unit.empty() ? std::string("?") : unit; };
  return fmt::format("{} / {}", shown(difference.unit_a), shown(difference.unit_b));
}

/// One side. Values that differ only in decimals that are not shown have them shown, or their
/// registers.
report::Field side_field(std::string key, const std::optional<catalogue::Value>& value,
                         const Difference& difference) {
  if (!value) return {std::move(key), report::Cell(), "-"};
  if (difference.parameter.secrecy == catalogue::Secrecy::secret) {
    return {std::move(key), report::Cell(), shown_of(difference.parameter, *value)};
  }
  const auto& [a, b] = std::tie(difference.a, difference.b);
  const bool looks_same =
      a && b && difference.units == catalogue::Units::same && a->to_string() == b->to_string();
  if (!looks_same) return {std::move(key), value_cell(*value), value->to_string()};
  const bool has_decimals = a->exact() != b->exact() || value->held.empty();
  if (has_decimals && value->is_number()) return {std::move(key), value->number, value->exact()};
  if (has_decimals) return {std::move(key), value_cell(*value), value->exact()};
  return {std::move(key), fmt::format("{} ({:04X})", value->exact(), fmt::join(value->held, " "))};
}

report::Record difference_record(const Difference& difference, const std::string& target,
                                 const Clock& clock) {
  const auto toned = [](report::Field field, report::Tone tone) {
    field.tone = tone;
    return field;
  };
  return {.type = "diff",
          .target = target,
          .time = clock.wall(),
          .fields = {{"name", difference.parameter.name},
                     {"register", number(difference.parameter.address.value)},
                     toned(side_field("a", difference.a, difference), report::Tone::bad),
                     toned(side_field("b", difference.b, difference), report::Tone::good),
                     {"unit", text_or_null(units_in_words(difference))},
                     {"unit_a", text_or_null(difference.unit_a)},
                     {"unit_b", text_or_null(difference.unit_b)}}};
}

const char* state_of(const DiffResult& result) {
  if (result.outcome.failed() > 0) return "failed";
  return result.different > 0 ? "different" : "same";
}

}  // namespace

Result<void> check_selection(const DiffOptions& options, const Profile& profile) {
  TRY_LET(const auto selection, Selection::make(options.patterns, options.ignored, profile));
  const auto stored = catalogue::stored_parameters(profile);
  const bool selects = std::any_of(stored.begin(), stored.end(), [&](const auto& parameter) {
    return selection.contains(parameter);
  });
  if (!selects) return tl::unexpected(nothing_left());
  return {};
}

Summary diff_summary(const DiffResult& result, const std::string& target) {
  return {.counts =
              {
                  {"different", count(result.different)},
                  {"same", count(result.same)},
              },
          .sentence = fmt::format("{} different, {} the same", result.different, result.same),
          .target = target};
}

Result<DiffResult> compare(const ReadSides& sides, const DiffOptions& options, Lacking lacking,
                           const std::string& target, Context& context,
                           const std::vector<report::Field>& more) {
  const auto& [a, b] = sides;
  TRY_LET(const auto selection, Selection::make(options.patterns, options.ignored, a.profile));
  const auto comparison = catalogue::compare(a.snapshot, b.snapshot, selection, lacking);
  DiffResult result{.different = comparison.differences.size(), .same = comparison.same};
  const bool compared =
      result.same + result.different > 0 || !a.unreadable.empty() || !b.unreadable.empty();
  if (!compared) return tl::unexpected(nothing_left());
  Listing listing(context, columns);
  for (const Difference& difference : comparison.differences) {
    listing.add(difference_record(difference, target, context.clock));
  }
  result.outcome.succeed();
  if (result.different > 0) result.outcome.negate();
  for (const SideContent* content : {&a, &b}) {
    for (const Error& error : content->unreadable) {
      result.outcome.fail(error);
      listing.add(error);
    }
  }
  Summary summary = diff_summary(result, target);
  summary.counts.push_back({"state", std::string(state_of(result))});
  summary.counts.insert(summary.counts.end(), more.begin(), more.end());
  return finish(listing, result.outcome, std::move(summary), context).map([&](const Outcome&) {
    return result;
  });
}

}  // namespace spindle::commands
