#include <fmt/format.h>

#include <type_traits>
#include <utility>

#include "listing.hpp"
#include "records.hpp"
#include "simulate_check.hpp"
#include "simulate_place.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/simulated_tool.hpp"

namespace spindle::commands {
namespace {

/// What an option that may be given again and again says, each text read by `parse`.
template <typename Parse>
auto parse_each(const std::string& option, const std::vector<std::string>& texts, Parse parse)
    -> Result<std::vector<typename std::invoke_result_t<Parse, std::string>::value_type>> {
  std::vector<typename std::invoke_result_t<Parse, std::string>::value_type> all;
  for (const std::string& text : texts) {
    auto one = parse(text);
    if (!one) {
      one.error().name = option;
      return tl::unexpected(std::move(one.error()));
    }
    all.push_back(*one);
  }
  return all;
}

sim::ServeOptions serve_options(const link::Endpoint& place, const catalogue::Profile& profile,
                                const SimulateOptions& options, sim::FaultPlan faults) {
  sim::ServeOptions serve{.host = place.host,
                          .port = place.port.value_or(profile.link.port),
                          .framing = profile.link.framing,
                          .pty = place.device,
                          .faults = std::move(faults)};
  if (profile.link.framing == modbus::Framing::tcp) return serve;
  const modbus::SerialSettings line = simulated_line(profile.link, options.tool.baud);
  serve.baud = line.baud;
  serve.line = {.character_time = character_time(line), .gaps = options.gaps};
  return serve;
}

report::Record simulation_record(const std::string& profile, const std::string& url,
                                 const Clock& clock) {
  return {.type = "simulation",
          .target = url,
          .time = clock.wall(),
          .fields = {{"endpoint", url}, {"profile", profile}}};
}

/// The first line of output, which scripts read to know where to connect.
Result<void> announce(const std::string& profile, const std::string& url, Context& context) {
  return context.renderer.line(simulation_record(profile, url, context.clock), url);
}

/// What was heard while the tool was served.
struct Traffic {
  std::size_t connections = 0;
  std::size_t requests = 0;

  void count(sim::Heard heard) {
    if (heard == sim::Heard::connected) ++connections;
    if (heard == sim::Heard::request) ++requests;
  }
};

constexpr auto heard_words = enum_table<sim::Heard>({{"connected", sim::Heard::connected},
                                                     {"->", sim::Heard::request},
                                                     {"<-", sim::Heard::response},
                                                     {"disconnected", sim::Heard::disconnected}});

void tell(sim::Heard heard, std::uint32_t connection, ByteView bytes, const Context& context) {
  std::string line = fmt::format("{} client {} {}", report::to_text(context.clock.wall()),
                                 connection, heard_words.text(heard));
  if (!bytes.empty()) line += " " + to_hex(bytes);
  report::say_frame(context.io, line);
}

/// What was heard and will not be answered, which a real tool would keep to itself.
void tell_ignored(std::uint32_t connection, ByteView bytes, std::string_view reason,
                  const Context& context) {
  context.renderer.note(fmt::format("{} client {} ignored {}: {}",
                                    report::to_text(context.clock.wall()), connection,
                                    to_hex(bytes), reason));
}

Result<void> summarise(const Traffic& traffic, const Outcome& outcome, Context& context) {
  return context.renderer.summary(summary_record({{"connections", count(traffic.connections)},
                                                  {"requests", count(traffic.requests)}},
                                                 outcome.status(), {}, context.clock),
                                  fmt::format("{}, {}", counted(traffic.connections, "connection"),
                                              counted(traffic.requests, "request")));
}

}  // namespace

Result<Outcome> simulate(const SimulateOptions& options, Context& context) {
  TRY_LET(auto faults, parse_each("--fault", options.faults, sim::parse_fault));
  TRY_LET(auto outages, parse_each("--outage", options.outages, sim::parse_outage));
  SimulateOptions wanted = options;
  constexpr std::uint16_t highest_code = 0xFFFF;
  const auto parse_code = [](const std::string& text) {
    return sim::parse_raised(text, highest_code);
  };
  TRY_LET(auto alarms, parse_each("--alarm", options.alarms, parse_code));
  TRY_LET(auto warnings, parse_each("--warning", options.warnings, parse_code));
  wanted.tool.alarms = std::move(alarms);
  wanted.tool.warnings = std::move(warnings);
  wanted.tool.bm.faults = faults;
  TRY_LET(auto tool, make_simulated_tool(options.profile, wanted.tool, context));
  TRY_LET(auto place, place_of(options, tool.profile));
  auto idle = useless_option(wanted, tool.profile);
  if (!idle) idle = useless_trouble(faults, outages, tool.profile);
  if (idle) return tl::unexpected(std::move(*idle));
  Outcome outcome;
  outcome.succeed();
  Traffic traffic;
  sim::ServeOptions serve = serve_options(place, tool.profile, options, std::move(faults));
  serve.outages = std::move(outages);
  serve.listening = [&](std::uint16_t port) {
    place.port = port;
    return announce(tool.profile.id, url_of(place, options), context);
  };
  serve.log = [&](sim::Heard heard, std::uint32_t connection, ByteView bytes) {
    traffic.count(heard);
    if (context.user.frames == Frames::shown) tell(heard, connection, bytes, context);
  };
  serve.ignored = [&](std::uint32_t connection, ByteView bytes, std::string_view reason) {
    tell_ignored(connection, bytes, reason, context);
  };
  auto served = context.serve(*tool.server, serve);
  // Being stopped is how it ends; the status still says by what.
  if (served && context.interrupt.raised()) outcome.fail(context.interrupt.error());
  return served.and_then([&] { return summarise(traffic, outcome, context); }).map([&] {
    return outcome;
  });
}

}  // namespace spindle::commands
