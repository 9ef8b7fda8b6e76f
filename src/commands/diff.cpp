#include <fmt/format.h>

#include <array>
#include <optional>
#include <utility>

#include "diff_side.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/files/backup_file.hpp"
#include "spindle/work/snapshot.hpp"

namespace spindle::commands {
namespace {

using catalogue::Difference;
using catalogue::Lacking;
using catalogue::Profile;
using catalogue::Selection;
using catalogue::Snapshot;
using report::Align;
using report::Column;

const std::array<Column, 5> columns = {{{"NAME", "name"},
                                        {"REGISTER", "register", Align::right},
                                        {"A", "a", Align::right},
                                        {"B", "b", Align::right},
                                        {"UNIT", "unit"}}};

/// Patterns are checked as early as they can be: before a tool is asked where its profile is known.
Result<void> check_patterns(const DiffSide& side, const DiffOptions& options,
                            const Context& context) {
  const std::string id = profile_of(side, context);
  if (id.empty()) return {};
  const auto profile = context.profiles.load(id);
  if (!profile) return tl::unexpected(profile.error());
  return Selection::make(options.patterns, options.ignored, *profile).map([](const Selection&) {});
}

using Contents = std::pair<SideContent, SideContent>;

Result<Contents> read_sides(const DiffSide& a, const DiffSide& b, const Context& context) {
  const DiffSide& first = a.is_defaults() ? b : a;
  auto read = read_side(first, context);
  if (!read) return tl::unexpected(std::move(read.error()));
  const bool with_defaults = a.is_defaults() || b.is_defaults();
  auto other = with_defaults ? read_defaults(read->profile) : read_side(b, context);
  if (!other) return tl::unexpected(std::move(other.error()));
  if (a.is_defaults()) std::swap(*read, *other);
  return Contents(std::move(*read), std::move(*other));
}

/// The unit of both sides, or one beside the other: "N.m / kgf.cm", "N.m / ?".
std::string units_in_words(const Difference& difference) {
  const std::string& common = difference.a ? difference.unit_a : difference.unit_b;
  if (difference.units == catalogue::Units::same) return common;
  const auto shown = [](const std::string& unit) { return unit.empty() ? std::string("?") : unit; };
  return fmt::format("{} / {}", shown(difference.unit_a), shown(difference.unit_b));
}

report::Record difference_record(const Difference& difference, const std::string& target,
                                 const Clock& clock) {
  const auto side = [](std::string key, const std::optional<catalogue::Value>& value) {
    return value ? report::Field{std::move(key), value->number, value->to_string()}
                 : report::Field{std::move(key), report::Cell(), "-"};
  };
  return {.type = "diff",
          .target = target,
          .time = clock.wall(),
          .fields = {{"name", difference.parameter.name},
                     {"register", number(difference.parameter.address.value)},
                     side("a", difference.a),
                     side("b", difference.b),
                     {"unit", text_or_null(units_in_words(difference))},
                     {"unit_a", text_or_null(difference.unit_a)},
                     {"unit_b", text_or_null(difference.unit_b)}}};
}

Result<Outcome> tell(const catalogue::Comparison& comparison, const Contents& contents,
                     const std::string& target, Context& context) {
  const bool compared = comparison.same > 0 || !comparison.differences.empty() ||
                        !contents.first.unreadable.empty() || !contents.second.unreadable.empty();
  if (!compared) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "no parameter is left to compare",
                                .hint = "name more of them, or ignore fewer"});
  }
  Outcome outcome;
  Listing listing(context, columns);
  for (const Difference& difference : comparison.differences) {
    listing.add(difference_record(difference, target, context.clock));
  }
  outcome.succeed();
  if (!comparison.differences.empty()) outcome.negate();
  for (const SideContent* content : {&contents.first, &contents.second}) {
    for (const Error& error : content->unreadable) {
      outcome.fail(error);
      listing.add(error);
    }
  }
  return finish(listing, outcome,
                {.counts = {{"different", count(comparison.differences.size())},
                            {"same", count(comparison.same)}},
                 .sentence = fmt::format("{} different, {} the same", comparison.differences.size(),
                                         comparison.same),
                 .target = target},
                context);
}

}  // namespace

Result<Outcome> diff(const DiffOptions& options, Context& context) {
  if (options.a == factory_defaults && options.b == factory_defaults) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "one side must be a tool or a backup",
                                .hint = "write for example 'spindle diff station3 defaults'"});
  }
  const auto a = resolve_side(options.a, context);
  if (!a) return tl::unexpected(a.error());
  const auto b = resolve_side(options.b, context);
  if (!b) return tl::unexpected(b.error());
  for (const DiffSide* side : {&*a, &*b}) {
    if (auto checked = check_patterns(*side, options, context); !checked) {
      return tl::unexpected(std::move(checked.error()));
    }
  }
  const auto contents = read_sides(*a, *b, context);
  if (!contents) return tl::unexpected(contents.error());
  const auto selection =
      Selection::make(options.patterns, options.ignored, contents->first.profile);
  if (!selection) return tl::unexpected(selection.error());
  const bool with_defaults = a->is_defaults() || b->is_defaults();
  const auto comparison =
      catalogue::compare(contents->first.snapshot, contents->second.snapshot, *selection,
                         with_defaults ? Lacking::is_not_compared : Lacking::differs);
  const DiffSide& tool = a->target ? *a : *b;
  return tell(comparison, *contents, tool.target ? tool.text : std::string(), context);
}

}  // namespace spindle::commands
