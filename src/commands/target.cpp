#include "spindle/commands/target.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "open_sim.hpp"
#include "spindle/base/text.hpp"
#include "trace.hpp"

namespace spindle::commands {
namespace {

const files::Tool* find_tool(const files::Tools& tools, std::string_view name) {
  const auto found = std::find_if(tools.tools.begin(), tools.tools.end(),
                                  [&](const files::Tool& tool) { return tool.name == name; });
  return found == tools.tools.end() ? nullptr : &*found;
}

Error unknown_target(const std::string& text, const files::Tools& tools) {
  std::vector<std::string> known;
  for (const files::Tool& tool : tools.tools) known.push_back(tool.name);
  for (const auto& [group, members] : tools.groups) known.push_back("@" + group);
  std::string hint = suggestion(text, known);
  if (hint.empty()) {
    hint = tools.path.empty()
               ? "no tools file was found, so a target is a URL: tcp://HOST or sim:doga-bm"
               : fmt::format("name a tool of {}, or a URL such as tcp://HOST", tools.path);
  }
  return {.code = Errc::unknown_name,
          .message = fmt::format("unknown target '{}'", text),
          .hint = std::move(hint)};
}

Result<Target> target_of_url(const std::string& url, const Context& context) {
  auto endpoint = link::parse_endpoint(url);
  if (!endpoint) return tl::unexpected(std::move(endpoint.error()));
  Target target{.shown = url, .endpoint = std::move(*endpoint)};
  target.profile =
      context.common.profile.empty() ? target.endpoint.profile : context.common.profile;
  return target;
}

Result<Target> target_of_tool(const files::Tool& tool, const Context& context) {
  auto target = target_of_url(tool.url, context);
  if (!target) {
    target.error().target = tool.name;
    target.error().endpoint = tool.url;
    target.error().code = Errc::bad_file;
    return target;
  }
  target->shown = tool.name;
  if (context.common.profile.empty() && !tool.profile.empty()) target->profile = tool.profile;
  target->torque_unit = tool.torque_unit;
  target->verified = tool.verified;
  return target;
}

/// The tools of this name, or that of this URL. Only a file with faults can have a name twice.
std::vector<Result<Target>> named_targets(const std::string& name, const Context& context) {
  std::vector<Result<Target>> found;
  for (const files::Tool& tool : context.tools.tools) {
    if (tool.name == name) found.push_back(target_of_tool(tool, context));
  }
  if (!found.empty()) return found;
  if (link::looks_like_url(name)) {
    found.push_back(target_of_url(name, context));
  } else {
    found.emplace_back(tl::unexpected(unknown_target(name, context.tools)));
  }
  return found;
}

void add(Result<Target> found, Resolution& resolution) {
  if (!found) {
    resolution.faults.push_back(std::move(found.error()));
    return;
  }
  const bool known =
      std::any_of(resolution.targets.begin(), resolution.targets.end(), [&](const Target& target) {
        return target.shown == found->shown && target.endpoint.text == found->endpoint.text;
      });
  if (!known) resolution.targets.push_back(std::move(*found));
}

void add_named(const std::string& name, const Context& context, Resolution& resolution) {
  for (Result<Target>& found : named_targets(name, context)) add(std::move(found), resolution);
}

/// What tools send unasked, by all profiles: a tool whose profile is not known may be any of them.
std::vector<link::SpontaneousShape> unasked_shapes(const Context& context) {
  std::vector<link::SpontaneousShape> shapes;
  for (const files::ProfileEntry& entry : context.profiles.list()) {
    const auto profile = context.profiles.load(entry.id);
    if (profile && profile->events) shapes.push_back(device::shape_of(*profile->events));
  }
  return shapes;
}

device::LinkOptions link_options(const Target& target, const catalogue::Profile& profile,
                                 const Context& context) {
  return {
      .answer_timeout = context.common.timeout,
      .connect_timeout = context.common.connect_timeout,
      .retries = context.common.retries,
      .trace = make_trace(target.shown, device::framing_of(target.endpoint, profile.link), context),
      .shown = target.shown,
      .unasked =
          profile.id.empty() ? unasked_shapes(context) : std::vector<link::SpontaneousShape>(),
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
  return tl::unexpected(tool.target.blamed(unknown_product(
      Errc::mismatch, fmt::format("no profile can be found: {}", message_of(answer.error())))));
}

/// A tool whose profile was not named: ask it, and go on with what its answer fits.
Result<void> find_profile(OpenTool& tool, const Context& context) {
  auto answer = ask_identity(tool);
  if (!answer) return tl::unexpected(std::move(answer.error()));
  auto identification = match_identity(*answer, {}, context);
  if (!identification) return tl::unexpected(std::move(identification.error()));
  if (identification->candidates.empty()) {
    const bool later = identification->generation == catalogue::Generation::later;
    return tl::unexpected(tool.target.blamed(
        unknown_product(later ? Errc::wrong_generation : Errc::mismatch,
                        fmt::format("no profile fits what the tool says of itself: {}",
                                    fmt::join(identification->identity.notes, "; ")))));
  }
  // Products that their answer does not tell apart share the register map of their common base.
  tool.profile = std::make_unique<const catalogue::Profile>(std::move(*identification->matched));
  tool.device.use(*tool.profile, std::move(identification->identity));
  return {};
}

/// The port that was tried is nobody's choice when neither URL nor profile names one.
std::string other_port_hint(const Context& context) {
  for (const files::ProfileEntry& entry : context.profiles.list()) {
    const auto profile = context.profiles.load(entry.id);
    if (!profile || profile->link.port == catalogue::LinkFacts().port) continue;
    return fmt::format("no port is named, and {} tools listen on port {}: add :{} or --profile {}",
                       profile->series, profile->link.port, profile->link.port, profile->id);
  }
  return {};
}

bool is_wrong_port(const Error& error) {
  return error.code == Errc::connection_refused || error.code == Errc::connect_timeout;
}

/// What one profile makes of an answer.
struct Match {
  catalogue::Profile profile;
  catalogue::Identity identity;
  catalogue::Generation generation;
  bool named;  ///< by the user, rather than looked for

  /// Of profiles that nobody named, one that only extends the product's own is not meant.
  [[nodiscard]] bool fits() const {
    const std::string& product = identity.product_profile;
    return catalogue::judge(profile, identity) == catalogue::Judgement::fits &&
           (named || product.empty() || product == profile.id);
  }
};

Result<std::vector<catalogue::Profile>> profiles_to_match(const std::string& only,
                                                          const Context& context) {
  if (only.empty()) return context.profiles.load_all();
  auto profile = context.profiles.load(only);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  std::vector<catalogue::Profile> profiles;
  profiles.push_back(std::move(*profile));
  return profiles;
}

Result<std::vector<Match>> matches_of(ByteView answer, const std::string& only,
                                      const Context& context) {
  auto profiles = profiles_to_match(only, context);
  if (!profiles) return tl::unexpected(std::move(profiles.error()));
  std::vector<Match> matches;
  for (catalogue::Profile& profile : *profiles) {
    if (!profile.identity) continue;
    auto identity = catalogue::decode_identity(*profile.identity, answer);
    const auto generation = catalogue::generation_of(*profile.identity, identity);
    if (generation == catalogue::Generation::unknown) continue;
    matches.push_back({std::move(profile), std::move(identity), generation, !only.empty()});
  }
  return matches;
}

Match* best_of(std::vector<Match>& matches) {
  const auto fitting =
      std::find_if(matches.begin(), matches.end(), [](const Match& match) { return match.fits(); });
  if (fitting != matches.end()) return &*fitting;
  return matches.empty() ? nullptr : &matches.front();
}

}  // namespace

Error Target::blamed(Error error) const {
  error.target = shown;
  if (endpoint.text != shown) error.endpoint = endpoint.text;
  return error;
}

Error with_target(Error error, const Target& target) {
  return error.target.empty() ? target.blamed(std::move(error)) : error;
}

Target reopening(Target target) {
  target.reopening = link::Reopening::once;
  return target;
}

std::string shared_line(const link::Endpoint& endpoint) {
  if (endpoint.medium == link::Medium::rtu_over_tcp) {
    return fmt::format("{}:{}", endpoint.host, endpoint.port.value_or(0));
  }
  if (endpoint.medium != link::Medium::serial) return {};
  std::error_code unreadable;  // then the path as it is
  const auto port = std::filesystem::weakly_canonical(endpoint.device, unreadable);
  return unreadable ? endpoint.device : port.string();
}

Error unproven(const Target& target) {
  return target.blamed(
      {.code = Errc::usage,
       .message = "a tool on a serial line can not prove what it is",
       .hint = "name the profile with --profile or in the tools file; 'spindle profile list' "
               "shows all"});
}

bool names_group(std::string_view text) { return text.starts_with('@'); }

bool is_target(std::string_view text, const Context& context) {
  if (link::looks_like_url(text) || find_tool(context.tools, text) != nullptr) return true;
  return names_group(text) && context.tools.groups.contains(std::string(text.substr(1)));
}

Resolution resolve_each_target(const std::vector<std::string>& texts, const Context& context) {
  Resolution resolution;
  for (const std::string& text : texts) {
    const auto group =
        names_group(text) ? context.tools.groups.find(text.substr(1)) : context.tools.groups.end();
    if (group == context.tools.groups.end()) {
      add_named(text, context, resolution);
      continue;
    }
    for (const std::string& name : group->second) add_named(name, context, resolution);
    if (group->second.empty()) {
      resolution.faults.push_back(
          {.code = Errc::bad_file, .message = fmt::format("'{}' names no tools", text)});
    }
  }
  return resolution;
}

Result<std::vector<Target>> resolve_targets(const std::vector<std::string>& texts,
                                            const Context& context) {
  Resolution resolution = resolve_each_target(texts, context);
  if (!resolution.faults.empty()) return tl::unexpected(std::move(resolution.faults.front()));
  return std::move(resolution.targets);
}

Result<Target> resolve_target(const std::string& text, const Context& context,
                              const OneTool& words) {
  auto targets = resolve_targets({text}, context);
  if (!targets) return tl::unexpected(std::move(targets.error()));
  if (targets->size() == 1) return std::move(targets->front());
  return tl::unexpected(
      Error{.code = Errc::usage,
            .message = fmt::format("'{}' is {} tools, and {}", text, targets->size(), words.why),
            .hint = fmt::format("{} {}", words.instead, targets->front().shown)});
}

Result<catalogue::Profile> load_profile(const Target& target, const Context& context) {
  if (target.profile.empty()) return catalogue::Profile();
  auto profile = context.profiles.load(target.profile);
  if (!profile) profile.error().asked_of = target.shown;
  return profile;
}

Target known_target(const OpenTool& tool) {
  Target known = tool.target;
  if (known.profile.empty()) known.profile = tool.profile->id;
  return known;
}

Result<void> check_reach(const Target& target, const catalogue::Profile& profile) {
  const bool serial_line = target.endpoint.medium == link::Medium::serial ||
                           target.endpoint.medium == link::Medium::rtu_over_tcp;
  const bool serial_product = profile.link.framing == modbus::Framing::rtu;
  const std::uint8_t unit = target.endpoint.unit.value_or(modbus::UnitId{profile.link.unit}).value;
  const bool meant = serial_product || (serial_line && target.endpoint.unit);
  const bool everybody = meant && unit == 0;
  if (everybody == (target.reach == Reach::everybody)) return {};
  Error error{.code = Errc::usage};
  if (everybody) {
    error.message = "unit 0 is everybody on the line, and nobody answers";
    error.hint = "name one unit, or add --broadcast to 'set', 'do' or 'remote-stop'";
  } else {
    error.message = "--broadcast is for everybody on a serial line, but this is one tool";
    error.hint = "give unit=0 in the URL, as in rtu:///dev/ttyUSB0?unit=0";
  }
  return tl::unexpected(target.blamed(std::move(error)));
}

link::Endpoint with_port(link::Endpoint endpoint, const catalogue::Profile& profile) {
  if (endpoint.medium != link::Medium::tcp || endpoint.port) return endpoint;
  endpoint.port = profile.link.port;
  endpoint.text = link::to_url(endpoint);
  return endpoint;
}

Result<device::Device> connect_device(const Target& target, const catalogue::Profile& profile,
                                      const Context& context, SimulatedOperator simulated_operator,
                                      link::SessionOptions::Past past) {
  if (auto meant = check_reach(target, profile); !meant) {
    return tl::unexpected(std::move(meant.error()));
  }
  device::LinkOptions options = link_options(target, profile, context);
  options.past = past;
  auto device = device::Device::open(
      with_port(target.endpoint, profile), profile, options,
      with_simulated_tools(context, simulated_options(simulated_operator)), context.clock);
  const bool guessed = target.profile.empty() && !target.endpoint.port;
  if (!device && guessed && is_wrong_port(device.error())) {
    device.error().hint = other_port_hint(context);
  }
  return device;
}

Result<OpenTool> connect(const Target& target, catalogue::Profile profile, const Context& context) {
  auto kept = std::make_unique<const catalogue::Profile>(std::move(profile));
  auto device = connect_device(target, *kept, context);
  if (!device) return tl::unexpected(std::move(device.error()));
  Target resolved = target;
  resolved.endpoint = with_port(resolved.endpoint, *kept);
  return OpenTool{std::move(resolved), std::move(kept), std::move(*device)};
}

Result<OpenTool> open_tool(const Target& target, catalogue::Profile profile, Need need,
                           const Context& context) {
  auto tool = connect(target, std::move(profile), context);
  if (!tool || need == Need::raw_registers) return tool;
  auto known = target.profile.empty() ? find_profile(*tool, context)
                                      : tool->device.require_known_registers();
  if (!known) return tl::unexpected(std::move(known.error()));
  return tool;
}

Result<Identification> match_identity(ByteView answer, const std::string& only,
                                      const Context& context) {
  auto matches = matches_of(answer, only, context);
  if (!matches) return tl::unexpected(std::move(matches.error()));
  Identification result;
  for (const Match& match : *matches) {
    if (!match.fits()) continue;
    result.candidates.push_back(match.profile.id);
    if (result.candidates.size() > 1) result.series += " or ";
    result.series += match.profile.series;
  }
  if (result.candidates.size() == 1) result.profile = result.candidates.front();
  Match* best = best_of(*matches);
  if (best == nullptr) {
    result.identity.raw.assign(answer.begin(), answer.end());
    result.identity.notes.emplace_back("this is not the identity of any known product");
    return result;
  }
  result.generation = best->generation;
  result.maker = best->profile.maker;
  result.identity = best->identity;
  if (result.candidates.empty()) {
    result.identity.notes.push_back(catalogue::misfit(best->profile, best->identity));
  } else {
    result.matched = std::move(best->profile);
  }
  return result;
}

}  // namespace spindle::commands
