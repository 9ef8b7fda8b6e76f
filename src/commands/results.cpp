#include <fmt/format.h>

#include <utility>

#include "listing.hpp"
#include "qdas_export.hpp"
#include "result_selection.hpp"
#include "result_stream.hpp"
#include "results_curve.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "stored_records.hpp"

namespace spindle::commands {
namespace {

/// Of a store that was not asked for anything particular, a terminal shows so many.
constexpr std::size_t newest_on_terminal = 100;
constexpr Duration follow_every = std::chrono::milliseconds(200);

std::optional<std::size_t> newest_wanted(const ResultsOptions& options, const Selection& selection,
                                         store::Reader& reader, const Context& context) {
  if (options.count) return options.count;
  const bool is_screen = context.io.out_is_terminal && report::is_table(context.user.format);
  if (!is_screen || !selection.is_whole || options.told == Told::gaps) return std::nullopt;
  const auto newest = reader.newest();
  if (!newest || *newest <= static_cast<store::RowId>(newest_on_terminal)) return std::nullopt;
  context.renderer.note(fmt::format(
      "the newest {} events; --since, --count or any other filter shows more", newest_on_terminal));
  return newest_on_terminal;
}

Tools tools_of(const Selection& selection) {
  std::set<std::string> names;
  for (const store::Place* place : selection.places) names.insert(place->name);
  return selection.has_one_name || names.size() == 1 ? Tools::one : Tools::several;
}

/// Until a signal comes or the output has no reader any more.
Result<void> follow(ResultStream& stream, Listing& listing, const ResultStream::Take& take,
                    Outcome& outcome, Context& context) {
  while (listing.open()) {
    if (context.io.out_is_open && !context.io.out_is_open()) {
      return tl::unexpected(Error{.code = Errc::closed_pipe});
    }
    if (auto slept = context.clock.sleep_until(context.clock.now() + follow_every); !slept) {
      outcome.fail(slept.error());
      return {};
    }
    TRY(stream.tell_new(take));
  }
  return {};
}

Result<Outcome> list_results(const ResultsOptions& options, store::Reader& reader,
                             StoredRecords& records, const Selection& selection, Context& context) {
  ResultStream stream(reader, records, selection, options.told,
                      newest_wanted(options, selection, reader, context));
  const auto columns = context.user.format == report::Format::csv
                           ? records.all_columns(selection.places)
                           : records.table_columns(selection.places, tools_of(selection));
  Listing listing(context, columns);
  Outcome outcome;
  const auto take = [&](const report::Record& record) {
    listing.add(record);
    return listing.open() && !context.interrupt.signalled();
  };
  TRY(stream.tell_new(take));
  if (context.interrupt.signalled()) {
    outcome.fail(context.interrupt.error());
  } else if (options.following == Following::yes) {
    auto followed = follow(stream, listing, take, outcome, context);
    if (!followed) return tl::unexpected(followed.error());
  }
  return finish(listing, outcome, {.counts = stream.counts(), .sentence = stream.sentence()},
                context);
}

}  // namespace

Result<Outcome> results(const ResultsOptions& options, Context& context) {
  TRY_LET(auto reader, open_store(options.store, context));
  ProfileShelf shelf(context.profiles);
  TRY_LET(auto records, StoredRecords::make(*reader, shelf, context));
  if (!options.curve.empty()) return show_curve(options, *reader, records, context);
  TRY_LET(const auto selection, select_results(options.filter, records, context));
  if (!options.qdas.empty()) {
    return export_qdas(options, *reader, records, selection, context);
  }
  return list_results(options, *reader, records, selection, context);
}

}  // namespace spindle::commands
