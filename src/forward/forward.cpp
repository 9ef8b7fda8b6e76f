#include "spindle/forward/forward.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <memory>
#include <utility>

#include "lease_keeper.hpp"
#include "outbox.hpp"
#include "postgres_schema.hpp"
#include "relay.hpp"
#include "settings.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/stored_rows.hpp"
#include "spindle/store/sinks.hpp"
#include "spindle/work/store_place.hpp"

namespace spindle::forward {
namespace {

using commands::Context;
using commands::ForwardOptions;
using commands::Outcome;

constexpr Duration reach_limit = std::chrono::seconds(5);
constexpr Duration look_for_store_every = std::chrono::milliseconds(500);

std::string host_name() {
  std::array<char, 256> name = {};
  if (::gethostname(name.data(), name.size() - 1) != 0 || name[0] == '\0') return "unknown";
  return name.data();
}

std::optional<std::string> credentials() {
  const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
  return folder == nullptr ? std::nullopt : std::optional<std::string>(folder);
}

/// As a tool is reached, and let go at once.
Result<void> reach(const std::string& host, std::uint16_t port, const Context& context) {
  link::Endpoint endpoint;
  endpoint.text = fmt::format("{}:{}", host, port);
  endpoint.host = host;
  endpoint.port = port;
  auto opened = context.open(endpoint, catalogue::LinkSpec(),
                             context.common.connect_timeout.value_or(reach_limit));
  if (opened) return {};
  Error error = std::move(opened.error());
  error.message = message_of(error);
  error.hint = "is this the server's address and port? what is stored stays until it has it";
  error.name = endpoint.text;
  return tl::unexpected(std::move(error));
}

Result<std::unique_ptr<Sink>> make_sink(const files::Sink& settings, const std::string& collector,
                                        Context& context) {
  TRY_LET(auto password, read_secrets(settings, credentials(), context.disk));
  SinkMeans means = {.settings = settings,
                     .collector = collector,
                     .version = std::string(context.version),
                     .password = std::move(password),
                     .clock = context.clock,
                     .interrupt = context.interrupt};
  means.note = [&context](const std::string& text) { context.renderer.note(text); };
  means.fault = [&context](const Error& error) {
    static_cast<void>(context.renderer.error(error, context.clock.wall()));
  };
  means.reach = [&context](const std::string& host, std::uint16_t port) {
    return reach(host, port, context);
  };
  TRY_LET(const auto url, files::parse_sink_url(settings.urls.front()));
  return url.kind == files::SinkKind::mqtt ? make_mqtt_sink(std::move(means))
                                           : make_postgres_sink(std::move(means));
}

/// What lies between two places of a sink and is left out.
Result<std::size_t> left_out(store::Reader& reader, const store::Positions& from,
                             const store::Positions& to) {
  TRY_LET(const auto before, reader.behind(from));
  TRY_LET(const auto behind, reader.behind(to));
  return before.events > behind.events ? before.events - behind.events : 0;
}

/// Where --from says. A sink that is new was promised nothing.
Result<void> set_place(const ForwardOptions& options, store::SinkCursor& cursor,
                       const std::string& url, store::Reader& reader, const Context& context) {
  if (options.from.empty()) return {};
  TRY_LET(const auto positions, positions_from(options.from, reader, context.clock));
  TRY_LET(const auto skipped, left_out(reader, cursor.row().positions, positions));
  const bool is_given = context.user.consent == commands::Consent::given;
  if (skipped > 0 && !cursor.is_new() && !is_given) {
    return tl::unexpected(
        Error{.code = Errc::not_confirmed,
              .message = fmt::format("the sink has not got {} before that, and would never get {}",
                                     counted(skipped, "event"), skipped == 1 ? "it" : "them"),
              .hint = "--yes leaves them out",
              .name = "--from"});
  }
  return cursor.move(positions, url, context.clock.wall());
}

Result<store::Positions> present_positions(const ForwardOptions& options,
                                           const std::string& sink_name, store::Reader& reader,
                                           const Context& context) {
  if (!options.from.empty()) return positions_from(options.from, reader, context.clock);
  TRY_LET(const auto sinks, reader.sinks());
  for (const store::SinkRow& sink : sinks) {
    if (sink.name == sink_name) return sink.positions;
  }
  return store::Positions();
}

/// Nothing is sent, and the sink's place stays.
Result<Outcome> show(const ForwardOptions& options, const files::Sink& settings,
                     const std::string& collector, commands::StoredRows& rows, Context& context) {
  TRY_LET(const auto sink, make_sink(settings, collector, context));
  TRY_LET(const auto from, present_positions(options, settings.name, rows.reader(), context));
  Outbox outbox(
      rows, collector, [&](const Parcel& parcel) { return sink->wants(parcel); }, from);
  const bool has_places = context.user.format != report::Format::json;
  constexpr std::size_t part = 100;
  TRY(outbox.fill(part));
  while (!outbox.empty() && !context.interrupt.raised()) {
    const auto parcels = outbox.front(part);
    for (const Parcel& parcel : parcels) {
      const std::string place = has_places ? sink->place_of(parcel) : std::string();
      TRY(context.io.out(fmt::format("{}{}{}\n", place, place.empty() ? "" : " ", parcel.json)));
    }
    outbox.acknowledge(parcels.size());
    TRY(outbox.fill(part));
  }
  Outcome outcome;
  if (context.interrupt.raised()) {
    outcome.fail(context.interrupt.error());
  } else {
    outcome.succeed();
  }
  return outcome;
}

Outcome done() {
  Outcome outcome;
  outcome.succeed();
  return outcome;
}

Result<Outcome> print(std::string_view text, Context& context) {
  TRY(context.io.out(text));
  return done();
}

Result<Outcome> answer_recorder(const files::Sink& settings, const std::string& collector,
                                Context& context) {
  TRY_LET(const auto password, read_secrets(settings, credentials(), context.disk));
  TRY_LET(auto addresses, postgres_addresses(settings, password));
  LeaseKeeper keeper(std::move(addresses), collector, context.clock, context.interrupt);
  TRY(keep_leases(keeper, context.interrupt, context.io.out));
  return done();
}

/// A recorder that starts later, or has just begun, makes the store: who delivers until it is
/// stopped waits for that. False: it was stopped.
bool wait_for_store(const std::string& path, const ForwardOptions& options,
                    commands::ServiceNews& news, Context& context) {
  const bool runs_on = options.delivery == commands::Delivery::service &&
                       options.execution == commands::Execution::real;
  if (!runs_on || !context.disk.absent(path)) return true;
  context.renderer.note(fmt::format("{}: there is no store yet; 'spindle record' makes it", path));
  news.ready();
  news.status("waiting for the store");
  bool was_absent = true;  // once more, as it may be in the making
  while (std::exchange(was_absent, context.disk.absent(path))) {
    news.alive();
    if (!context.clock.sleep_until(context.clock.now() + look_for_store_every)) return false;
  }
  return true;
}

}  // namespace

Result<Outcome> run(const ForwardOptions& options, Context& context) {
  if (options.print_schema) return print(postgres_schema(), context);
  TRY_LET(const auto settings, find_sink(options, context.tools));
  const std::string collector = settings.collector.empty() ? host_name() : settings.collector;
  if (options.keep_leases) return answer_recorder(settings, collector, context);
  TRY_LET(const auto path, work::store_place(options.store, context.state_folder));
  commands::ServiceNews news = commands::begin_service(context);
  if (!wait_for_store(path, options, news, context)) return done();
  TRY_LET(const auto rows, commands::StoredRows::open(path, context));
  if (options.execution == commands::Execution::dry_run) {
    return show(options, settings, collector, *rows, context);
  }
  TRY_LET(const auto sink, make_sink(settings, collector, context));
  TRY_LET(const auto cursor, store::SinkCursor::open(path, settings.name));
  TRY(set_place(options, *cursor, settings.urls.front(), rows->reader(), context));
  return Relay({.rows = *rows,
                .cursor = *cursor,
                .sink = *sink,
                .settings = settings,
                .collector = collector,
                .options = options,
                .context = context,
                .news = news,
                .take_reload = context.supervision.take_reload})
      .run();
}

}  // namespace spindle::forward
