#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// A tool as the user named it, with everything that is known before connecting.
struct Target {
  std::string shown;  ///< name or URL as given: the `target` of records
  link::Endpoint endpoint = {};
  std::string profile = {};      ///< option, tools file or sim:PROFILE; empty: not known
  std::string torque_unit = {};  ///< of the tools file; empty: unknown
  std::vector<std::string> verified = {};
  Reach reach = Reach::one;
  link::Reopening reopening = link::Reopening::never;

  /// The error as one of this tool, with its address beside its name.
  [[nodiscard]] Error blamed(Error error) const;
};

/// The error as one of this tool, with its address beside its name, unless it is one of a tool
/// already.
Error with_target(Error error, const Target& target);

/// The same target, whose connection is opened once more where the tool closes it: for commands
/// that ask for one thing and end, while the context lives.
Target reopening(Target target);

/// A target that was connected.
struct OpenTool {
  Target target;
  std::unique_ptr<const catalogue::Profile> profile;  ///< what the device refers to
  device::Device device;
};

/// Name, @group or URL to targets, each once. Errors `bad_target` and `unknown_name` with a
/// suggestion.
Result<std::vector<Target>> resolve_targets(const std::vector<std::string>& texts,
                                            const Context& context);

/// The targets that are known, and the errors of resolve_targets() for those that are not.
struct Resolution {
  std::vector<Target> targets = {};
  std::vector<Error> faults = {};
};

/// For a command that must not leave out a tool because the name of another is wrong.
Resolution resolve_each_target(const std::vector<std::string>& texts, const Context& context);

/// Why a command does not take a group, and what helps instead, before the name of the first tool.
struct OneTool {
  std::string_view why = "this command takes one";
  std::string_view instead = "name one of them, such as";
};

/// The same for a command that takes one tool; a group of several is an error.
Result<Target> resolve_target(const std::string& text, const Context& context,
                              const OneTool& words = {});

/// Names the line on which the target's unit is one of several, as only one connection at a time
/// can have it: the port behind its links, or the device server. Empty for a tool with a line of
/// its own.
std::string shared_line(const link::Endpoint& endpoint);

/// Whether a target's text names a group.
bool names_group(std::string_view text);

/// Whether a first argument is meant as a target rather than a parameter pattern.
bool is_target(std::string_view text, const Context& context);

/// What a command has to know of the registers.
enum class Need : std::uint8_t {
  named_registers,  ///< that they are those of the profile
  raw_registers,    ///< nothing
};

/// The target's profile, or an empty one where none is known before connecting.
Result<catalogue::Profile> load_profile(const Target& target, const Context& context);

/// Whether somebody works with a tool of sim:, so that there is something to watch.
enum class SimulatedOperator : std::uint8_t { absent, working };

/// Connects with a profile that outlives the device, and asks nothing. `past` says whether an
/// earlier connection to this tool had trouble.
Result<device::Device> connect_device(
    const Target& target, const catalogue::Profile& profile, const Context& context,
    SimulatedOperator simulated_operator = SimulatedOperator::absent,
    link::SessionOptions::Past past = link::SessionOptions::Past::clean);

/// The same with a profile to keep.
Result<OpenTool> connect(const Target& target, catalogue::Profile profile, const Context& context);

/// Connects. For named registers a profile that is not known is found by FC 11h, and a tool with
/// other registers than the profile's (`wrong_generation`), or one that is another product
/// (`mismatch`), is refused.
Result<OpenTool> open_tool(const Target& target, catalogue::Profile profile, Need need,
                           const Context& context);

/// Unit 0 on a serial line is everybody, and nobody answers: refuses it where one tool is meant,
/// and one tool where everybody is.
Result<void> check_reach(const Target& target, const catalogue::Profile& profile);

/// The target of a tool that was opened, with the profile that was found, to be opened again.
Target known_target(const OpenTool& tool);

/// A tool on a serial line whose profile nobody named.
Error unproven(const Target& target);

/// An open tool, and what was prepared from its profile.
template <typename Prepared>
struct Opened {
  OpenTool tool;
  Prepared prepared;
};

/// Opens a tool and calls `prepare(profile)` as early as possible: before connecting where the
/// profile is known, so that a misspelt name is told without asking anybody.
template <typename Prepare>
auto open_prepared(const Target& target, Need need, const Context& context, Prepare prepare)
    -> Result<
        Opened<typename std::invoke_result_t<Prepare, const catalogue::Profile&>::value_type>> {
  using Attempt = std::invoke_result_t<Prepare, const catalogue::Profile&>;
  auto profile = load_profile(target, context);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  const bool known = !target.profile.empty() || need == Need::raw_registers;
  std::optional<Attempt> prepared;
  if (known) prepared = prepare(*profile);
  if (prepared && !*prepared) return tl::unexpected(std::move(prepared->error()));
  auto tool = open_tool(target, std::move(*profile), need, context);
  if (!tool) return tl::unexpected(std::move(tool.error()));
  if (!prepared) prepared = prepare(*tool->profile);
  if (!*prepared) return tl::unexpected(std::move(prepared->error()));
  return Opened<typename Attempt::value_type>{std::move(*tool), std::move(**prepared)};
}

/// What the answer to FC 11h fits.
struct Identification {
  catalogue::Identity identity;
  /// `known` when a profile fits, `later` when only the firmware does not.
  catalogue::Generation generation = catalogue::Generation::unknown;
  std::string profile = {};                        ///< empty: unknown, or several fit
  std::vector<std::string> candidates = {};        ///< all that fit
  std::optional<catalogue::Profile> matched = {};  ///< the first of the candidates
  std::string maker = {};
  std::string series = {};
};

/// Matches an answer against all profiles, or against `only` when it is not empty.
Result<Identification> match_identity(ByteView answer, const std::string& only,
                                      const Context& context);

}  // namespace spindle::commands
