#include <fmt/format.h>

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "consent.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "result_selection.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/store_place.hpp"
#include "time_field.hpp"

namespace spindle::commands {
namespace {

using report::Align;

const std::array<report::Column, 6> columns = {
    {{"SINK", "sink"},
     {"EVENT", "event", Align::right},
     {"WAITING", "waiting", Align::right},
     {"OLDEST", "oldest", Align::left, 0, report::wrapped(10)},
     {"MOVED", "moved", Align::left, 0, report::wrapped(10, 1)},
     {"URL", "url", Align::left, 0, report::wrapped(20, 2)}}};

report::Record sink_record(const store::SinkRow& sink, const store::Backlog& backlog,
                           const Context& context) {
  return {.type = "sink",
          .target = {},
          .time = context.clock.wall(),
          .fields = {{"sink", sink.name},
                     {"url", sink.url},
                     {"event", number(sink.positions.event)},
                     {"gap", number(sink.positions.gap)},
                     {"happening", number(sink.positions.happening)},
                     {"waiting", count(backlog.events + backlog.gaps)},
                     backlog.oldest ? time_field("oldest", *backlog.oldest, context)
                                    : report::Field{"oldest", report::Cell()},
                     time_field("moved", sink.moved, context)}};
}

}  // namespace

Result<Outcome> list_sinks(const StoreOptions& options, Context& context) {
  TRY_LET(auto reader, open_store(options.store, context));
  TRY_LET(const auto sinks, reader->sinks());
  Listing listing(context, columns);
  for (const store::SinkRow& sink : sinks) {
    TRY_LET(const auto backlog, reader->behind(sink.positions));
    listing.add(sink_record(sink, backlog, context));
  }
  Outcome outcome;
  outcome.succeed();
  return finish(listing, outcome,
                {.counts = {{"sinks", count(sinks.size())}},
                 .sentence = sinks.empty() ? "no sink was served from this store"
                                           : counted(sinks.size(), "sink")},
                context);
}

Result<Outcome> forget_sink(const ForgetOptions& options, Context& context) {
  TRY_LET(const auto path, work::store_place(options.store, context.state_folder));
  TRY_LET(auto reader, store::Reader::open(path));
  TRY_LET(const auto sinks, reader->sinks());
  std::vector<std::string> names;
  std::optional<store::Positions> positions;
  for (const store::SinkRow& sink : sinks) {
    names.push_back(sink.name);
    if (sink.name == options.sink) positions = sink.positions;
  }
  if (!positions) {
    std::string hint = suggestion(options.sink, names);
    if (hint.empty()) hint = "'spindle store sinks' shows those that there are";
    return tl::unexpected(Error{.code = Errc::unknown_name,
                                .message = fmt::format("there is no sink '{}'", options.sink),
                                .hint = std::move(hint),
                                .name = path});
  }
  TRY_LET(const auto backlog, reader->behind(*positions));
  reader.reset();
  TRY(ask_consent(fmt::format("forgetting sink '{}' lets trim remove {} that it has not got",
                              options.sink, counted(backlog.events, "event")),
                  context));
  TRY(store::forget_sink(path, options.sink));
  Outcome outcome;
  outcome.succeed();
  return tell(
             {.counts = {{"sink", options.sink}, {"waiting", count(backlog.events + backlog.gaps)}},
              .sentence = fmt::format("sink '{}' is forgotten; if it is served again it begins "
                                      "with the oldest row",
                                      options.sink)},
             outcome, context)
      .map([&] { return outcome; });
}

}  // namespace spindle::commands
