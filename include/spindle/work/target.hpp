#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/work/environment.hpp"

namespace spindle::work {

/// Whom a command means: one tool, or everybody on its serial line.
enum class Addressing : std::uint8_t { unicast, broadcast };

/// A tool as the user named it, with everything that is known before connecting.
struct Target {
  std::string shown;  ///< name or URL as given: the `target` of records
  link::Endpoint endpoint = {};
  std::string profile = {};      ///< option, tools file or sim:PROFILE; empty: not known
  std::string torque_unit = {};  ///< of the tools file; empty: unknown
  std::vector<std::string> verified = {};
  std::string serial = {};  ///< whose it is by the tools file; empty: it says nothing
  Addressing addressing = Addressing::unicast;
  link::Reopening reopening = link::Reopening::never;
  /// What is wrong with its entry of the tools file: it must not be used, see fault_of(). Empty:
  /// nothing.
  std::string fault = {};
  std::string check = {};  ///< the command that shows all faults of that file

  friend bool operator==(const Target&, const Target&) = default;
};

/// The error as one of this tool, with its address beside its name, unless it is one of a tool
/// already.
Error with_target(Error error, const Target& target);

/// Why a target cannot be used that has a fault.
Error fault_of(const Target& target);

/// The same target, whose connection is opened once more where the tool closes it: for commands
/// that ask for one thing and end, while the context lives.
Target reopening(Target target);

/// The same targets, in which every unit behind a Modbus TCP port names its gateway, also the only
/// one, as others may come to share its connection. A tool that sends unasked keeps its own; so
/// does one whose profile is not known, until it has company.
std::vector<Target> naming_gateways(std::vector<Target> targets, const Environment& environment);

/// Name, @group or URL to targets, each once. Errors `bad_target` and `unknown_name` with a
/// suggestion. A tool whose entry has a fault is one that cannot be opened, so that the others can
/// go on; where there are no others, the fault is the error.
Result<std::vector<Target>> resolve_targets(const std::vector<std::string>& texts,
                                            const Environment& environment);

/// The targets that are known, and the errors of resolve_targets() for those that are not.
struct Resolution {
  std::vector<Target> targets = {};
  std::vector<Error> faults = {};
};

/// For a command that must not leave out a tool because the name of another is wrong. No target has
/// a fault.
Resolution resolve_each_target(const std::vector<std::string>& texts,
                               const Environment& environment);

/// Why a command does not take a group, and what helps instead: a remedy, or else a beginning for
/// the name of the first tool.
struct OneTool {
  std::string_view why = "this command takes one";
  std::string_view instead = "name one of them, such as";
  std::string_view remedy = {};
};

/// The same for a command that takes one tool; a group of several is an error.
Result<Target> resolve_target(const std::string& text, const Environment& environment,
                              const OneTool& words = {});

/// Takes those out that have a fault, and returns their errors: for a command that watches them all
/// at once.
std::vector<Error> take_out_faulty(std::vector<Target>& targets);

/// Names the line on which the target's unit is one of several, as only one connection at a time
/// can have it: the port behind its links, or the device server. Empty for a tool with a line of
/// its own.
std::string shared_line(const link::Endpoint& endpoint);

/// The same for the units behind a gateway, too, which share one connection although each could
/// have its own.
std::string shared_connection(const link::Endpoint& endpoint);

/// Whether a target's text names a group.
bool names_group(std::string_view text);

/// Whether a first argument is meant as a target rather than a parameter pattern.
bool is_target(std::string_view text, const Environment& environment);

/// A tool on a serial line whose profile was not named.
Error unproven(const Target& target);

}  // namespace spindle::work
