#include <fmt/format.h>

#include <filesystem>
#include <type_traits>
#include <utility>

#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/sim/simulated_tool.hpp"
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

Error misplaced(std::string message, std::string hint) {
  return {.code = Errc::usage, .message = std::move(message), .hint = std::move(hint)};
}

/// A tool that this profile describes would not notice it.
Error useless(std::string_view option, const catalogue::Profile& profile, std::string_view why) {
  return misplaced(fmt::format("{} does nothing for {}: {}", option, profile.id, why),
                   "leave it out");
}

constexpr std::string_view no_identity = "its simulation has no identity";
constexpr std::string_view no_events = "it has no operator who drives screws";
constexpr std::string_view no_alarm = "no list 'present' of its profile shows it";
constexpr std::string_view no_alarm_of_run = "its 'run' names no alarm";
constexpr std::string_view no_warnings = "its 'run' names no warning";
constexpr std::string_view no_motor = "it has no motor that a command word runs";

/// The first option that does nothing for this profile.
std::optional<Error> useless_option(const SimulateOptions& options,
                                    const catalogue::Profile& profile) {
  const sim::BmOptions& bm = options.tool.bm;
  const sim::Abilities able = sim::abilities_of(profile);
  struct Row {
    std::string_view option;
    bool given;
    bool works;
    std::string_view why;
  };
  const Row rows[] = {
      {"--identity-bytes", bm.identity_bytes.has_value(), able.identity, no_identity},
      {"--firmware", bm.firmware.has_value(), able.identity, no_identity},
      {"--serial", bm.serial.has_value(), able.identity, no_identity},
      {"--model", bm.tool_model.has_value(), able.identity, no_identity},
      {"--rundown-every", bm.rundown_every.has_value(), able.operated, no_events},
      {"--busy", options.tool.busy.has_value(), able.configuration, no_motor},
      {"--warning", !options.tool.warnings.empty(), able.warnings, no_warnings},
      {"--alarm", !options.tool.alarms.empty(), able.alarms,
       able.operated ? no_alarm : no_alarm_of_run},
      {"--no-gap", options.gaps == sim::LineModel::Gaps::ignored,
       profile.link.framing == modbus::Framing::tcp || !profile.link.serial.gaps.empty(),
       "it asks for no gaps"},
  };
  for (const Row& row : rows) {
    if (row.given && !row.works) return useless(row.option, profile, row.why);
  }
  return std::nullopt;
}

/// Why nobody would feel the fault; empty: it is felt.
std::string_view why_not_felt(sim::FaultKind kind, const catalogue::Profile& profile) {
  const bool serial = profile.link.framing == modbus::Framing::rtu;
  switch (sim::need_of(kind)) {
    case sim::FaultNeed::network:
      return serial ? "it is on a serial line" : "";
    case sim::FaultNeed::serial_line:
      return serial ? "" : "it speaks Modbus TCP";
    case sim::FaultNeed::events:
      return sim::abilities_of(profile).pushes ? "" : "it sends nothing unasked";
    case sim::FaultNeed::screwdriver:
      return sim::abilities_of(profile).operated ? "" : "it stores what is written";
    case sim::FaultNeed::nothing:
      break;
  }
  return {};
}

std::optional<Error> useless_trouble(const sim::FaultPlan& faults,
                                     const std::vector<sim::Outage>& outages,
                                     const catalogue::Profile& profile) {
  for (const sim::Fault& fault : faults) {
    const std::string_view why = why_not_felt(fault.kind, profile);
    if (!why.empty()) {
      return useless(fmt::format("--fault {}", sim::to_text(fault.kind)), profile, why);
    }
  }
  for (const sim::Outage& outage : outages) {
    if (profile.link.framing == modbus::Framing::tcp || !sim::needs_radio(outage.kind)) continue;
    return useless(fmt::format("--outage {}", sim::to_text(outage.kind)), profile,
                   "it is on a serial line, not on a radio");
  }
  return std::nullopt;
}

/// What only makes sense on a serial line, by the name of its option; empty: nothing was asked for.
std::string_view serial_option(const SimulateOptions& options) {
  if (!options.pty.empty()) return "--pty";
  if (!options.tool.units.empty()) return "--units";
  if (options.tool.baud) return "--baud";
  return options.gaps == sim::LineModel::Gaps::ignored ? "--no-gap" : "";
}

Result<link::Endpoint> listen_endpoint(const std::string& text, const catalogue::Profile& profile) {
  const bool serial = profile.link.framing == modbus::Framing::rtu;
  const std::string_view usual = serial ? "rtu+tcp://127.0.0.1:0" : "tcp://127.0.0.1:0";
  std::string url = text.empty() ? std::string(usual) : text;
  // Port 0 asks the system for a free one; as a target it would make no sense.
  const bool any_port = url.ends_with(":0");
  if (any_port) url.back() = '1';
  auto endpoint = link::parse_endpoint(url);
  if (!endpoint) return endpoint;
  const auto wanted = serial ? link::Medium::rtu_over_tcp : link::Medium::tcp;
  if (endpoint->medium != wanted) {
    return tl::unexpected(
        Error{.code = Errc::bad_target,
              .message = fmt::format("a simulated tool of this kind listens on {}",
                                     serial ? "rtu+tcp:// or a --pty" : "tcp://"),
              .hint = fmt::format("such as {}", usual),
              .target = text});
  }
  if (any_port) endpoint->port = 0;
  return endpoint;
}

