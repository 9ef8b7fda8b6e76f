#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "spindle/commands/context.hpp"
#include "spindle/device/watcher.hpp"
#include "spindle/files/register_map.hpp"
#include "spindle/statistics/rules.hpp"
#include "spindle/work/action.hpp"
#include "spindle/work/register_survey.hpp"
#include "spindle/work/run.hpp"
#include "spindle/work/simulated_tool.hpp"
#include "spindle/work/snapshot.hpp"

/// One options struct and one function a verb. None of them prints, exits or parses a command line.
namespace spindle::commands {

/// Tools that are handled at the same time, unless --jobs says otherwise.
inline constexpr std::size_t usual_jobs = 64;

struct IdentifyOptions {
  std::vector<std::string> targets;
  std::size_t jobs = usual_jobs;
};
Result<Outcome> identify(const IdentifyOptions& options, Context& context);

struct ListOptions {
  std::vector<std::string> arguments;  ///< [TARGET] [PATTERN...]
};
Result<Outcome> list(const ListOptions& options, Context& context);

struct GetOptions {
  std::vector<std::string> targets;  ///< or groups
  std::vector<std::string> names;
  device::Limits limits = device::Limits::skip;
  Secrets secrets = Secrets::leave_out;
  std::size_t jobs = usual_jobs;
};
Result<Outcome> get(const GetOptions& options, Context& context);

enum class Execution : std::uint8_t { real, dry_run };

/// Whether a tool stores what was written once more, where it would forget it at power-off.
enum class Storing : std::uint8_t { no, yes };

/// Whether registers may be written that the profile does not say can be.
enum class RawWrites : std::uint8_t { refuse, ask };

/// One value that is taken back, as it was recorded.
struct UndoneValue {
  std::string name = {};
  std::string before = {};             ///< what is written
  std::vector<std::string> left = {};  ///< what the tool may hold now
  std::string unit = {};               ///< empty: none, or not recorded
  std::string id = {};                 ///< of the change
  std::string doubt =
      {};  ///< the result of a change of which it is not known what it left; or empty
};

/// What is taken back on one tool, in the order in which it is written.
struct UndoneTool {
  std::string serial = {};  ///< empty: not known
  std::vector<UndoneValue> values = {};
};

/// What is taken back, by target.
using Undoing = std::map<std::string, UndoneTool>;

struct SetOptions {
  std::vector<std::string> targets;      ///< or groups
  std::vector<std::string> assignments;  ///< NAME=VALUE, NAME+=STEP; NAME may be a pattern
  std::string file = {};                 ///< with more of them, a line each; "-": standard input
  Execution execution = Execution::real;
  Storing storing = Storing::no;
  Addressing addressing = Addressing::unicast;
  RawWrites raw = RawWrites::refuse;
  std::size_t jobs = usual_jobs;
  std::optional<Undoing> undoing = std::nullopt;  ///< of `undo`, which always asks
};
Result<Outcome> set(const SetOptions& options, Context& context);

struct DoOptions {
  std::vector<std::string> targets;  ///< or groups
  std::vector<std::string> actions;  ///< ACTION[=VALUE]; none: list them
  Acceptance acceptance = Acceptance::verified_only;
  Addressing addressing = Addressing::unicast;
  std::size_t jobs = usual_jobs;
};
Result<Outcome> perform(const DoOptions& options, Context& context);

struct PingOptions {
  std::vector<std::string> targets;  ///< or groups
  unsigned count = 4;
  Duration interval = std::chrono::seconds(1);
  std::size_t jobs = usual_jobs;
};
Result<Outcome> ping(const PingOptions& options, Context& context);

struct ScanOptions {
  std::string bus;
  std::vector<modbus::UnitId> units;
  std::optional<RegisterSpan> registers;  ///< to be found on the one tool that `bus` then is
  Duration pause = usual_pause;           ///< between two requests for registers
};
/// Which units of a serial line answer a loop-back, at the line's settings and no others.
Result<Outcome> scan(const ScanOptions& options, Context& context);
/// Which registers of a tool can be read. Requires `registers`.
Result<Outcome> scan_registers(const ScanOptions& options, Context& context);

/// Whether what is found is added to the tools file.
enum class WriteTools : std::uint8_t { no, yes };

struct DiscoverOptions {
  std::string subnet = {};                         ///< empty: tools are asked as a group
  std::vector<std::string> interfaces = {};        ///< names or addresses; none: all that can
  Duration duration = std::chrono::seconds(3);     ///< of listening
  std::vector<std::uint16_t> ports = {5000, 502};  ///< of a subnet's addresses
  std::vector<modbus::UnitId> units = {};          ///< behind each port; none: as a tool is asked
  unsigned rate = 50;                              ///< connections begun in a second
  WriteTools write = WriteTools::no;
};
/// Which tools are in the network: those that answer to a group, or at the addresses of a subnet.
Result<Outcome> discover(const DiscoverOptions& options, Context& context);

struct LearnOptions {
  std::string target;
  std::string what;       ///< an action of the profile's section `learn`
  std::string file = {};  ///< of the profile that is written; empty: none
  unsigned changes = 3;   ///< on the tool, that have to be followed
  Duration idle_timeout = std::chrono::minutes(2);
};
/// Which register an action has, by what the user does on the tool. Reads only.
Result<Outcome> learn(const LearnOptions& options, Context& context);

/// Whether other programs than spindle can ask, too.
struct GatewayOptions {
  std::string listen = {};  ///< "PORT" or "ADDRESS:PORT", as typed; empty: they cannot
  link::Rights rights = link::Rights::read;
};

struct WatchOptions {
  std::vector<std::string> targets;
  std::vector<std::string> names;  ///< values to poll; none: events only
  device::EventMode events = device::EventMode::declared;
  device::Samples samples = device::Samples::changes;
  device::Reconnection reconnection = device::Reconnection::forever;
  std::optional<Duration> interval;  ///< between two polls; empty: as usual
  std::size_t count = 0;             ///< end after so many events, changes and samples; 0: never
  std::optional<Duration> duration = std::nullopt;
  std::optional<Duration> idle_timeout = std::nullopt;
  std::string store = {};  ///< that knows the last events; empty: the user's own, where it is there
  std::optional<std::uint16_t> since_event = std::nullopt;  ///< the last number that was seen
  GatewayOptions gateway = {};
};
Result<Outcome> watch(const WatchOptions& options, Context& context);

struct RecordOptions {
  WatchOptions watch = {};                        ///< no targets: all of the tools file
  std::string store = {};                         ///< empty: the user's own
  std::optional<Duration> gather = std::nullopt;  ///< how long results wait for others
  bool tee = false;                               ///< show each record once it is stored
  std::string metrics = {};                       ///< a file for a monitoring system; empty: none
  std::string lease = {};  ///< sink whose database divides the tools; empty: they are not shared
  Duration lease_ttl = std::chrono::seconds(5);  ///< one second or more
};
Result<Outcome> record(const RecordOptions& options, Context& context);

/// When `spindle forward` ends.
enum class Delivery : std::uint8_t {
  service,  ///< never by itself
  once,     ///< when the sink has all that was there at the start
};

/// What `spindle forward` hands on, and to whom.
struct ForwardOptions {
  std::string sink;        ///< a URL, or a name under `sinks:` of the tools file
  std::string store = {};  ///< empty: the user's own
  std::string from = {};   ///< an event's id, or a time as typed; empty: where the sink is
  Delivery delivery = Delivery::service;
  Execution execution = Execution::real;             ///< dry run: shows what would be sent
  std::optional<std::size_t> window = std::nullopt;  ///< at most so many without acknowledgement
  std::string metrics = {};                          ///< file for Prometheus; empty: none
  bool print_schema = false;  ///< show the tables of a database, and do nothing else
  bool keep_leases = false;   ///< answer a recorder's questions on standard input instead
};
Result<Outcome> forward(const ForwardOptions& options, Context& context);

/// `spindle serve`: with targets, the tools that are held for other programs; without, the page.
struct ServeOptions {
  std::vector<std::string> targets = {};
  std::string listen = {};  ///< ADDRESS:PORT of the gateway or of the page; empty: as usual
  link::Rights rights = link::Rights::read;  ///< of those that ask through the gateway
  std::string store = {};                    ///< that the page shows; empty: the user's own
  std::string shifts = {};      ///< when they begin, as typed: "06:00,14:00"; empty: at midnight
  std::string token_file = {};  ///< whose token the page asks for; empty: it asks for none
};
Result<Outcome> serve(const ServeOptions& options, Context& context);

/// Whether Cm and Cmk of one uninterrupted run are told, too.
enum class MachineStudy : std::uint8_t { no, yes };

/// What a requirement is compared with: the index itself, or the lower end of its interval.
enum class RequiredOf : std::uint8_t { index, lower_bound };

struct ReportOptions {
  std::vector<std::string> targets = {};  ///< by their names in the store; groups; none: all
  std::vector<std::string> tools = {};    ///< names or serial numbers
  std::string since = {};                 ///< as typed; see parse_time()
  std::string until = {};                 ///< likewise; not included
  std::optional<std::int64_t> preset = std::nullopt;
  std::string limits = {};        ///< of the torque, "LOWER:UPPER"; empty: the tool's own
  std::string angle_limits = {};  ///< likewise
  statistics::RuleSet rules = statistics::RuleSet::standard;
  bool include_not_completed = false;
  std::vector<std::string> excluded = {};  ///< SERIAL/EPOCH/NUMBER
  std::vector<std::string> reasons = {};   ///< one for each of `excluded`
  Duration shift_break = std::chrono::minutes(30);
  std::vector<std::string> required = {};  ///< "ppk=1.33"
  RequiredOf required_of = RequiredOf::index;
  MachineStudy machine = MachineStudy::no;
  std::string file = {};  ///< of the page; "-": standard output; empty: none
  bool interactive = false;
  Overwrite overwrite = Overwrite::refuse;
  std::string store = {};  ///< empty: the user's own
};
/// What stored results say of tools and joints.
Result<Outcome> report(const ReportOptions& options, Context& context);

struct RemoteStartOptions : work::RunOptions {
  std::string target = {};
};
Result<Outcome> remote_start(const RemoteStartOptions& options, Context& context);
/// The options that the run model of a profile declares beside those of every model, as typed:
/// "--speed"; none where it has no run model.
std::vector<std::string> start_options(const catalogue::Profile& profile);

struct RemoteStopOptions {
  std::vector<std::string> targets;
  std::optional<catalogue::StopMode> stop = std::nullopt;
  Addressing addressing = Addressing::unicast;
};
Result<Outcome> remote_stop(const RemoteStopOptions& options, Context& context);

enum class AlarmReset : std::uint8_t { no, yes };

struct AlarmsOptions {
  std::vector<std::string> targets;  ///< or groups
  AlarmReset reset = AlarmReset::no;
  Acceptance acceptance = Acceptance::verified_only;
  std::size_t jobs = usual_jobs;
};
Result<Outcome> alarms(const AlarmsOptions& options, Context& context);

struct BackupOptions {
  std::vector<std::string> targets;
  std::string file;    ///< of the one target; "-": standard output; empty: named after the target
  std::string folder;  ///< where files named after their targets go; empty: the present one
  Overwrite overwrite = Overwrite::refuse;
  Secrets secrets = Secrets::leave_out;
  std::size_t jobs = usual_jobs;
};
Result<Outcome> backup(const BackupOptions& options, Context& context);

/// Which results of a store are meant. What is empty asks for all.
struct ResultFilter {
  std::vector<std::string> targets = {};  ///< by their names in the store; groups
  std::vector<std::string> tools = {};    ///< names or serial numbers
  std::string since = {};                 ///< as typed; see parse_time()
  std::string until = {};                 ///< likewise; not included
  std::optional<std::int64_t> preset = std::nullopt;
  std::vector<std::string> kinds = {};
  std::string key = {};  ///< SERIAL/EPOCH/NUMBER
};

/// What of a store is told.
enum class Told : std::uint8_t { results, gaps, all };

/// Whether what is stored from now on is told, too.
enum class Following : std::uint8_t { no, yes };

struct ResultsOptions {
  ResultFilter filter = {};
  std::string store = {};  ///< empty: the user's own
  Told told = Told::results;
  Following following = Following::no;
  std::optional<std::size_t> count = std::nullopt;  ///< the newest so many
  std::string qdas = {};   ///< folder for files in the format of Q-DAS; empty: none
  std::string curve = {};  ///< SERIAL/EPOCH/NUMBER of the result whose curve is wanted; empty: none
  Overwrite overwrite = Overwrite::refuse;
};
/// What was stored.
Result<Outcome> results(const ResultsOptions& options, Context& context);

struct LogOptions {
  std::vector<std::string> arguments = {};          ///< [TARGET...] [NAME|PATTERN...]
  std::string since = {};                           ///< as typed; see parse_time()
  std::optional<std::size_t> count = std::nullopt;  ///< the newest so many
};
/// What was changed, by whom, and how it ended: the record of changes.
Result<Outcome> log(const LogOptions& options, Context& context);

struct UndoOptions {
  std::string id = {};  ///< of a change, or of all changes of one command; empty: the last one
  Execution execution = Execution::real;
};
/// Writes back what a command found, if the tool still holds what it left. Plans, asks, verifies.
Result<Outcome> undo(const UndoOptions& options, Context& context);

/// Whether the default target is given up.
enum class Forgetting : std::uint8_t { no, yes };

struct UseOptions {
  std::string target = {};  ///< that is meant from now on where none is named; empty: show it
  Forgetting forget = Forgetting::no;
};
/// The default target.
Result<Outcome> use(const UseOptions& options, Context& context);

struct StoreOptions {
  std::string store = {};  ///< empty: the user's own
};
/// Whether every number is a row or in a gap, and the store whole.
Result<Outcome> check_store(const StoreOptions& options, Context& context);

struct TrimOptions {
  std::string store = {};   ///< empty: the user's own
  std::string before = {};  ///< as typed; see parse_time()
};
/// Removes what is older.
Result<Outcome> trim_store(const TrimOptions& options, Context& context);

struct CopyOptions {
  std::string store = {};  ///< empty: the user's own
  std::string file = {};   ///< of an export: empty or "-": standard output
  Overwrite overwrite = Overwrite::refuse;
};
/// A whole copy of the store, also while it is written.
Result<Outcome> backup_store(const CopyOptions& options, Context& context);
/// Everything in the store as JSON Lines.
Result<Outcome> export_store(const CopyOptions& options, Context& context);

/// The sinks that are served from the store.
Result<Outcome> list_sinks(const StoreOptions& options, Context& context);

struct ForgetOptions {
  std::string store = {};  ///< empty: the user's own
  std::string sink;
};
/// Gives a sink up, so that it holds back no trim.
Result<Outcome> forget_sink(const ForgetOptions& options, Context& context);

struct DumpOptions {
  std::string target;
  std::string file;                            ///< "-": standard output
  std::optional<RegisterSpan> registers;       ///< empty: all that the profile knows, of `table`
  std::optional<modbus::RegisterTable> table;  ///< empty: every table
  Duration pause = usual_pause;
  Overwrite overwrite = Overwrite::refuse;
  Secrets secrets = Secrets::leave_out;
};
/// Raw registers into a file.
Result<Outcome> dump(const DumpOptions& options, Context& context);

struct DiffOptions {
  std::string a;  ///< target, group of one, backup or dump, or "defaults"; with a folder any group
  std::string b;  ///< not with a folder
  std::vector<std::string> patterns;
  std::vector<std::string> ignored;
  std::string folder;  ///< each tool is compared with its backup in it; empty: `a` with `b`
  std::size_t jobs = usual_jobs;
};
Result<Outcome> diff(const DiffOptions& options, Context& context);

enum class ModelCheck : std::uint8_t { strict, off };
enum class OnFailure : std::uint8_t { roll_back, leave };

struct RestoreOptions {
  std::vector<std::string> targets;  ///< with a folder several, and groups
  std::string file;                  ///< not with a folder
  std::string folder;  ///< each tool is restored from its backup in it; empty: from `file`
  std::vector<std::string> patterns;
  Execution execution = Execution::real;
  ModelCheck model = ModelCheck::strict;
  OnFailure on_failure = OnFailure::roll_back;
  Storing storing = Storing::no;  ///< in non-volatile memory, once and only when all succeeded
  std::size_t jobs = usual_jobs;
};
Result<Outcome> restore(const RestoreOptions& options, Context& context);

struct SimulateOptions {
  std::string profile;
  std::string listen;  ///< URL; empty: a free port of this computer
  std::string pty;     ///< path of the pseudo terminal to make instead
  SimulatedToolOptions tool;
  sim::LineModel::Gaps gaps = sim::LineModel::Gaps::enforced;
  std::vector<std::string> faults;    ///< of the tool and of its line
  std::vector<std::string> alarms;    ///< CODE[@TIME]
  std::vector<std::string> warnings;  ///< CODE[@TIME]
  std::vector<std::string> outages;   ///< KIND=TIME@every:TIME
};
Result<Outcome> simulate(const SimulateOptions& options, Context& context);
/// The options that only some profiles declare and this one does, as typed: "--busy".
std::vector<std::string> simulate_options(const catalogue::Profile& profile);

/// The named tools of the tools file.
Result<Outcome> tools(Context& context);
/// Every fault of the tools file; context.tools needs no more than its path.
Result<Outcome> check_tools(Context& context);

/// Whether a tool that is added is asked who it is.
enum class Asking : std::uint8_t { ask, offline };

struct ToolAddOptions {
  std::string name;
  std::string url;
  std::string torque_unit = {};  ///< empty: unknown
  Asking asking = Asking::ask;
  Execution execution = Execution::real;
};
/// Adds a tool to the tools file, which is made where there is none; context.tools needs no more
/// than its path.
Result<Outcome> add_tool(const ToolAddOptions& options, Context& context);

struct ToolsInitOptions {
  Execution execution = Execution::real;
};
/// Writes a tools file to begin with, and never over one.
Result<Outcome> init_tools(const ToolsInitOptions& options, Context& context);

struct ToolsTestOptions {
  std::vector<std::string> targets;  ///< empty: all of the tools file
  std::size_t jobs = usual_jobs;
};
/// Asks every tool who it is, and compares that with the tools file.
Result<Outcome> test_tools(const ToolsTestOptions& options, Context& context);

struct ProfileNameOptions {
  std::string profile;  ///< id or file
};
Result<Outcome> profile_list(Context& context);
Result<Outcome> profile_show(const ProfileNameOptions& options, Context& context);
Result<Outcome> profile_check(const ProfileNameOptions& options, Context& context);

struct ProfileNewOptions {
  std::string name;  ///< its id; the file is NAME.yaml in the present folder
  std::string map;   ///< CSV file of registers; empty: none
  files::Numbering numbering = files::Numbering::address;
};
/// Writes the file of a profile that is to be completed.
Result<Outcome> profile_new(const ProfileNewOptions& options, Context& context);

}  // namespace spindle::commands
