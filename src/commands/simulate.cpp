#include <fmt/format.h>

#include <type_traits>
#include <utility>

#include "listing.hpp"
#include "open_sim.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"

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

Result<link::Endpoint> listen_endpoint(const std::string& text) {
  // Port 0 asks the system for a free one; as a target it would make no sense.
  const bool any_port = text.ends_with(":0");
  auto endpoint = link::parse_endpoint(any_port ? text.substr(0, text.size() - 2) : text);
  if (!endpoint) return endpoint;
  if (endpoint->medium != link::Medium::tcp) {
    return tl::unexpected(Error{.code = Errc::bad_target,
                                .message = "a simulated tool of this kind listens on tcp://",
                                .hint = "such as tcp://127.0.0.1:0",
                                .target = text});
  }
  if (any_port) endpoint->port = 0;
  endpoint->text = text;
  return endpoint;
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

Result<void> summarise(const Traffic& traffic, const Outcome& outcome, Context& context) {
  return context.renderer.summary(
      summary_record({{"connections", number(static_cast<std::int64_t>(traffic.connections))},
                      {"requests", number(static_cast<std::int64_t>(traffic.requests))}},
                     outcome.status(), {}, context.clock),
      fmt::format("{}, {}", counted(traffic.connections, "connection"),
                  counted(traffic.requests, "request")));
}

}  // namespace

Result<Outcome> simulate(const SimulateOptions& options, Context& context) {
  auto faults = parse_each("--fault", options.faults, sim::parse_fault);
  if (!faults) return tl::unexpected(std::move(faults.error()));
  auto outages = parse_each("--outage", options.outages, sim::parse_outage);
  if (!outages) return tl::unexpected(std::move(outages.error()));
  auto listen = listen_endpoint(options.listen);
  if (!listen) return tl::unexpected(std::move(listen.error()));
  auto tool = make_simulated_tool(options.profile,
                                  {.identity_bytes = options.identity_bytes,
                                   .firmware = options.firmware,
                                   .serial = options.serial,
                                   .model = options.model,
                                   .faults = *faults,
                                   .rundown_every = options.rundown_every,
                                   .ng_every = options.ng_every.value_or(0),
                                   .burst = options.burst.value_or(1)},
                                  context);
  if (!tool) return tl::unexpected(std::move(tool.error()));
  if (!listen->port) listen->port = tool->profile.link.port;
  Outcome outcome;
  outcome.succeed();
  Traffic traffic;
  sim::ServeOptions serve{.host = listen->host,
                          .port = *listen->port,
                          .framing = tool->profile.link.framing,
                          .faults = std::move(*faults),
                          .outages = std::move(*outages)};
  serve.listening = [&](std::uint16_t port) {
    listen->port = port;
    return announce(tool->profile.id, link::to_url(*listen), context);
  };
  serve.log = [&](sim::Heard heard, std::uint32_t connection, ByteView bytes) {
    traffic.count(heard);
    if (context.common.verbosity == Verbosity::frames) tell(heard, connection, bytes, context);
  };
  auto served = context.serve(*tool->server, serve);
  // Being stopped is how it ends; the status still says by what.
  if (served && context.interrupt.raised()) outcome.fail(context.interrupt.error());
  return served.and_then([&] { return summarise(traffic, outcome, context); }).map([&] {
    return outcome;
  });
}

}  // namespace spindle::commands