/// Where the tool is served; of a pseudo terminal the path is absolute, as clients name it.
Result<link::Endpoint> place_of(const SimulateOptions& options, const catalogue::Profile& profile) {
  const std::string_view only_serial = serial_option(options);
  if (!only_serial.empty() && profile.link.framing == modbus::Framing::tcp) {
    return tl::unexpected(misplaced(
        fmt::format("{} is for serial tools, and {} speaks Modbus TCP", only_serial, profile.id),
        "leave it out"));
  }
  if (options.pty.empty()) return listen_endpoint(options.listen, profile);
  if (!options.listen.empty()) {
    return tl::unexpected(misplaced("--pty and --listen are two places", "choose one of them"));
  }
  link::Endpoint place{.medium = link::Medium::serial};
  place.device = std::filesystem::absolute(options.pty).lexically_normal().string();
  return place;
}

/// What a client gives as its target, complete with what it needs to get an answer.
std::string url_of(const link::Endpoint& place, const SimulateOptions& options) {
  if (place.medium == link::Medium::tcp) return link::to_url(place);
  std::string url = place.medium == link::Medium::serial ? fmt::format("rtu://{}", place.device)
                                                         : link::to_url(place);
  url += fmt::format("?unit={}", options.tool.units.empty() ? 1 : options.tool.units.front().value);
  if (options.tool.baud) url += fmt::format("&baud={}", *options.tool.baud);
  return url;
}

sim::ServeOptions serve_options(const link::Endpoint& place, const catalogue::Profile& profile,
                                const SimulateOptions& options, sim::FaultPlan faults) {
  sim::ServeOptions serve{.host = place.host,
                          .port = place.port.value_or(profile.link.port),
                          .framing = profile.link.framing,
                          .pty = place.device,
                          .faults = std::move(faults)};
  if (profile.link.framing == modbus::Framing::tcp) return serve;
  serve.baud = options.tool.baud.value_or(profile.link.serial.baud);
  serve.line = {.character_time = simulated_character_time(profile.link, options.tool.baud),
                .gaps = options.gaps};
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

std::string_view words_of(sim::Heard heard) {
  switch (heard) {
    case sim::Heard::connected:
      return "connected";
    case sim::Heard::request:
      return "->";
    case sim::Heard::response:
      return "<-";
    case sim::Heard::disconnected:
      return "disconnected";
  }
  return "";
}

void tell(sim::Heard heard, std::uint32_t connection, ByteView bytes, const Context& context) {
  context.io.err(fmt::format("{} client {} {} {}\n", report::to_text(context.clock.wall()),
                             connection, words_of(heard), to_hex(bytes)));
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

std::vector<std::string> simulate_options(const catalogue::Profile& profile) {
  const sim::Abilities able = sim::abilities_of(profile);
  std::vector<std::string> options;
  const auto add = [&](bool is_able, std::initializer_list<const char*> names) {
    if (is_able) options.insert(options.end(), names.begin(), names.end());
  };
  add(able.identity, {"--identity-bytes", "--firmware", "--serial", "--model"});
  add(able.operated, {"--rundown-every", "--ng-every", "--burst"});
  add(able.configuration, {"--busy"});
  add(able.alarms, {"--alarm"});
  add(able.warnings, {"--warning"});
  return options;
}

Result<Outcome> simulate(const SimulateOptions& options, Context& context) {
  auto faults = parse_each("--fault", options.faults, sim::parse_fault);
  if (!faults) return tl::unexpected(std::move(faults.error()));
  auto outages = parse_each("--outage", options.outages, sim::parse_outage);
  if (!outages) return tl::unexpected(std::move(outages.error()));
  SimulateOptions wanted = options;
  constexpr std::uint16_t highest_code = 0xFFFF;
  const auto parse_code = [](const std::string& text) {
    return sim::parse_raised(text, highest_code);
  };
  auto alarms = parse_each("--alarm", options.alarms, parse_code);
  if (!alarms) return tl::unexpected(std::move(alarms.error()));
  auto warnings = parse_each("--warning", options.warnings, parse_code);
  if (!warnings) return tl::unexpected(std::move(warnings.error()));
  wanted.tool.alarms = std::move(*alarms);
  wanted.tool.warnings = std::move(*warnings);
  wanted.tool.bm.faults = *faults;
  auto tool = make_simulated_tool(options.profile, wanted.tool, context);
  if (!tool) return tl::unexpected(std::move(tool.error()));
  auto place = place_of(options, tool->profile);
  if (!place) return tl::unexpected(std::move(place.error()));
  auto idle = useless_option(wanted, tool->profile);
  if (!idle) idle = useless_trouble(*faults, *outages, tool->profile);
  if (idle) return tl::unexpected(std::move(*idle));
  Outcome outcome;
  outcome.succeed();
  Traffic traffic;
  sim::ServeOptions serve = serve_options(*place, tool->profile, options, std::move(*faults));
  serve.outages = std::move(*outages);
  serve.listening = [&](std::uint16_t port) {
    place->port = port;
    return announce(tool->profile.id, url_of(*place, options), context);
  };
  serve.log = [&](sim::Heard heard, std::uint32_t connection, ByteView bytes) {
    traffic.count(heard);
    if (context.user.verbosity == Verbosity::frames) tell(heard, connection, bytes, context);
  };
  serve.ignored = [&](std::uint32_t connection, ByteView bytes, std::string_view reason) {
    tell_ignored(connection, bytes, reason, context);
  };
  auto served = context.serve(*tool->server, serve);
  // Being stopped is how it ends; the status still says by what.
  if (served && context.interrupt.raised()) outcome.fail(context.interrupt.error());
  return served.and_then([&] { return summarise(traffic, outcome, context); }).map([&] {
    return outcome;
  });
}

}  // namespace spindle::commands
