#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "spindle/work/target.hpp"

namespace spindle::work {

struct Identification;

/// A target that was connected.
struct OpenTool {
  Target target;
  std::unique_ptr<const catalogue::Profile> profile;  ///< what the device refers to
  device::Device device;
  std::vector<std::string> remarks = {};  ///< what people should know of how it was opened
};

/// What a tool is opened for. It decides how sure it has to be that it is the tool that is meant.
enum class Purpose : std::uint8_t {
  read,    ///< nothing is written: it may be where a tool was seen last
  listen,  ///< read, but a tool may have to be told to send its events
  change,  ///< it is changed, moved or stopped: it is where the user says, and no other one
};

/// What a command has to know of the registers.
enum class Need : std::uint8_t {
  named_registers,  ///< that they are those of the profile
  raw_registers,    ///< nothing
  raw_writes,       ///< nothing, unless the tool says that it is of a profile
  mixed_writes,     ///< as of named registers, and raw ones are written beside them
  raw_secrets,      ///< nothing, but a tool that says what it is keeps its secrets
  stop,             ///< the same as of named registers, and nothing else is asked before it is sent
};

/// The target's profile, or an empty one where none is known before connecting. Error `bad_file`
/// where the target has a fault.
Result<catalogue::Profile> load_profile(const Target& target, const Environment& environment);

/// Whether an operator works with a tool of sim:, so that there is something to watch.
enum class SimulatedOperator : std::uint8_t { absent, working };

/// Connects with a profile that outlives the device, and asks nothing. `late_answers` says whether
/// an earlier connection to this tool had trouble.
Result<device::Device> connect_device(
    const Target& target, const catalogue::Profile& profile, const Environment& environment,
    SimulatedOperator simulated_operator = SimulatedOperator::absent,
    link::SessionOptions::LateAnswers late_answers = link::SessionOptions::LateAnswers::none);

/// The same with a profile to keep.
Result<OpenTool> connect(const Target& target, catalogue::Profile profile,
                         const Environment& environment);

/// Connects. For named registers a profile that is not known is found by FC 11h, and a tool with
/// other registers than the profile's (`wrong_generation`), or one that is another product
/// (`mismatch`), is refused. For raw writes it is the same of a tool whose profile was named, or
/// that can say over TCP what it is; another one is left as it is. Where the profile that was named
/// cannot be proven, a tool that says that it is of another one, which allows only listed writes,
/// is refused (`mismatch`). For raw secrets a tool that says over TCP what it is goes on with the
/// profile that fits, where that has secrets. A torque unit that the profile says where to read is
/// read; error `mismatch` where the tools file says another one. A tool that is only read, and
/// whose port and profile are not named, is asked where one was seen, if that is one port, and goes
/// on there if it says the serial number that it had. Error `mismatch` where a tool is to be
/// changed that has another serial number than the tools file says; otherwise that is a remark, and
/// so it is of a stop.
Result<OpenTool> open_tool(const Target& target, catalogue::Profile profile, Need need,
                           Purpose purpose, const Environment& environment);

/// What differs where a tool says another serial number than the tools file; empty: nothing does.
std::string other_serial(const Target& target, const std::string& serial);

/// Keeps in the user's cache where a tool over TCP was that said this of itself, unless its profile
/// is from the tools file. What cannot be kept is told to those who ask for every decision only.
void remember_tool(const OpenTool& tool, const catalogue::Identity& identity,
                   const std::string& profile, const Environment& environment);

/// What was found, with what the tool says of itself in registers where the profile that fits says
/// in which; the tool goes on with that profile then.
Result<void> ask_more(OpenTool& tool, Identification& found);

/// Reads into the target in which unit the torques of this tool are, where its profile says which
/// parameter tells; empty where that has a number which is no unit. Where it cannot be read the
/// target stays as it is.
Result<void> read_torque_unit(OpenTool& tool);

/// Unit 0 on a serial line is every unit, and none answers: refuses it where one tool is meant,
/// and one tool where everybody is.
Result<void> check_addressing(const Target& target, const catalogue::Profile& profile);

/// The target of a tool that was opened, with the profile that was found, to be opened again.
Target known_target(const OpenTool& tool);

/// An open tool, and what was prepared from its profile.
template <typename Prepared>
struct Opened {
  OpenTool tool;
  Prepared prepared;
};

/// Opens a tool and calls `prepare(profile)` as early as possible: before connecting where the
/// profile is known, so that a misspelt name is told without asking a tool.
template <typename Prepare>
auto open_prepared(const Target& target, Need need, Purpose purpose, const Environment& environment,
                   Prepare prepare)
    -> Result<
        Opened<typename std::invoke_result_t<Prepare, const catalogue::Profile&>::value_type>> {
  using Attempt = std::invoke_result_t<Prepare, const catalogue::Profile&>;
  auto profile = load_profile(target, environment);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  const bool known =
      need != Need::raw_secrets && (!target.profile.empty() || need == Need::raw_registers);
  std::optional<Attempt> prepared;
  if (known) prepared = prepare(*profile);
  if (prepared && !*prepared) return tl::unexpected(std::move(prepared->error()));
  auto tool = open_tool(target, std::move(*profile), need, purpose, environment);
  if (!tool) return tl::unexpected(std::move(tool.error()));
  if (!prepared) prepared = prepare(*tool->profile);
  if (!*prepared) return tl::unexpected(std::move(prepared->error()));
  return Opened<typename Attempt::value_type>{std::move(*tool), std::move(**prepared)};
}

}  // namespace spindle::work
