#include "spindle/work/connect.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "spindle/base/text.hpp"
#include "spindle/work/identification.hpp"
#include "spindle/work/other_port.hpp"
#include "spindle/work/simulated_tool.hpp"
#include "spindle/work/tool_memory.hpp"
#include "spindle/work/trace.hpp"

namespace spindle::work {
namespace {

/// What tools send unasked, by all profiles: a tool whose profile is not known may be any of them.
std::vector<link::SpontaneousShape> unasked_shapes(const Environment& environment) {
  std::vector<link::SpontaneousShape> shapes;
  for (const catalogue::Profile& profile : environment.profiles.load_all()) {
    if (catalogue::sends_unasked(profile)) {
      const auto of_events = device::shapes_of(*profile.events);
      shapes.insert(shapes.end(), of_events.begin(), of_events.end());
    }
    for (const catalogue::UnaskedFrame& frame : profile.link.unasked) {
      shapes.push_back(device::shape_of(frame));
    }
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

/// What the answer fits no profile.
Error no_profile(const OpenTool& tool, const Identification& identification) {
  const bool later = identification.generation == catalogue::Generation::later;
  return with_target(unknown_product(later ? Errc::wrong_generation : Errc::mismatch,
                                     fmt::format("no profile fits what the tool says of itself: {}",
                                                 fmt::join(identification.identity.notes, "; "))),
                     tool.target);
}

/// Goes on with the profile that was found.
Result<void> use_found(OpenTool& tool, Identification identification, Need need) {
  TRY(check_transactions(tool.target, *identification.matched));
  // Products that their answer does not tell apart share the register map of their common base.
  tool.profile = std::make_unique<const catalogue::Profile>(std::move(*identification.matched));
  tool.device.use(*tool.profile, std::move(identification.identity));
  return need == Need::stop ? Result<void>() : tool.device.ask_more();
}

/// A tool whose profile was not named: ask it, and go on with what its answer fits.
Result<void> find_profile(OpenTool& tool, Need need, const Environment& environment) {
  auto answer = ask_identity(tool);
  if (!answer) return tl::unexpected(std::move(answer.error()));
  TRY_LET(auto identification, match_identity(*answer, {}, environment));
  if (identification.candidates.empty()) return tl::unexpected(no_profile(tool, identification));
  return use_found(tool, std::move(identification), need);
}

/// The user may name a profile that the tool cannot prove, but not one that opens what is closed.
Result<void> check_named(const OpenTool& tool, const Identification& identification) {
  const bool is_closed = !identification.candidates.empty() &&
                         identification.matched->writes == catalogue::Writes::listed;
  if (!is_closed) return {};
  return tl::unexpected(with_target(
      Error{.code = Errc::mismatch,
            .message = fmt::format("it says that it is of profile {}, not of {}, which was named",
                                   identification.matched->id, tool.profile->id),
            .hint = "leave the profile out, or name the one that it says"},
      tool.target));
}

/// A tool that can say what it is may not take every write. What cannot is what the user says.
Result<void> recognise(OpenTool& tool, const Environment& environment) {
  const bool is_named = !tool.target.profile.empty();
  if (is_named && tool.profile->identity) return tool.device.require_known_registers();
  if (tool.target.endpoint.medium != link::Medium::tcp) return {};
  const auto answer = tool.device.report_server_id();
  constexpr std::array silent = {Errc::exception_response, Errc::no_answer, Errc::closed,
                                 Errc::reset};
  const bool says_nothing =
      !answer && std::find(silent.begin(), silent.end(), answer.error().code) != silent.end();
  if (says_nothing) return {};
  if (!answer) return tl::unexpected(answer.error());
  TRY_LET(auto identification, match_identity(*answer, {}, environment));
  if (is_named) return check_named(tool, identification);
  if (!identification.candidates.empty()) {
    return use_found(tool, std::move(identification), Need::raw_writes);
  }
  if (identification.generation != catalogue::Generation::later) return {};
  return tl::unexpected(no_profile(tool, identification));
}

bool has_secrets(const catalogue::Profile& profile) {
  return std::any_of(
      profile.parameters.begin(), profile.parameters.end(),
      [](const auto& parameter) { return parameter.secrecy == catalogue::Secrecy::secret; });
}

/// Whatever profile was named: a tool that can say what it is keeps its secrets. What cannot is
/// read as the user says.
Result<void> learn_secrets(OpenTool& tool, const Environment& environment) {
  if (tool.target.endpoint.medium != link::Medium::tcp || has_secrets(*tool.profile)) return {};
  const auto answer = tool.device.report_server_id();
  if (!answer) return {};
  TRY_LET(auto identification, match_identity(*answer, {}, environment));
  const bool is_known = !identification.candidates.empty() && has_secrets(*identification.matched);
  return is_known ? use_found(tool, std::move(identification), Need::stop) : Result<void>();
}

/// What the tool itself says of the unit of its torques is what counts.
Result<void> take_torque_unit(OpenTool& tool) {
  const std::string said = tool.target.torque_unit;
  const auto read = read_torque_unit(tool);
  if (!read && read.error().code != Errc::exception_response) return read;
  if (!read || said.empty() || said == tool.target.torque_unit) return {};
  return tl::unexpected(with_target(
      Error{.code = Errc::mismatch,
            .message = fmt::format("the tools file says that its torques are in {}, and the tool "
                                   "that they are in {}",
                                   said,
                                   tool.target.torque_unit.empty() ? "a unit that is not known"
                                                                   : tool.target.torque_unit),
            .hint = "leave 'torque-unit' out of the tools file: this tool says it itself"},
      tool.target));
}

bool is_wrong_port(const Error& error) {
  return error.code == Errc::connection_refused || error.code == Errc::connect_timeout;
}

}  // namespace

Result<catalogue::Profile> load_profile(const Target& target, const Environment& environment) {
  if (!target.fault.empty()) return tl::unexpected(fault_of(target));
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
  if (!target.fault.empty()) return tl::unexpected(fault_of(target));
  TRY(check_addressing(target, profile));
  TRY(check_transactions(target, profile));
  device::LinkOptions options = link_options(target, profile, environment);
  options.late_answers = late_answers;
  auto device = device::Device::open(
      with_port(target.endpoint, profile), profile, options,
      with_simulated_tools(environment, simulated_options(simulated_operator)), environment.clock);
  const bool guessed = target.profile.empty() && !target.endpoint.port;
  if (!device && guessed && is_wrong_port(device.error())) {
    suggest_port(target, environment, device.error());
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

namespace {

Result<OpenTool> open_as_named(const Target& target, catalogue::Profile profile, Need need,
                               const Environment& environment) {
  auto tool = connect(target, std::move(profile), environment);
  if (!tool || need == Need::raw_registers) return tool;
  if (need == Need::raw_secrets) {
    TRY(learn_secrets(*tool, environment));
    return tool;
  }
  auto known = [&] {
    const bool is_named = !target.profile.empty();
    const bool writes_raw = need == Need::raw_writes || (need == Need::mixed_writes && is_named);
    if (writes_raw) return recognise(*tool, environment);
    return target.profile.empty() ? find_profile(*tool, need, environment)
                                  : tool->device.require_known_registers();
  }();
  if (known && need != Need::stop) known = take_torque_unit(*tool);
  if (!known) return tl::unexpected(std::move(known.error()));
  return tool;
}

/// For people who ask for every decision.
void tell_memory(const Target& target, const std::string& sentence,
                 const Environment& environment) {
  if (!environment.show_frames) return;
  const link::Trace trace = environment.show_frames(target.shown);
  if (trace.decision) trace.decision(link::Decision::memory, sentence);
}

/// What was last seen behind a host whose port is not named. It only says where to ask. The serial
/// number proves the tool that was seen, not the one that is meant: so only who reads is taken
/// there, and only where there is one port to choose from.
std::optional<SeenTool> recall_place(const Target& target, Need need, Purpose purpose,
                                     const Environment& environment) {
  const bool is_proven = need == Need::named_registers && purpose == Purpose::read;
  const bool is_open = target.endpoint.medium == link::Medium::tcp && !target.endpoint.port &&
                       target.profile.empty() && target.fault.empty();
  if (!is_proven || !is_open) return std::nullopt;
  const ToolMemory memory(environment.disk, environment.cache_folder);
  const auto seen = memory.seen_behind(target.endpoint);
  auto place = memory.recall(target.endpoint);
  if (seen && place) return has_one_port(*seen) ? std::move(*place) : std::nullopt;
  const Error& why = seen ? place.error() : seen.error();
  tell_memory(target, fmt::format("nothing: {}", describe(why)), environment);
  return std::nullopt;
}

/// The tool where it was seen, if it is the same one still; empty: another one answers there.
Result<std::optional<OpenTool>> open_where_seen(const Target& target, const SeenTool& seen,
                                                Need need, const Environment& environment) {
  const ToolMemory memory(environment.disk, environment.cache_folder);
  Target there = target;
  there.endpoint.port = seen.port;
  there.endpoint.text = link::to_url(there.endpoint);
  auto tool = open_as_named(there, catalogue::Profile(), need, environment);
  if (!tool && tool.error().status() != ExitStatus::mismatch) {
    tool.error().hint =
        fmt::format("serial number {} was seen there before ({}); name a port to ask elsewhere",
                    seen.serial, memory.path());
    return tl::unexpected(with_target(std::move(tool.error()), there));
  }
  const auto serial = tool && tool->device.identity() ? tool->device.identity()->serial : "";
  if (serial == seen.serial) {
    tool->remarks.push_back(
        fmt::format("no port is named: this is port {}, where serial number {} was seen before",
                    seen.port, seen.serial));
    tell_memory(target,
                fmt::format("port {}, profile {} and serial number {}, from {}; the tool says the "
                            "same",
                            seen.port, seen.profile, seen.serial, memory.path()),
                environment);
    return std::optional(std::move(*tool));
  }
  tell_memory(target,
              fmt::format("serial number {} at port {}, from {}; another one answers, so this is "
                          "forgotten",
                          seen.serial, seen.port, memory.path()),
              environment);
  static_cast<void>(memory.forget(seen));  // it is a cache
  return std::nullopt;
}

/// The tools file may say whose an entry is. No other tool is changed in its place; a stop goes
/// before everything.
Result<void> check_serial(OpenTool& tool, Need need, Purpose purpose,
                          const Environment& environment) {
  const auto& identity = tool.device.identity();
  std::string difference = identity ? other_serial(tool.target, identity->serial) : "";
  if (difference.empty()) return {};
  if (purpose != Purpose::change || need == Need::stop) {
    tool.remarks.push_back("warning: " + difference);
    return {};
  }
  return tl::unexpected(with_target(
      Error{.code = Errc::mismatch,
            .message = std::move(difference),
            .hint = fmt::format("nothing was written; if it was exchanged, change 'serial' of {} "
                                "in {}",
                                tool.target.shown, environment.tools.path)},
      tool.target));
}

}  // namespace

void remember_tool(const OpenTool& tool, const catalogue::Identity& identity,
                   const std::string& profile, const Environment& environment) {
  const link::Endpoint& endpoint = tool.target.endpoint;
  const bool is_by_file = tool.target.profile == profile && environment.common.profile.empty();
  if (endpoint.medium != link::Medium::tcp || !endpoint.port || is_by_file) return;
  if (profile.empty() || files::names_profile_file(profile)) return;
  SeenTool seen{
      .host = endpoint.host, .port = *endpoint.port, .profile = profile, .serial = identity.serial};
  if (endpoint.unit) seen.unit = endpoint.unit->value;
  const auto kept = ToolMemory(environment.disk, environment.cache_folder).remember(seen);
  if (!kept) {
    tell_memory(tool.target, fmt::format("nothing: {}", describe(kept.error())), environment);
  }
}

std::string other_serial(const Target& target, const std::string& serial) {
  if (target.serial.empty() || serial.empty() || target.serial == serial) return {};
  return fmt::format("serial number {} answers, and the tools file says {}: it is another tool",
                     serial, target.serial);
}

Result<OpenTool> open_tool(const Target& target, catalogue::Profile profile, Need need,
                           Purpose purpose, const Environment& environment) {
  if (const auto seen = recall_place(target, need, purpose, environment)) {
    TRY_LET(auto tool, open_where_seen(target, *seen, need, environment));
    if (tool) {
      TRY(check_serial(*tool, need, purpose, environment));
      return std::move(*tool);
    }
  }
  auto tool = open_as_named(target, std::move(profile), need, environment);
  if (tool) {
    TRY(check_serial(*tool, need, purpose, environment));
  }
  if (tool && need == Need::named_registers && tool->device.identity()) {
    remember_tool(*tool, *tool->device.identity(), tool->profile->id, environment);
  }
  return tool;
}

Result<void> ask_more(OpenTool& tool, Identification& found) {
  const auto& matched = found.matched;
  const bool has_more = found.candidates.size() == 1 && matched->identity->has_more();
  if (!has_more) return {};
  tool.profile = std::make_unique<const catalogue::Profile>(*matched);
  tool.device.use(*tool.profile, found.identity);
  TRY(tool.device.ask_more());
  found.identity = *tool.device.identity();
  return {};
}

Result<void> read_torque_unit(OpenTool& tool) {
  const auto& name = tool.profile->torque_unit_from;
  if (name.empty()) return {};
  TRY_LET(const auto parameter, tool.profile->find(name));
  TRY_LET(const auto readings, tool.device.read_each({parameter}, device::Limits::skip));
  const auto& value = readings.front().value;
  if (!value) return tl::unexpected(value.error());
  tool.target.torque_unit = value->label;
  return {};
}

}  // namespace spindle::work
