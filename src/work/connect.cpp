#include "spindle/work/connect.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "spindle/base/text.hpp"
#include "spindle/work/identification.hpp"
#include "spindle/work/simulated_tool.hpp"
#include "spindle/work/trace.hpp"

namespace spindle::work {
namespace {

/// What tools send unasked, by all profiles: a tool whose profile is not known may be any of them.
std::vector<link::SpontaneousShape> unasked_shapes(const Environment& environment) {
  std::vector<link::SpontaneousShape> shapes;
  for (const catalogue::Profile& profile : environment.profiles.load_all()) {
    if (catalogue::sends_unasked(profile)) shapes.push_back(device::shape_of(*profile.events));
  }
  return shapes;
}

/// What the command line says goes before what is said of the tool.
template <typename T>
std::optional<T> first_of(const std::optional<T>& one, const std::optional<T>& other) {
  return one ? one : other;
}

device::LinkOptions link_options(const Target& target, const catalogue::Profile& profile,
                                 const Environment& environment) {
  return {.answer_timeout = first_of(environment.common.timeout, target.endpoint.timeout),
          .connect_timeout = environment.common.connect_timeout,
          .retries = first_of(environment.common.retries, target.endpoint.retries),
          .trace = make_trace(target.shown, device::framing_of(target.endpoint, profile.link),
                              environment),
          .shown = target.shown,
          .unasked = profile.id.empty() ? unasked_shapes(environment)
                                        : std::vector<link::SpontaneousShape>(),
          .reopening = target.reopening};
}

SimulatedToolOptions simulated_options(SimulatedOperator simulated_operator) {
  SimulatedToolOptions options;
  if (simulated_operator == SimulatedOperator::working) {
    options.bm.rundown_every = std::chrono::seconds(2);
    options.bm.ng_every = 4;
  }
  return options;
}

/// A tool that could say what it is, but fits nothing that is known.
Error unknown_product(Errc code, std::string why) {
  return {.code = code,
          .message = std::move(why),
          .hint = "only raw registers such as @holding:2 can be read"};
}

/// The bytes with which a tool whose profile was not named says what it is.
Result<Bytes> ask_identity(OpenTool& tool) {
  if (tool.target.endpoint.medium != link::Medium::tcp) {
    return tl::unexpected(unproven(tool.target));
  }
  auto answer = tool.device.report_server_id();
  if (answer || answer.error().code != Errc::exception_response) return answer;
  return tl::unexpected(with_target(
      unknown_product(Errc::mismatch,
                      fmt::format("no profile can be found: {}", message_of(answer.error()))),
      tool.target));
}

/// Without ids an answer is told by its unit, and has to come because it was asked for.
Result<void> check_transactions(const Target& target, const catalogue::Profile& profile) {
  const bool ignored = target.endpoint.transactions == modbus::TransactionIds::ignored;
  const bool sends_unasked = catalogue::sends_unasked(profile);
  if (!ignored || !(sends_unasked || profile.link.any_unit)) return {};
  return tl::unexpected(with_target(
      Error{.code = Errc::usage,
            .message =
                fmt::format("transaction=ignored is not for {}: {}", with_article(profile.series),
                            sends_unasked ? "only the id tells an answer from its events"
                                          : "it answers with any unit identifier"),
            .hint = "leave it out"},
      target));
}

/// A tool whose profile was not named: ask it, and go on with what its answer fits.
Result<void> find_profile(OpenTool& tool, const Environment& environment) {
  auto answer = ask_identity(tool);
  if (!answer) return tl::unexpected(std::move(answer.error()));
  TRY_LET(auto identification, match_identity(*answer, {}, environment));
  if (identification.candidates.empty()) {
    const bool later = identification.generation == catalogue::Generation::later;
    return tl::unexpected(
        with_target(unknown_product(later ? Errc::wrong_generation : Errc::mismatch,
                                    fmt::format("no profile fits what the tool says of itself: {}",
                                                fmt::join(identification.identity.notes, "; "))),
                    tool.target));
  }
  const auto told_apart = check_transactions(tool.target, *identification.matched);
  if (!told_apart) return tl::unexpected(told_apart.error());
  // Products that their answer does not tell apart share the register map of their common base.
  tool.profile = std::make_unique<const catalogue::Profile>(std::move(*identification.matched));
  tool.device.use(*tool.profile, std::move(identification.identity));
  return {};
}

/// The port that was tried was not chosen when neither URL nor profile names one.
std::string other_port_hint(const Environment& environment) {
  for (const files::ProfileEntry& entry : environment.profiles.list()) {
    const auto profile = environment.profiles.load(entry.id);
    if (!profile || profile->link.port == catalogue::LinkSpec().port) continue;
    return fmt::format("no port is named, and {} tools listen on port {}: add :{} or --profile {}",
                       profile->series, profile->link.port, profile->link.port, profile->id);
  }
  return {};
}

bool is_wrong_port(const Error& error) {
  return error.code == Errc::connection_refused || error.code == Errc::connect_timeout;
}

}  // namespace

Result<catalogue::Profile> load_profile(const Target& target, const Environment& environment) {
  if (target.profile.empty()) return catalogue::Profile();
  auto profile = environment.profiles.load(target.profile);
  if (!profile) profile.error().asked_of = target.shown;
  return profile;
}

Target known_target(const OpenTool& tool) {
  Target known = tool.target;
  if (known.profile.empty()) known.profile = tool.profile->id;
  return known;
}

Result<void> check_addressing(const Target& target, const catalogue::Profile& profile) {
  const bool serial_line = target.endpoint.medium == link::Medium::serial ||
                           target.endpoint.medium == link::Medium::rtu_over_tcp;
  const bool serial_product = profile.link.framing == modbus::Framing::rtu;
  const std::uint8_t unit = target.endpoint.unit.value_or(modbus::UnitId{profile.link.unit}).value;
  const bool meant = serial_product || (serial_line && target.endpoint.unit);
  const bool everybody = meant && unit == 0;
  if (everybody == (target.addressing == Addressing::broadcast)) return {};
  Error error{.code = Errc::usage};
  if (everybody) {
    error.message = "unit 0 is every unit on the line, and none answers";
    error.hint = "name one unit, or add --broadcast to 'set', 'do' or 'remote-stop'";
  } else {
    error.message = "--broadcast is for everybody on a serial line, but this is one tool";
    error.hint = "give unit=0 in the URL, as in rtu:///dev/ttyUSB0?unit=0";
  }
  return tl::unexpected(with_target(std::move(error), target));
}

link::Endpoint with_port(link::Endpoint endpoint, const catalogue::Profile& profile) {
  if (endpoint.medium != link::Medium::tcp || endpoint.port) return endpoint;
  endpoint.port = profile.link.port;
  endpoint.text = link::to_url(endpoint);
  return endpoint;
}

Result<device::Device> connect_device(const Target& target, const catalogue::Profile& profile,
                                      const Environment& environment,
                                      SimulatedOperator simulated_operator,
                                      link::SessionOptions::LateAnswers late_answers) {
  TRY(check_addressing(target, profile));
  TRY(check_transactions(target, profile));
  device::LinkOptions options = link_options(target, profile, environment);
  options.late_answers = late_answers;
  auto device = device::Device::open(
      with_port(target.endpoint, profile), profile, options,
      with_simulated_tools(environment, simulated_options(simulated_operator)), environment.clock);
  const bool guessed = target.profile.empty() && !target.endpoint.port;
  if (!device && guessed && is_wrong_port(device.error())) {
    device.error().hint = other_port_hint(environment);
  }
  return device;
}

Result<OpenTool> connect(const Target& target, catalogue::Profile profile,
                         const Environment& environment) {
  auto kept = std::make_unique<const catalogue::Profile>(std::move(profile));
  TRY_LET(auto device, connect_device(target, *kept, environment));
  Target resolved = target;
  resolved.endpoint = with_port(resolved.endpoint, *kept);
  return OpenTool{std::move(resolved), std::move(kept), std::move(device)};
}

Result<OpenTool> open_tool(const Target& target, catalogue::Profile profile, Need need,
                           const Environment& environment) {
  auto tool = connect(target, std::move(profile), environment);
  if (!tool || need == Need::raw_registers) return tool;
  auto known = target.profile.empty() ? find_profile(*tool, environment)
                                      : tool->device.require_known_registers();
  if (!known) return tl::unexpected(std::move(known.error()));
  return tool;
}

}  // namespace spindle::work
