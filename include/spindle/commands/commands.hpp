#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spindle/commands/context.hpp"
#include "spindle/device/watcher.hpp"

/// One options struct and one function a verb. None of them prints, exits or parses a command line.
namespace spindle::commands {

struct IdentifyOptions {
  std::vector<std::string> targets;
};
Result<Outcome> identify(const IdentifyOptions& options, Context& context);

struct ListOptions {
  std::vector<std::string> arguments;  ///< [TARGET] [PATTERN...]
};
Result<Outcome> list(const ListOptions& options, Context& context);

struct GetOptions {
  std::string target;
  std::vector<std::string> names;
  device::Limits limits = device::Limits::skip;
};
Result<Outcome> get(const GetOptions& options, Context& context);

enum class Execution : std::uint8_t { real, dry_run };

/// Whether a tool stores what was written once more, where it would forget it at power-off.
enum class Storing : std::uint8_t { no, yes };

struct SetOptions {
  std::string target;
  std::vector<std::string> assignments;  ///< NAME=VALUE
  Execution execution = Execution::real;
  Storing storing = Storing::no;
  Reach reach = Reach::one;
};
Result<Outcome> set(const SetOptions& options, Context& context);

enum class Acceptance : std::uint8_t { verified_only, unverified };

struct DoOptions {
  std::string target;
  std::vector<std::string> actions;  ///< ACTION[=VALUE]; none: list them
  Acceptance acceptance = Acceptance::verified_only;
  Reach reach = Reach::one;
};
Result<Outcome> perform(const DoOptions& options, Context& context);

struct PingOptions {
  std::string target;
  unsigned count = 4;
  Duration interval = std::chrono::seconds(1);
};
Result<Outcome> ping(const PingOptions& options, Context& context);

struct WatchOptions {
  std::vector<std::string> targets;
  std::vector<std::string> names;  ///< values to poll; none: events only
  device::EventMode events = device::EventMode::push;
  device::Samples samples = device::Samples::changes;
  device::Reconnection reconnection = device::Reconnection::forever;
  Duration interval = std::chrono::milliseconds(200);
  std::size_t count = 0;  ///< end after so many events and changes; 0: never
  std::optional<Duration> duration;
  std::optional<Duration> idle_timeout;
};
Result<Outcome> watch(const WatchOptions& options, Context& context);

struct RemoteStartOptions {
  std::string target;
  std::string preset;             ///< value of the action select-preset; empty: leave as it is
  std::string direction;          ///< value of the action direction; empty: leave as it is
  std::optional<Duration> limit;  ///< stop after this time
  Acceptance acceptance = Acceptance::verified_only;
  // Of a motor that a command word runs.
  std::string speed = {};  ///< r/min
  catalogue::Direction direction_of_motor = catalogue::Direction::forward;
  std::optional<std::uint16_t> operation = std::nullopt;  ///< operation data; empty: the profile's
  std::string acceleration = {};                          ///< seconds; empty: leave as it is
  std::string deceleration = {};                          ///< seconds; empty: leave as it is
  std::optional<Duration> watchdog = std::nullopt;        ///< the driver's own; empty: leave it
  std::optional<catalogue::StopMode> stop = std::nullopt;
};
Result<Outcome> remote_start(const RemoteStartOptions& options, Context& context);

struct RemoteStopOptions {
  std::vector<std::string> targets;
  std::optional<catalogue::StopMode> stop = std::nullopt;
  Reach reach = Reach::one;
};
Result<Outcome> remote_stop(const RemoteStopOptions& options, Context& context);

enum class AlarmReset : std::uint8_t { no, yes };

struct AlarmsOptions {
  std::string target;
  AlarmReset reset = AlarmReset::no;
  Acceptance acceptance = Acceptance::verified_only;
};
Result<Outcome> alarms(const AlarmsOptions& options, Context& context);

struct SimulateOptions {
  std::string profile;
  std::string listen = "tcp://127.0.0.1:0";
  std::vector<std::string> faults;
  std::optional<unsigned> identity_bytes;
  std::optional<std::uint16_t> firmware;
  std::optional<std::uint32_t> serial;
  std::optional<std::uint16_t> model;
  std::optional<Duration> rundown_every;  ///< an operator's; empty: nobody works with the tool
  std::optional<unsigned> ng_every;       ///< every so many of them end NG
};
Result<Outcome> simulate(const SimulateOptions& options, Context& context);

struct ProfileNameOptions {
  std::string profile;  ///< id or file
};
Result<Outcome> profile_list(Context& context);
Result<Outcome> profile_show(const ProfileNameOptions& options, Context& context);
Result<Outcome> profile_check(const ProfileNameOptions& options, Context& context);

}  // namespace spindle::commands
