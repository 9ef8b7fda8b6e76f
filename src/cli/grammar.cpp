#include "grammar.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "binder.hpp"
#include "help.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/naming.hpp"
#include "spindle/link/endpoint.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/work/connect.hpp"
#include "version.hpp"

namespace spindle::cli {
namespace {

using commands::Context;
using commands::Outcome;
using Run = std::function<Result<Outcome>(Context&)>;

/// What people read of a command beside its options.
struct Words {
  std::string_view name;
  std::string_view synopsis;  ///< behind the command's name
  std::string_view meaning;
  std::string_view examples;  ///< one a line
  /// What stands behind the command's options, with its own heading; may be absent.
  std::string (*appendix)() = nullptr;
  Invocation::ToolsFile tools_file = Invocation::ToolsFile::loaded;
};

/// How much of the grammar is built: all of it to be described, or the options of the command that
/// is named, because most of a short run would else be the others'.
enum class Extent : std::uint8_t { whole, as_named };

/// The options of a command with its words, before it is known which of them are tools.
template <typename Options>
struct Worded {
  Options options = {};
  commands::TypedWords typed = {};
};

/// Registers as they are typed, before it is known whether all of it goes together.
struct RegisterArguments {
  std::optional<RegisterBounds> bounds = std::nullopt;
  std::optional<modbus::RegisterTable> table = std::nullopt;

  [[nodiscard]] std::optional<work::RegisterSpan> span() const {
    if (!bounds) return std::nullopt;
    return work::RegisterSpan{table.value_or(modbus::RegisterTable::holding), bounds->from,
                              bounds->to};
  }
};

struct DumpArguments {
  commands::DumpOptions options;
  RegisterArguments registers;
};
using WordedDump = Worded<DumpArguments>;

struct ScanArguments {
  commands::ScanOptions options;
  RegisterArguments registers;
  bool has_units = false;
  bool has_pause = false;
};

struct DiscoverArguments {
  commands::DiscoverOptions options;
  std::vector<std::string> of_groups = {};   ///< options that were given and go without a subnet
  std::vector<std::string> of_subnets = {};  ///< the same of those that go with one
};

/// The options of every command, where the parser writes them.
struct AllOptions {
  Worded<commands::IdentifyOptions> identify;
  commands::ListOptions list;
  Worded<commands::GetOptions> get;
  Worded<commands::SetOptions> set;
  Worded<commands::DoOptions> perform;
  Worded<commands::PingOptions> ping;
  ScanArguments scan;
  DiscoverArguments discover;
  commands::LearnOptions learn;
  Worded<commands::WatchOptions> watch;
  commands::RecordOptions record;
  commands::ForwardOptions forward;
  commands::ServeOptions serve;
  commands::ReportOptions report;
  Worded<commands::RemoteStartOptions> remote_start;
  Worded<commands::RemoteStopOptions> remote_stop;
  Worded<commands::AlarmsOptions> alarms;
  Worded<commands::BackupOptions> backup;
  WordedDump dump;
  commands::DiffOptions diff;
  Worded<commands::RestoreOptions> restore;
  commands::SimulateOptions simulate;
  bool check_tools = false;
  commands::ToolAddOptions tools_add;
  commands::ToolsInitOptions tools_init;
  commands::ToolsTestOptions tools_test;
  commands::ResultsOptions results;
  commands::LogOptions log;
  commands::UndoOptions undo;
  commands::UseOptions use;
  commands::StoreOptions store;
  commands::StoreOptions store_check;
  commands::TrimOptions store_trim;
  commands::CopyOptions store_backup;
  commands::CopyOptions store_export;
  commands::StoreOptions store_sinks;
  commands::ForgetOptions store_forget;
  commands::ProfileNameOptions profile;
  commands::ProfileNameOptions profile_list;
  commands::ProfileNameOptions profile_show;
  commands::ProfileNameOptions profile_check;
  commands::ProfileNewOptions profile_new;
  std::vector<std::string> helped;  ///< words of the command that help is wanted of
  std::vector<std::string> none;
};

/// The grammar while it is being parsed: the innermost command that was named.
struct ParseState {
  Extent extent = Extent::as_named;
  /// Only commands whose names stand among these words are known; null: all are.
  const std::vector<std::string>* named = nullptr;
  AllOptions options = {};
  Invocation invocation = {};  ///< as far as the common options say
  bool help = false;
  bool version = false;
  Faults common_faults = {};
  std::map<const CLI::App*, Words> words = {};
  std::map<const CLI::App*, Faults> faults = {};
  const CLI::App* chosen = nullptr;
  /// Instead of what the command's words say.
  std::optional<Invocation::ToolsFile> tools_file = std::nullopt;
  std::vector<std::string> behind_dashes = {};  ///< words that name no tool
  bool takes_behind = false;                    ///< the command takes them so
  bool takes_default = false;                   ///< tools may be meant that no word names
  std::string only_as_text = {};  ///< why neither JSON nor CSV can be had; empty: they can
  bool has_columns = false;       ///< whether the command shows a list and changes nothing
};

constexpr std::string_view end_of_options = "--";
constexpr std::string_view help_command = "help";
constexpr std::string_view version_command = "version";

/// Of options that only some profiles declare: CLI11's groups say which.
constexpr std::string_view declared_prefix = "of ";
constexpr const char* of_start_action = "of the run model start-action";
constexpr const char* of_command_word = "of the run model command-word";
constexpr const char* of_motors = "of the run models command-word and command-register";
constexpr const char* of_identity = "of profiles with an identity";
constexpr const char* of_screwdrivers = "of profiles that count their results";
constexpr const char* of_alarms = "of profiles whose run names alarms and warnings";

void add_common_options(CLI::App& app, ParseState& draft) {
  Binder bind(app, "", draft.common_faults);
  Invocation& invocation = draft.invocation;
  work::CommonOptions& common = invocation.common;
  commands::UserOptions& user = invocation.user;
  bind.option("-o,--output", "FORMAT", invocation.format, one_of(format_words),
              "table, wide (all columns), value (only values), json (JSON Lines), yaml, csv; "
              "results --curve also svg");
  bind.flag(
      "--json", [] {}, "the same as -o json");  // see with_one_output_option()
  bind.option("--profile", "NAME|FILE", common.profile, "what the tool's registers mean");
  bind.option("--tools", "FILE", common.tools_file, "file of named tools");
  bind.option("--timeout", "DURATION", common.timeout, to_duration,
              "how long to wait for one answer");
  bind.option("--connect-timeout", "DURATION", common.connect_timeout, to_duration,
              "how long to wait for the connection");
  bind.option("--retries", "N", common.retries, NumberFrom{0, 100},
              "how often a read without an answer is repeated");
  const auto give_consent = [&user] { user.consent = commands::Consent::given; };
  bind.flag("-y,--yes", give_consent, "answer every question with yes");
  const auto ask_nothing = [&user] {
    if (user.consent != commands::Consent::given) user.consent = commands::Consent::no_input;
  };
  bind.flag("--no-input", ask_nothing, "never ask; what would have to be asked is refused");
  const auto be_quiet = [&user] { user.verbosity = report::Verbosity::quiet; };
  bind.flag("-q,--quiet", be_quiet, "no summary, notes and progress on stderr");
  const auto show_frames = [&user] { user.frames = commands::Frames::shown; };
  bind.flag("-v,--verbose", show_frames, "every frame and decision on stderr");
  bind.option("--trace", "FILE", common.trace_file, "every frame into a pcapng file for Wireshark");
  bind.option("--color", "WHEN", invocation.color, one_of(color_words), "auto, always or never");
  bind.flag("-h,--help", draft.help, true, "show this help");
  bind.flag("--version", draft.version, true, "show the version");
}

/// The tool that a command was wanted from, as typed; empty where it is none or several.
template <typename Options>
std::string asked_of(const Options& options) {
  const auto is_group = [](const std::string& target) { return target.starts_with('@'); };
  if constexpr (requires { options.target.size(); }) {
    return is_group(options.target) ? std::string() : options.target;
  }
  if constexpr (requires { options.targets.front().size(); }) {
    const auto& targets = options.targets;
    if (targets.size() == 1 && !is_group(targets.front())) return targets.front();
  }
  return {};
}

std::string path_of(const CLI::App* command) {
  std::string path = command->get_name();
  for (const CLI::App* parent = command->get_parent();
       parent != nullptr && parent->get_parent() != nullptr; parent = parent->get_parent()) {
    path.insert(0, parent->get_name() + " ");
  }
  return path;
}

/// Adds a command: `bind_options` declares what may stand behind it, and `run` is the command. The
/// options are copied, because the grammar is gone when it runs; what is wrong with them is told
/// then, as an error of the command.
template <typename Options, typename RunCommand, typename BindOptions>
void add_command(CLI::App& parent, ParseState& draft, const Words& words, Options& options,
                 RunCommand run, BindOptions bind_options) {
  const bool is_left_out =
      draft.named != nullptr && parent.get_parent() == nullptr &&
      std::find(draft.named->begin(), draft.named->end(), words.name) == draft.named->end();
  if (is_left_out) return;
  CLI::App* command = parent.add_subcommand(std::string(words.name), std::string(words.meaning));
  command->fallthrough();
  command->set_help_flag();
  draft.words[command] = words;
  command->final_callback([&draft, &options, command, run] {
    if (draft.chosen != nullptr) return;  // a command below this one was named
    draft.chosen = command;
    const auto fault = draft.faults[command].first();  // the checks come before the copy
    draft.invocation.run = [options, fault, run](Context& context) -> Result<Outcome> {
      auto outcome = fault ? Result<Outcome>(tl::unexpected(*fault)) : run(options, context);
      return std::move(outcome).map_error([&](Error error) {
        if (error.asked_of.empty()) error.asked_of = asked_of(options);
        return error;
      });
    };
  });
  const auto bind_all = [&draft, &options, command, bind_options] {
    Binder bind(*command, path_of(command), draft.faults[command]);
    bind_options(bind, options);
  };
  if (draft.extent == Extent::whole) {
    bind_all();
  } else {
    command->preparse_callback([bind_all](std::size_t) { bind_all(); });
  }
}

constexpr std::string_view target_words = "tool name, @group or URL";

/// For lists of what changes nothing: a wrong column is told before it is too late.
void bind_columns(Binder& bind, ParseState& draft) {
  draft.has_columns = true;
  bind.option("--columns", "LIST", draft.invocation.columns, to_columns,
              "only these columns, such as target,time");
}

/// The words of a command, whichever they are.
template <typename Options>
void bind_words(Binder& bind, ParseState& draft, Worded<Options>& worded,
                std::string_view meaning) {
  draft.takes_default = true;
  draft.takes_behind = true;
  bind.argument("TARGET", worded.typed.words, meaning);
  bind.check([&draft, &worded]() -> std::optional<Error> {
    const auto& behind = draft.behind_dashes;
    worded.typed.words.insert(worded.typed.words.end(), behind.begin(), behind.end());
    worded.typed.behind_dashes = behind.size();
    return std::nullopt;
  });
}

// take() gives the options of a command what of its words is a tool, and what is not.

Result<void> take(commands::SortedWords words, commands::GetOptions& options) {
  options.targets = std::move(words.targets);
  options.names = std::move(words.others);
  return {};
}

Result<void> take(commands::SortedWords words, commands::WatchOptions& options) {
  options.targets = std::move(words.targets);
  options.names = std::move(words.others);
  return {};
}

Result<void> take(commands::SortedWords words, commands::DoOptions& options) {
  options.targets = std::move(words.targets);
  options.actions = std::move(words.others);
  return {};
}

Result<void> take(commands::SortedWords words, commands::SetOptions& options) {
  options.targets = std::move(words.targets);
  options.assignments = std::move(words.others);
  const bool is_empty = options.assignments.empty() && options.file.empty();
  return is_empty ? tl::unexpected(Binder::missing("set", "NAME=VALUE")) : Result<void>();
}

/// Beside --dir there is no FILE, and all words are names.
Result<void> take(commands::SortedWords words, commands::RestoreOptions& options) {
  options.targets = std::move(words.targets);
  options.patterns = std::move(words.others);
  if (!options.folder.empty()) return {};
  if (options.patterns.empty()) return tl::unexpected(Binder::missing("restore", "FILE"));
  options.file = std::move(options.patterns.front());
  options.patterns.erase(options.patterns.begin());
  return {};
}

Error one_too_many(std::string_view command, std::string_view word) {
  return for_help(command, usage(fmt::format("{}: '{}' is one argument too many", command, word)));
}

Result<void> take(commands::SortedWords words, DumpArguments& dump) {
  if (words.others.empty()) return tl::unexpected(Binder::missing("dump", "FILE"));
  if (words.targets.size() > 1) return tl::unexpected(one_too_many("dump", words.targets[1]));
  if (words.others.size() > 1) return tl::unexpected(one_too_many("dump", words.others[1]));
  dump.options.target = std::move(words.targets.front());
  dump.options.file = std::move(words.others.front());
  return {};
}

Result<void> take(commands::SortedWords words, commands::RemoteStartOptions& options) {
  if (words.targets.size() > 1) {
    return tl::unexpected(one_too_many("remote-start", words.targets[1]));
  }
  options.target = std::move(words.targets.front());
  return {};
}

/// Of commands whose words are all tools.
template <typename Options>
requires requires(Options options) { options.targets; }
Result<void> take(commands::SortedWords words, Options& options) {
  options.targets = std::move(words.targets);
  return {};
}

/// Runs a command once its words are told apart.
template <typename Options, typename RunCommand>
auto with_words(std::string_view command, commands::OtherWords kind, RunCommand run) {
  return [=](const Worded<Options>& worded, Context& context) -> Result<Outcome> {
    TRY_LET(auto words, commands::sort_words(worded.typed, kind, command, context));
    Options options = worded.options;
    TRY(take(std::move(words), options));
    return run(options, context).map_error([&](Error error) {
      error = commands::or_misspelt_tool(std::move(error), context);
      if (error.asked_of.empty()) error.asked_of = asked_of(options);
      return error;
    });
  };
}

void bind_jobs(Binder& bind, std::size_t& jobs) {
  bind.option("--jobs", "N", jobs, NumberFrom{1, 10'000}, "how many tools at a time (default 64)");
}

void add_identify(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"identify", "[TARGET...]",
                           "who is there: maker, model, serial, firmware, profile",
                           "spindle identify sim:doga-bm\n"
                           "spindle identify tcp://192.168.10.23:5000\n"
                           "spindle identify station3 station4 --json"};
  add_command(app, draft, words, draft.options.identify,
              with_words<commands::IdentifyOptions>("identify", commands::OtherWords::none,
                                                    commands::identify),
              [&draft](Binder& bind, Worded<commands::IdentifyOptions>& worded) {
                bind_words(bind, draft, worded, target_words);
                bind_columns(bind, draft);
                bind_jobs(bind, worded.options.jobs);
              });
}

void add_list(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"list", "[TARGET] [PATTERN...]",
                           "the parameter catalogue, offline when --profile is given",
                           "spindle list --profile doga-bm\n"
                           "spindle list --profile doga-bm 'preset.1.*'\n"
                           "spindle list station3 '*torque*' --json"};
  add_command(app, draft, words, draft.options.list, commands::list,
              [&draft](Binder& bind, commands::ListOptions& options) {
                draft.takes_default = true;
                bind.argument("PATTERN", options.arguments,
                              "names or patterns; a tool, URL or profile may stand before them");
                bind_columns(bind, draft);
              });
}

void add_get(CLI::App& app, ParseState& draft) {
  constexpr Words words = {
      "get", "[TARGET...] [NAME|PATTERN...]",
      "read parameters by name, pattern, number (p242) or raw register (@holding:2)",
      "spindle get sim:doga-bm 'preset.1.*torque*'\n"
      "spindle get station3 status.ready status.alarm\n"
      "spindle get @line1 'preset.1.*' --json\n"
      "spindle get tcp://192.168.10.23:5000 @holding:2 @input:3204/i16 @holding:1..31"};
  add_command(app, draft, words, draft.options.get,
              with_words<commands::GetOptions>("get", commands::OtherWords::names, commands::get),
              [&draft](Binder& bind, Worded<commands::GetOptions>& worded) {
                commands::GetOptions& options = worded.options;
                bind_words(bind, draft, worded,
                           "tools, and names, patterns, numbers or raw registers");
                bind_columns(bind, draft);
                bind.flag("--limits", options.limits, device::Limits::read,
                          "also read the tool's own minimum and maximum");
                bind.flag("--include-secrets", options.secrets, commands::Secrets::include,
                          "show what the profile marks as secret");
                bind_jobs(bind, options.jobs);
              });
}

constexpr std::string_view save_words =
    "store it in the tool's non-volatile memory afterwards (BLV); asks";

constexpr std::string_view broadcast_words =
    "to every unit on the serial line (unit=0): sent, not acknowledged; asks";

void add_set(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"set", "[TARGET...] NAME=VALUE...",
                           "check everything, show old and new, write only what differs, read back",
                           "spindle set sim:doga-bm preset.1.target-torque=2.80\n"
                           "spindle set station3 preset.1.mode=TC/AM preset.1.speed=900\n"
                           "spindle set station3 preset.2.target-torque=3.10 --dry-run\n"
                           "spindle set @line1 preset.1.target-torque=2.80\n"
                           "spindle set sim:orientalmotor-blv operation.2.speed=1200"};
  add_command(
      app, draft, words, draft.options.set,
      with_words<commands::SetOptions>("set", commands::OtherWords::assignments, commands::set),
      [&draft](Binder& bind, Worded<commands::SetOptions>& worded) {
        commands::SetOptions& options = worded.options;
        bind_words(bind, draft, worded,
                   "tools, and NAME=VALUE (also 1.5kW, +5%), NAME+=STEP, NAME-=STEP");
        bind.option("-f,--file", "FILE", options.file,
                    "lines of NAME=VALUE, # begins a comment; - is standard input");
        bind.flag("-n,--dry-run", options.execution, commands::Execution::dry_run,
                  "check and show everything, write nothing");
        bind.flag("--save", options.storing, commands::Storing::yes, save_words);
        bind.flag("--raw", options.raw, commands::RawWrites::ask,
                  "also registers such as @holding:4 that no profile says can be written");
        bind.flag("--broadcast", options.addressing, commands::Addressing::broadcast,
                  broadcast_words);
        bind_jobs(bind, options.jobs);
      });
}

constexpr std::string_view accept_unverified_words =
    "send what may move or lock the tool although its register is not certain";

void add_do(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"do", "[TARGET...] [ACTION[=VALUE]...]",
                           "run actions of the catalogue; without one, list them",
                           "spindle do sim:doga-bm\n"
                           "spindle do sim:doga-bm select-preset=3 --accept-unverified --yes\n"
                           "spindle do station3 alarm-reset --accept-unverified\n"
                           "spindle do @line1 lock=unlocked --accept-unverified"};
  add_command(app, draft, words, draft.options.perform,
              with_words<commands::DoOptions>("do", commands::OtherWords::names, commands::perform),
              [&draft](Binder& bind, Worded<commands::DoOptions>& worded) {
                commands::DoOptions& options = worded.options;
                bind_words(bind, draft, worded,
                           "tools, and actions, with =VALUE where they take one");
                bind.flag("--accept-unverified", options.acceptance,
                          commands::Acceptance::unverified, accept_unverified_words);
                bind.flag("--broadcast", options.addressing, commands::Addressing::broadcast,
                          broadcast_words);
                bind_jobs(bind, options.jobs);
              });
}

void add_ping(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"ping", "[TARGET...] [-c N]",
                           "round-trip statistics without touching any value",
                           "spindle ping sim:doga-bm -c 3 --interval 100ms\n"
                           "spindle ping station3\n"
                           "spindle ping @line1 -c 1\n"
                           "spindle ping tcp://192.168.10.23:5000 -c 100 --json"};
  add_command(app, draft, words, draft.options.ping,
              with_words<commands::PingOptions>("ping", commands::OtherWords::none, commands::ping),
              [&draft](Binder& bind, Worded<commands::PingOptions>& worded) {
                commands::PingOptions& options = worded.options;
                bind_words(bind, draft, worded, target_words);
                bind_columns(bind, draft);
                bind.option("-c,--count", "N", options.count, NumberFrom{1, 1'000'000},
                            "how many requests (default 4)");
                bind.option("--interval", "DURATION", options.interval, to_duration,
                            "time between them (default 1s)");
                bind_jobs(bind, options.jobs);
              });
}

std::string scan_words() {
  return "The line is asked at the rate and parity of the target or profile, and at no others: a\n"
         "driver that hears three bad frames in a row stops its motor, and every frame at a wrong\n"
         "rate is bad. A wrong unit costs one --timeout; nothing is asked twice. Behind a gateway\n"
         "(tcp://) a unit that the gateway cannot reach counts as absent.\n"
         "\n"
         "With --registers, the registers of one tool are read, and nothing is written. A block "
         "that\n"
         "the tool refuses is halved until it is known which registers are there. What the "
         "profile\n"
         "says that reading clears is not read; without a profile that is not known. Ctrl-C ends "
         "it\n"
         "with what is known by then.\n";
}

void bind_registers(Binder& bind, RegisterArguments& arguments, std::string_view meaning) {
  bind.option("--registers", "FROM..TO", arguments.bounds, to_registers, meaning);
  bind.option("--table", "TABLE", arguments.table, one_of(modbus::table_words),
              fmt::format("their table: {} (default holding)",
                          fmt::join(modbus::table_words.words(), " or ")));
}

/// Units are asked for on a line, registers of one tool.
std::optional<Error> check_scan(const ScanArguments& arguments) {
  const bool about_registers = arguments.registers.bounds.has_value();
  if (about_registers && arguments.has_units) {
    return usage("--units and --registers exclude each other",
                 "scan the line for units first, then the registers of one of them (?unit=N)");
  }
  if (about_registers) return std::nullopt;
  for (const auto& [is_given, name] : {std::pair(arguments.registers.table.has_value(), "--table"),
                                       std::pair(arguments.has_pause, "--pause")}) {
    if (is_given) {
      return usage(fmt::format("{} goes with --registers", name), "add --registers 0..999");
    }
  }
  return std::nullopt;
}

void bind_scan(Binder& bind, ScanArguments& arguments) {
  commands::ScanOptions& options = arguments.options;
  constexpr std::uint8_t usual_last_unit = 31;
  for (std::uint8_t unit = 1; unit <= usual_last_unit; ++unit) options.units.push_back({unit});
  bind.required("BUS", options.bus,
                "URL of the line, or a tool that is on it; the tool whose registers are scanned");
  bind.option("--units", "LIST", options.units, to_units, "which to ask (default 1-31)")
      ->each([&arguments](const std::string&) { arguments.has_units = true; });
  bind_registers(bind, arguments.registers, "find which of these registers of the tool answer");
  bind.option("--pause", "DURATION", options.pause, to_duration,
              "between two requests for registers (default 20ms)")
      ->each([&arguments](const std::string&) { arguments.has_pause = true; });
  bind.check([&arguments] { return check_scan(arguments); });
}

void add_scan(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"scan", "BUS [--units 1-31|--registers 0..999]",
                           "which units answer on a line or behind a gateway, or which "
                           "registers of a tool",
                           "spindle scan rtu:///dev/ttyUSB0 --timeout 100ms\n"
                           "spindle scan 'rtu:///dev/ttyUSB0?baud=115200' --units 1-5,9\n"
                           "spindle scan rtu+tcp://192.168.10.30:4001 --json\n"
                           "spindle scan tcp://192.168.10.31 --units 1-5\n"
                           "spindle scan station3 --registers 3200..3299 --table input",
                           scan_words};
  const auto run = [](const ScanArguments& arguments, Context& context) {
    commands::ScanOptions options = arguments.options;
    options.registers = arguments.registers.span();
    return commands::scan(options, context);
  };
  add_command(app, draft, words, draft.options.scan, run,
              [&draft](Binder& bind, ScanArguments& arguments) {
                bind_scan(bind, arguments);
                bind_columns(bind, draft);
              });
}

std::string discover_words() {
  return "Without SUBNET, tools are asked as a group (UDP multicast), as the profiles say that "
         "they\n"
         "can be, and each that answers is told once. That works inside of one network only, and "
         "not\n"
         "where an access point keeps its clients apart. What a tool says of itself there is not\n"
         "proven: 'spindle identify' asks it.\n"
         "\n"
         "With SUBNET, every address is tried, and what takes a connection is asked who it is "
         "(FC 11h).\n"
         "Nothing else is sent, and nothing is ever written. A tool that serves one client at a "
         "time\n"
         "is busy for that moment: do not sweep a line that is at work. At most a /16 is asked.\n"
         "\n"
         "--write adds what is new to the tools file, behind its last tool; it asks first, and\n"
         "changes no entry that is there.\n";
}

/// Some options are about a group of tools, others about addresses that are tried.
std::optional<Error> check_discover(const DiscoverArguments& arguments) {
  const bool has_subnet = !arguments.options.subnet.empty();
  const auto& misplaced = has_subnet ? arguments.of_groups : arguments.of_subnets;
  if (misplaced.empty()) return std::nullopt;
  if (has_subnet) {
    return usage(fmt::format("{} goes without SUBNET", misplaced.front()), "leave one of them out");
  }
  return usage(fmt::format("{} goes with SUBNET", misplaced.front()),
               "name the network of the tools, such as 192.168.10.0/24");
}

/// "5000,502": TCP ports, each once, in the order given.
Result<std::vector<std::uint16_t>> to_ports(std::string_view option, const std::string& text) {
  constexpr std::uint64_t last_port = 0xFFFF;
  std::vector<std::uint16_t> ports;
  for (const std::string_view each : split(text, ',')) {
    const auto port = parse_unsigned(each, last_port);
    if (!port || *port == 0) {
      return tl::unexpected(bad_option(option, fmt::format("'{}' does not fit", text),
                                       "it takes ports from 1 to 65535, such as 5000,502"));
    }
    const auto number = static_cast<std::uint16_t>(*port);
    if (std::find(ports.begin(), ports.end(), number) == ports.end()) ports.push_back(number);
  }
  return ports;
}

void bind_discover(Binder& bind, DiscoverArguments& arguments) {
  commands::DiscoverOptions& options = arguments.options;
  const auto note_in = [](std::vector<std::string>& list, const char* name) {
    return [&list, name](const std::string&) { list.emplace_back(name); };
  };
  bind.argument("SUBNET", options.subnet,
                "network whose addresses are tried, such as 192.168.10.0/24");
  bind.repeatable("--interface", "NAME|ADDRESS", options.interfaces,
                  "where to ask, also several times (default: all that are up)")
      ->each(note_in(arguments.of_groups, "--interface"));
  bind.option("--for", "DURATION", options.duration, to_duration, "how long to listen (default 3s)")
      ->each(note_in(arguments.of_groups, "--for"));
  bind.option("--port", "LIST", options.ports, to_ports,
              "with SUBNET: which ports to try (default 5000,502)")
      ->each(note_in(arguments.of_subnets, "--port"));
  bind.option("--units", "LIST", options.units, to_units,
              "with SUBNET: which units to ask behind each, such as 1-5")
      ->each(note_in(arguments.of_subnets, "--units"));
  bind.option("--rate", "N", options.rate, NumberFrom{1, 10'000},
              "with SUBNET: connections begun in a second, at most (default 50)")
      ->each(note_in(arguments.of_subnets, "--rate"));
  bind.flag("--write", options.write, commands::WriteTools::yes,
            "add what is found to the tools file; asks");
  bind.check([&arguments] { return check_discover(arguments); });
}

void add_discover(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"discover",
                           "[SUBNET]",
                           "find tools in the network",
                           "spindle discover\n"
                           "spindle discover --interface eth0 --for 10s --json\n"
                           "spindle discover --write\n"
                           "spindle discover 192.168.10.0/24\n"
                           "spindle discover 192.168.10.31/32 --port 502 --units 1-5",
                           discover_words,
                           Invocation::ToolsFile::all_tools};
  const auto run = [](const DiscoverArguments& arguments, Context& context) {
    return commands::discover(arguments.options, context);
  };
  add_command(app, draft, words, draft.options.discover, run, bind_discover);
}

std::string learn_words() {
  return "WHAT is an action whose register no source of the profile says: select-preset, lock or\n"
         "alarm-reset of a tool with firmware 4000 and later. Registers that the profile names "
         "for it\n"
         "are read again and again while you do on the tool what is asked for, and those that do "
         "not\n"
         "follow are left out, until one is left. Nothing is written to the tool.\n"
         "\n"
         "With -f, a profile of your own is written that has the action, with evidence "
         "'verified'. That\n"
         "says that the register was seen to follow, not that a write to it acts: try it as its\n"
         "'check' says.\n";
}

void add_learn(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"learn", "TARGET WHAT [-f FILE]",
                           "find out on your own tool which register an action has",
                           "spindle learn station3 select-preset\n"
                           "spindle learn station3 lock -f ./my-bmt.yaml\n"
                           "spindle learn station3 alarm-reset --changes 2",
                           learn_words};
  add_command(app, draft, words, draft.options.learn, commands::learn,
              [](Binder& bind, commands::LearnOptions& options) {
                bind.required("TARGET", options.target, "tool name or URL");
                bind.required("WHAT", options.what, "the action to learn");
                bind.option("-f,--file", "FILE", options.file,
                            "profile to write; never one that is there");
                bind.option("--changes", "N", options.changes, NumberFrom{2, 100},
                            "how many changes on the tool have to be followed (default 3)");
                bind.option("--idle-timeout", "DURATION", options.idle_timeout, to_duration,
                            "give up when nothing changed for so long (default 2min)");
              });
}

std::string trouble_words() {
  std::string text =
      "Faults (behind any of them: @3 only the third answer, @every:5 every fifth):\n";
  for (const sim::FaultHelp& fault : sim::fault_help()) {
    text += fmt::format("  {:<26}{}\n", fault.syntax, fault.meaning);
  }
  text += "\nOutages (such as sleep=3s@every:20s: after 20 s, 40 s, 60 s, for 3 s each):\n";
  for (const sim::OutageHelp& outage : sim::outage_help()) {
    text += fmt::format("  {:<28}  {}\n", outage.syntax, outage.meaning);
  }
  return text;
}

void bind_gateway(Binder& bind, std::string& listen, link::Rights& rights,
                  std::string_view meaning) {
  bind.option("--listen", "[ADDRESS:]PORT", listen, meaning);
  bind.flag("--allow-write", rights, link::Rights::write,
            "let what other programs write through --listen pass");
}

void bind_watch(Binder& bind, commands::WatchOptions& options) {
  bind.option("--interval", "DURATION", options.interval, to_duration,
              "time between two polls (default 200ms)");
  // --all wins over --initial.
  bind.flag("--all", options.samples, device::Samples::all,
            "every polled sample instead of changes");
  const auto add_first = [&options] {
    if (options.samples != device::Samples::all) {
      options.samples = device::Samples::changes_and_first;
    }
  };
  bind.flag("--initial", add_first, "also the first value of everything polled");
  bind.option("-c,--count", "N", options.count, NumberFrom{1, 1'000'000'000},
              "end after so many events, changes and samples");
  bind.option("--duration", "DURATION", options.duration, to_duration, "end after this time");
  bind.option("--idle-timeout", "DURATION", options.idle_timeout, to_duration,
              "end when nothing came for this time; status 1 if nothing came at all");
  bind.flag("--no-push", options.events, device::EventMode::unarmed,
            "poll the event counter; for tools whose output another client uses");
  bind.flag("--no-reconnect", options.reconnection, device::Reconnection::never,
            "end when the link is lost");
  bind.option("--since-event", "N", options.since_event, NumberFrom{0, 65'535},
              "the last event number that is known: what came since is told, or is a gap");
  bind.option("--store", "FILE", options.store,
              "go on behind the last events of this store (default: that of spindle record)");
  bind_gateway(bind, options.gateway.listen, options.gateway.rights,
               "let any program ask this tool in Modbus TCP, too");
}

void add_watch(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"watch", "[TARGET...] [NAME|PATTERN...]",
                           "events as they happen and changes of polled values, until stopped",
                           "spindle watch station3\n"
                           "spindle watch station3 station4 --json --count 100\n"
                           "spindle watch station3 status.ready status.alarm --interval 500ms"};
  add_command(
      app, draft, words, draft.options.watch,
      with_words<commands::WatchOptions>("watch", commands::OtherWords::names, commands::watch),
      [&draft](Binder& bind, Worded<commands::WatchOptions>& worded) {
        bind_words(bind, draft, worded, "tools, and names or patterns of values to poll");
        bind_watch(bind, worded.options);
        bind_columns(bind, draft);
      });
}

std::string record_words() {
  return "With --lease several collectors record the tools of one tools file, each tool by one of "
         "them\n"
         "at a time: who holds it is a row of the table spindle_lease, by the clock of the "
         "database\n"
         "('spindle forward SINK --print-schema' makes it; the role needs spindle_collector). Each "
         "has a\n"
         "store of its own, and a 'spindle forward' to that database. What a collector that died "
         "held,\n"
         "the others take within the time of a lease and two seconds, and go on behind the last "
         "event\n"
         "that the database has. A collector that begins takes only what is free. Where the "
         "database\n"
         "cannot be asked, what is held ends with its lease, and nothing is taken: no tool is "
         "recorded\n"
         "until it is back. Every collector needs a name of its own ('collector' of the sink, "
         "else its\n"
         "host name).\n";
}

void bind_record(Binder& bind, commands::RecordOptions& options) {
  bind.argument("TARGET", options.watch.targets, "tools (default: all of the tools file)");
  bind.option("--store", "FILE", options.store,
              "where results are kept (default: events.db in the user's folder of state)");
  bind.flag("--tee", options.tee, true, "show each record once it is stored");
  bind.option("--metrics", "FILE", options.metrics,
              "keep counters in this file, for Prometheus (such as spindle.prom)");
  bind.option("--commit", "DURATION", options.gather, to_duration,
              "how long results wait to be stored together (default 20ms)");
  bind.option("--lease", "SINK", options.lease,
              "share the tools with other collectors, by leases in this PostgreSQL database");
  bind.option("--lease-ttl", "DURATION", options.lease_ttl, to_duration,
              "how long a lease lasts that is not renewed (default 5s)");
  bind.check([&options]() -> std::optional<Error> {
    if (options.lease_ttl >= std::chrono::seconds(1)) return std::nullopt;
    return Error{.code = Errc::out_of_range,
                 .message = "a lease lasts one second or more",
                 .name = "--lease-ttl"};
  });
  bind.option("--interval", "DURATION", options.watch.interval, to_duration,
              "time between two polls (default 200ms)");
  bind.option("-c,--count", "N", options.watch.count, NumberFrom{1, 1'000'000'000},
              "end after so many events and changes are stored");
  bind.option("--duration", "DURATION", options.watch.duration, to_duration, "end after this time");
  bind_gateway(bind, options.watch.gateway.listen, options.watch.gateway.rights,
               "let any program ask this tool in Modbus TCP, too");
}

void add_record(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"record",
                           "[TARGET...]",
                           "watch tools and keep every result in a store, until stopped",
                           "spindle record\n"
                           "spindle record station3 --tee --json\n"
                           "spindle record @line1 --store line1.db\n"
                           "spindle record --lease plant",
                           record_words,
                           Invocation::ToolsFile::all_tools};
  add_command(app, draft, words, draft.options.record, commands::record, bind_record);
}

std::string forward_words() {
  return "SINK is mqtts://HOST[:PORT][/TOPIC], mqtt://HOST, postgresql://HOST/DATABASE, or a name "
         "under\n"
         "'sinks' of the tools file, where user, password file, certificates and other servers\n"
         "stand; see spindle-tools(5). A sink that is new gets everything in the store. Everything "
         "is\n"
         "sent until the sink acknowledged it, so that it may come twice, under the same key, and\n"
         "nothing is lost; the store remembers where the sink is. What a sink refuses stays, and "
         "is\n"
         "tried again. --from sets the sink back for good: to the event of this id, or to what "
         "was\n"
         "stored since a time. To leave out what the sink has not got has to be said with --yes.\n"
         "\n"
         "MQTT 5 only, at least once (QoS 1). Topics below TOPIC (spindle/v1):\n"
         "  TOOL/result, TOOL/gap          not retained; with 'events: all' also TOOL/event\n"
         "  TOOL/state                     retained: link, last result, alarm\n"
         "  _collector/NAME/status         retained: online or not (last will)\n"
         "Characters of a tool's name that no level of a topic may have stand as %XX.\n";
}

void bind_forward(Binder& bind, commands::ForwardOptions& options) {
  bind.required("SINK", options.sink, "a URL, or a name under 'sinks' of the tools file");
  bind.option("--from", "ID|TIME", options.from, "set the sink back, or ahead, to here first");
  bind.flag("--once", options.delivery, commands::Delivery::once,
            "end when the sink has all that is in the store now");
  bind.flag("-n,--dry-run", options.execution, commands::Execution::dry_run,
            "show what would be sent; send nothing");
  bind.option("--window", "N", options.window, NumberFrom{1, 10'000},
              "send at most so many that are not acknowledged (default 100; MQTT)");
  bind.option("--metrics", "FILE", options.metrics, "keep counters there, for Prometheus");
  bind.flag("--print-schema", options.print_schema, true,
            "show the tables that a database has to have, for psql; nothing else is done");
  bind.flag("--leases", options.keep_leases, true,
            "keep leases for spindle record --lease, which starts this by itself");
  bind.option("--store", "FILE", options.store, "the store (default: that of spindle record)");
}

void add_forward(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"forward", "SINK",
                           "hand what was recorded on to a database or a broker, until stopped",
                           "spindle forward plant\n"
                           "spindle forward plant --once --from yesterday\n"
                           "spindle forward plant --dry-run --json\n"
                           "spindle forward mqtts://broker.example/acme/line1",
                           forward_words};
  add_command(app, draft, words, draft.options.forward, commands::forward, bind_forward);
}

void bind_serve(Binder& bind, commands::ServeOptions& options) {
  bind.argument("TARGET", options.targets, "tools to hold for others; none: show the page");
  bind_gateway(bind, options.listen, options.rights,
               "of the page, or with TARGET of a Modbus TCP gateway");
  bind.option("--store", "FILE", options.store,
              "what the page shows (default: the store of spindle record)");
  bind.option("--shift", "TIMES", options.shifts,
              "when shifts begin, such as 06:00,14:00,22:00 (default: 00:00)");
  bind.option("--token-file", "FILE", options.token_file,
              "show the page only to those who have the token in it; needed for other computers");
  bind.check([&options]() -> std::optional<Error> {
    if (options.targets.empty()) {
      if (options.rights == link::Rights::read) return std::nullopt;
      return usage("serve: --allow-write is for a gateway, and without TARGET there is a page",
                   "name the tools that are served");
    }
    if (options.store.empty() && options.shifts.empty() && options.token_file.empty()) {
      return std::nullopt;
    }
    return usage("serve: --store, --shift and --token-file are for the page, which has no TARGET",
                 "leave them out, or leave the tools out");
  });
}

void add_serve(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"serve", "[TARGET...]",
                           "a page of what is recorded, or tools that other programs ask",
                           "spindle serve\n"
                           "spindle serve --shift 06:00,14:00,22:00\n"
                           "spindle serve --listen 192.0.2.5:8470 --token-file /etc/spindle/token\n"
                           "spindle serve station3 --listen 127.0.0.1:1502"};
  add_command(app, draft, words, draft.options.serve, commands::serve, bind_serve);
}

std::string report_words() {
  return "Nothing is asked of a tool: results are those that 'spindle record' stored. Results of\n"
         "one tool, preset and settings are one stratum; nothing is pooled. OK results and NG\n"
         "results that came to their end are in the statistics; all others are counted and named.\n"
         "\n"
         "INDEX=VALUE of --require: pp, ppk, cp, cpk or yield, of the torque, or angle.ppk and so\n"
         "on of the angle: ppk=1.33, angle.cpk=1.67, yield=99.5%. Each stratum has to meet it;\n"
         "what cannot be judged (too few values, no limits, not stable) does not meet it, and the\n"
         "status is 1.\n";
}

/// Of what is told, and how.
void bind_report_form(Binder& bind, commands::ReportOptions& options) {
  bind.option("-f,--file", "FILE", options.file,
              "write one page of HTML with figures; - is standard output");
  bind.flag("--interactive", options.interactive, true,
            "let the run charts of the page zoom, by a script that is part of it");
  bind.flag("--force", options.overwrite, Overwrite::allow, "replace a file that is there");
  bind.option("--rules", "RULES", options.rules, one_of(rule_set_words),
              fmt::format("of the control chart: {}", rule_set_words.alternatives()));
  bind.option("--study", "STUDY", options.machine, one_of(study_words),
              "machine: also Cm and Cmk of the longest run of 50 or more without an interruption");
  bind.repeatable("--require", "INDEX=VALUE", options.required,
                  "status 1 where a stratum has less, repeatable");
  bind.flag("--require-low", options.required_of, commands::RequiredOf::lower_bound,
            "require it of the lower end of the 95 % interval");
}

void bind_report(Binder& bind, commands::ReportOptions& options) {
  bind.argument("TARGET", options.targets, "tool names or @groups (default: all of the store)");
  bind.option("--since", "TIME", options.since, "from this time on");
  bind.option("--until", "TIME", options.until, "before this time");
  bind.repeatable("--tool", "NAME|SERIAL", options.tools,
                  "the same tool at every place where it was");
  bind.option("--preset", "N", options.preset, NumberFrom{0, 65'535}, "made with this preset");
  bind.option("--limits", "LOWER:UPPER", options.limits,
              "torque limits of the joint, in place of the tool's own");
  bind.option("--angle-limits", "LOWER:UPPER", options.angle_limits, "the same of the angle");
  bind.option(
      "--include", "WHAT", options.include_not_completed,
      [](std::string_view option, const std::string& text) {
        return one_of(included_words)(option, text).map([](Included) { return true; });
      },
      "not-completed: also results that did not come to their end");
  bind.repeatable("--exclude", "KEY", options.excluded,
                  "take the result SERIAL/EPOCH/NUMBER out of the statistics, repeatable");
  bind.repeatable("--reason", "TEXT", options.reasons, "why, one for each --exclude");
  bind.option("--shift-break", "DURATION", options.shift_break, to_duration,
              "a longer pause ends a run of neighbours (default 30min)");
  bind_report_form(bind, options);
  bind.option("--store", "FILE", options.store,
              "the store (default events.db in the user's folder of state)");
}

void add_report(CLI::App& app, ParseState& draft) {
  constexpr Words words = {
      "report", "[TARGET...] [-f FILE.html]",
      "what stored results say: yield, Ppk, control charts, what is missing",
      "spindle report station3 --since today\n"
      "spindle report @line1 --since 7d -f week.html\n"
      "spindle report station3 --preset 1 --limits 2.44:2.98 --require ppk=1.33\n"
      "spindle report --since yesterday --json",
      report_words};
  const auto note_file = [&draft](const std::string& file) {
    if (file == "-") draft.only_as_text = "with -f - the page itself is on standard output";
  };
  add_command(app, draft, words, draft.options.report, commands::report,
              [note_file](Binder& bind, commands::ReportOptions& options) {
                bind_report(bind, options);
                bind.check([&options, note_file]() -> std::optional<Error> {
                  note_file(options.file);
                  if (options.interactive && options.file.empty()) {
                    return usage("--interactive is about the page", "add -f FILE.html");
                  }
                  return std::nullopt;
                });
              });
}

constexpr auto stop_modes = enum_table<catalogue::StopMode>(
    {{"decelerate", catalogue::StopMode::decelerate}, {"instant", catalogue::StopMode::instant}});

void bind_remote_start(Binder& bind, commands::RemoteStartOptions& options) {
  bind.option("--for", "DURATION", options.limit, to_duration, "stop after this time");
  bind.option("--preset", "N", options.preset, "select this preset first")->group(of_start_action);
  bind.option("--direction", "D", options.direction, "select this direction first")
      ->group(of_start_action);
  bind.option("--speed", "SPEED", options.speed,
              "how fast, in the unit of the profile: 500 (r/min), 25.5 (Hz)")
      ->group(of_motors);
  bind.flag("--reverse", options.direction_of_motor, catalogue::Direction::reverse,
            "turn the motor the other way round")
      ->group(of_motors);
  bind.option("--stop", "HOW", options.stop, one_of(stop_modes), "decelerate (default) or instant")
      ->group(of_motors);
  bind.option("--operation", "N", options.operation, NumberFrom{0, 0xFFFF},
              "operation data to set and run (default: those of the profile)")
      ->group(of_command_word);
  bind.option("--acceleration", "SECONDS", options.acceleration, "time to reach the speed")
      ->group(of_command_word);
  bind.option("--deceleration", "SECONDS", options.deceleration, "time to stand still")
      ->group(of_command_word);
  bind.option("--watchdog", "DURATION", options.watchdog, to_duration,
              "let the driver itself stop when it hears nothing for so long")
      ->group(of_command_word);
  bind.flag("--accept-unverified", options.acceptance, commands::Acceptance::unverified,
            accept_unverified_words);
}

void add_remote_start(CLI::App& app, ParseState& draft) {
  constexpr Words words = {
      "remote-start", "[TARGET] [--preset N] [--direction D] [--speed SPEED] [--for DURATION]",
      "start the tool under a guard that always ends in a stop; wait for the result",
      "spindle remote-start station3 --preset 2 --accept-unverified\n"
      "spindle remote-start station3 --for 2s --accept-unverified --yes --json\n"
      "spindle remote-start sim:doga-bm --preset 1 --accept-unverified --yes\n"
      "spindle remote-start conveyor1 --speed 500 --for 2s --watchdog 1s"};
  add_command(app, draft, words, draft.options.remote_start,
              with_words<commands::RemoteStartOptions>("remote-start", commands::OtherWords::none,
                                                       commands::remote_start),
              [&draft](Binder& bind, Worded<commands::RemoteStartOptions>& worded) {
                bind_words(bind, draft, worded, "tool name or URL");
                bind_remote_start(bind, worded.options);
              });
}

void add_remote_stop(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"remote-stop",
                           "[TARGET...]",
                           "stop now; never asks",
                           "spindle remote-stop station3\n"
                           "spindle remote-stop @line1\n"
                           "spindle remote-stop 'rtu:///dev/ttyUSB0?unit=0' --profile "
                           "orientalmotor-blv --broadcast",
                           nullptr,
                           Invocation::ToolsFile::salvaged};
  add_command(app, draft, words, draft.options.remote_stop,
              with_words<commands::RemoteStopOptions>("remote-stop", commands::OtherWords::none,
                                                      commands::remote_stop),
              [&draft](Binder& bind, Worded<commands::RemoteStopOptions>& worded) {
                commands::RemoteStopOptions& options = worded.options;
                bind_words(bind, draft, worded, target_words);
                bind.option("--stop", "HOW", options.stop, one_of(stop_modes),
                            "how a motor stops: decelerate (default) or instant");
                bind.flag("--broadcast", options.addressing, commands::Addressing::broadcast,
                          "every unit on the serial line (unit=0): sent, not acknowledged");
              });
}

void add_alarms(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"alarms", "[TARGET...] [--reset]",
                           "present alarm and last error, with meaning and remedy",
                           "spindle alarms sim:doga-bm\n"
                           "spindle alarms @line1\n"
                           "spindle alarms station3 --reset --accept-unverified"};
  add_command(
      app, draft, words, draft.options.alarms,
      with_words<commands::AlarmsOptions>("alarms", commands::OtherWords::none, commands::alarms),
      [&draft](Binder& bind, Worded<commands::AlarmsOptions>& worded) {
        commands::AlarmsOptions& options = worded.options;
        bind_words(bind, draft, worded, target_words);
        bind_columns(bind, draft);
        bind.flag("--reset", options.reset, commands::AlarmReset::yes,
                  "also reset the present alarm");
        bind.flag("--accept-unverified", options.acceptance, commands::Acceptance::unverified,
                  accept_unverified_words);
        bind_jobs(bind, options.jobs);
      });
}

void add_backup(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"backup", "[TARGET...] [-f FILE|-] [--dir FOLDER]",
                           "every stored parameter into a file that people can read and git can "
                           "compare",
                           "spindle backup station3\n"
                           "spindle backup station3 -f before-the-change.yaml\n"
                           "spindle backup @line1 --dir backups --force"};
  const auto note_file = [&draft](const std::string& file) {
    if (file == "-") draft.only_as_text = "with -f - the backup itself is on standard output";
  };
  add_command(
      app, draft, words, draft.options.backup,
      with_words<commands::BackupOptions>("backup", commands::OtherWords::none, commands::backup),
      [&draft, note_file](Binder& bind, Worded<commands::BackupOptions>& worded) {
        commands::BackupOptions& options = worded.options;
        bind_words(bind, draft, worded, target_words);
        bind.option("-f,--file", "FILE", options.file,
                    "where to (default TARGET.yaml in the present folder); - is standard "
                    "output")
            ->each(note_file);
        bind.option("--dir", "FOLDER", options.folder,
                    "one file TARGET.yaml a tool in this folder");
        bind.flag("--force", options.overwrite, Overwrite::allow, "replace files that are there");
        bind.flag("--include-secrets", options.secrets, commands::Secrets::include,
                  "also what the profile marks as secret");
        bind_jobs(bind, options.jobs);
      });
}

/// Beside --dir no second side and no FILE is named, so what stands there is the first NAME. Else
/// it is needed.
std::optional<Error> make_name_of(std::string_view argument, std::string& typed,
                                  const std::string& folder, std::vector<std::string>& names,
                                  std::string_view command) {
  if (folder.empty()) {
    return typed.empty() ? std::optional(Binder::missing(command, argument)) : std::nullopt;
  }
  if (!typed.empty()) names.insert(names.begin(), std::exchange(typed, {}));
  return std::nullopt;
}

void add_dump(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"dump", "[TARGET] FILE [--registers 0..999]",
                           "raw registers into a file that diff can compare",
                           "spindle dump station3 monday.yaml\n"
                           "spindle dump tcp://192.168.10.40 unknown.yaml --registers 0..999\n"
                           "spindle dump station3 - --registers 3200..3213 --table input"};
  const auto note_file = [&draft](const std::string& file) {
    if (file == "-") draft.only_as_text = "with - the dump itself is on standard output";
  };
  const auto run = [](const DumpArguments& arguments, Context& context) {
    commands::DumpOptions options = arguments.options;
    options.registers = arguments.registers.span();
    options.table = arguments.registers.table;
    return commands::dump(options, context);
  };
  add_command(
      app, draft, words, draft.options.dump,
      with_words<DumpArguments>("dump", commands::OtherWords::names, run),
      [&draft, note_file](Binder& bind, WordedDump& worded) {
        DumpArguments& arguments = worded.options;
        commands::DumpOptions& options = arguments.options;
        bind_words(bind, draft, worded, "the tool, and FILE: where to; - is standard output");
        bind.check([&worded, note_file]() -> std::optional<Error> {
          if (!worded.typed.words.empty()) note_file(worded.typed.words.back());
          return std::nullopt;
        });
        bind_registers(bind, arguments.registers,
                       "which (default: all that the profile knows, of every table)");
        bind.option("--pause", "DURATION", options.pause, to_duration,
                    "between two requests (default 20ms)");
        bind.flag("--force", options.overwrite, Overwrite::allow, "replace a file that is there");
        bind.flag("--include-secrets", options.secrets, commands::Secrets::include,
                  "also what the profile marks as secret");
      });
}

void add_diff(CLI::App& app, ParseState& draft) {
  constexpr Words words = {
      "diff", "A {B|--dir FOLDER} [NAME|PATTERN...] [--ignore PATTERN]",
      "compare tools, backup files and defaults by parameter name, and dumps by "
      "register",
      "spindle diff station3 station3.yaml\n"
      "spindle diff monday.yaml friday.yaml 'preset.*' --json\n"
      "spindle diff station3 station4 --ignore 'preset.1.*'\n"
      "spindle diff station3 dump.yaml\n"
      "spindle diff @line1 --dir backups"};
  add_command(app, draft, words, draft.options.diff, commands::diff,
              [&draft](Binder& bind, commands::DiffOptions& options) {
                bind_columns(bind, draft);
                bind.required("A", options.a,
                              "tool, backup or dump file, or 'defaults'; with --dir also @group");
                bind.argument("B", options.b, "tool, backup or dump file, or 'defaults'");
                bind.argument("NAME", options.patterns, "compare only these");
                bind.repeatable("--ignore", "PATTERN", options.ignored,
                                "leave these out, repeatable");
                bind.option("--dir", "FOLDER", options.folder,
                            "compare each tool with its own backup in this folder, as backup "
                            "--dir writes it");
                bind_jobs(bind, options.jobs);
                bind.check([&options] {
                  return make_name_of("B", options.b, options.folder, options.patterns, "diff");
                });
              });
}

void add_restore(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"restore", "[TARGET...] {FILE|--dir FOLDER} [NAME|PATTERN...]",
                           "plan, confirm, write what differs, verify; put back if it fails",
                           "spindle restore station3 station3.yaml --dry-run\n"
                           "spindle restore station3 station3.yaml 'preset.1.*'\n"
                           "spindle restore station3 old-tool.yaml --yes --json\n"
                           "spindle restore @line1 --dir backups"};
  add_command(app, draft, words, draft.options.restore,
              with_words<commands::RestoreOptions>("restore", commands::OtherWords::names,
                                                   commands::restore),
              [&draft](Binder& bind, Worded<commands::RestoreOptions>& worded) {
                commands::RestoreOptions& options = worded.options;
                bind_words(bind, draft, worded,
                           "the tool (with --dir tools and @groups), the backup FILE, and names or "
                           "patterns: restore only these");
                bind.option("--dir", "FOLDER", options.folder,
                            "restore each tool from its own backup in this folder, as backup "
                            "--dir writes it");
                bind.flag("-n,--dry-run", options.execution, commands::Execution::dry_run,
                          "show the plan, write nothing");
                bind.flag("--force", options.model, commands::ModelCheck::off,
                          "also to a tool of another model");
                bind.flag("--no-rollback", options.on_failure, commands::OnFailure::leave,
                          "leave what was written when something fails");
                bind.flag("--save", options.storing, commands::Storing::yes, save_words);
                bind_jobs(bind, options.jobs);
              });
}

/// How long Configuration may take in a simulated driver.
Result<Duration> to_busy(std::string_view option, const std::string& text) {
  constexpr Duration longest = std::chrono::seconds(1);
  const auto busy = to_duration(option, text);
  if (!busy || *busy <= longest) return busy;
  return tl::unexpected(
      bad_option(option, fmt::format("'{}' is too long", text), "Configuration takes 1s or less"));
}

/// Of the line and the trouble of a simulated tool.
void bind_simulated_line(Binder& bind, commands::SimulateOptions& options) {
  bind.option("--units", "LIST", options.tool.units, to_units,
              "serial tools: which units, such as 1-3");
  bind.option("--baud", "N", options.tool.baud, NumberFrom{1, 4'000'000},
              "serial tools: rate of the line");
  bind.flag("--no-gap", options.gaps, sim::LineModel::Gaps::ignored,
            "serial tools: also hear clients that keep too short a silence");
  bind.repeatable("--fault", "FAULT", options.faults, "make the tool misbehave, repeatable");
  bind.option("--busy", "DURATION", options.tool.busy, to_busy,
              "how long Configuration takes (default 200ms, at most 1s)")
      ->group(of_command_word);
  bind.repeatable("--alarm", "CODE", options.alarms,
                  "an alarm that the tool raises, such as 30h, or 30h@5s after a time; repeatable")
      ->group(of_alarms);
  bind.repeatable("--warning", "CODE", options.warnings, "a warning in the same form")
      ->group(of_alarms);
}

/// Of its identity and its operator.
void bind_simulated_work(Binder& bind, sim::DeviceOptions& bm) {
  bind.option("--identity-bytes", "N", bm.identity_bytes, NumberFrom{0, 255},
              "length of the identity: 12, 13 or 17")
      ->group(of_identity);
  bind.option("--firmware", "N", bm.firmware, NumberFrom{0, 0xFFFF}, "firmware number to report")
      ->group(of_identity);
  bind.option("--serial", "N", bm.serial, NumberFrom{0, 0xFFFF'FFFF}, "serial number to report")
      ->group(of_identity);
  bind.option("--model", "N", bm.tool_model, NumberFrom{0, 0xFFFF}, "tool model code to report")
      ->group(of_identity);
  bind.option("--rundown-every", "DURATION", bm.rundown_every, to_duration,
              "an operator who drives a screw at this interval (default: no operator)")
      ->group(of_screwdrivers);
  const auto* every = bind.option("--ng-every", "N", bm.ng_every, NumberFrom{0, 1'000'000},
                                  "every so many of the operator's screws end NG")
                          ->group(of_screwdrivers);
  const auto* burst =
      bind.option("--burst", "N", bm.burst, NumberFrom{0, 10'000},
                  "results that each of the operator's screws brings, all at once (default 1)")
          ->group(of_screwdrivers);
  bind.option("--event-number", "N", bm.event_number, NumberFrom{0, 0xFFFF},
              "number of the last event, which the next one counts on from")
      ->group(of_screwdrivers);
  bind.check([every, burst, &bm]() -> std::optional<Error> {
    const bool work_is_described = every->count() > 0 || burst->count() > 0;
    if (work_is_described && !bm.rundown_every) {
      return usage("--ng-every and --burst need --rundown-every",
                   "add for example --rundown-every 5s");
    }
    if (bm.burst == 0) return usage("--burst 0 would be no result", "it takes 1 or more");
    return std::nullopt;
  });
}

void add_simulate(CLI::App& app, ParseState& draft) {
  constexpr Words words = {
      "simulate", "PROFILE [--listen URL]",
      "a simulated tool to learn on, script against and test with",
      "spindle simulate doga-bm\n"
      "spindle simulate doga-bm --listen tcp://127.0.0.1:5000 -v\n"
      "spindle simulate doga-bm --rundown-every 3s --ng-every 5\n"
      "spindle simulate doga-bm --fault late=1500ms@every:10 --fault split=3\n"
      "spindle simulate doga-bm --rundown-every 2s --outage roam=5s@every:30s\n"
      "spindle simulate doga-gen2 --rundown-every 5s",
      trouble_words};
  add_command(app, draft, words, draft.options.simulate, commands::simulate,
              [](Binder& bind, commands::SimulateOptions& options) {
                bind.required("PROFILE", options.profile, "what to simulate, such as doga-bm");
                bind.option("--listen", "URL", options.listen,
                            "where to listen (default a free port of 127.0.0.1)");
                bind.option("--pty", "PATH", options.pty,
                            "serial tools: make a pseudo terminal that this path leads to; it has "
                            "no parity, so a wrong one goes unnoticed");
                bind_simulated_line(bind, options);
                bind_simulated_work(bind, options.tool.bm);
                bind.repeatable("--outage", "OUTAGE", options.outages,
                                "let the tool be away at times, repeatable");
              });
}

std::string profile_new_words() {
  return "The table has a header: register (or address), name, type, scale, unit, access,\n"
         "description, table and evidence, in any order; register alone is needed. Fields are\n"
         "separated by commas, semicolons or tabs. Rows that cannot be read are told and left "
         "out.\n"
         "Where no column says it, the evidence is 'inferred': check each entry before you rely "
         "on\n"
         "it.\n";
}

void add_profile_commands(CLI::App& profile, ParseState& draft) {
  using Options = commands::ProfileNameOptions;
  const auto list = [](const Options&, Context& context) {
    return commands::profile_list(context);
  };
  const auto bind_name = [](Binder& bind, Options& options) {
    bind.required("PROFILE", options.profile, "name or file");
  };
  add_command(profile, draft,
              {"list", "", "all profiles that can be named", "spindle profile list"},
              draft.options.profile_list, list,
              [&draft](Binder& bind, Options&) { bind_columns(bind, draft); });
  add_command(profile, draft,
              {"show", "PROFILE", "everything that a profile says", "spindle profile show doga-bm"},
              draft.options.profile_show, commands::profile_show, bind_name);
  add_command(profile, draft,
              {"check", "PROFILE", "every fault of a file, with its place",
               "spindle profile check ./my-tool.yaml"},
              draft.options.profile_check, commands::profile_check, bind_name);
  const auto bind_new = [](Binder& bind, commands::ProfileNewOptions& options) {
    bind.required("NAME", options.name, "of the profile; the file is NAME.yaml");
    bind.option("--from", "FILE", options.map,
                "table of registers (CSV) whose rows become parameters");
    bind.option("--numbering", "NUMBERING", options.numbering, one_of(files::numbering_words),
                "what its register numbers are: addresses, or modicon (40001)");
  };
  add_command(profile, draft,
              {"new", "NAME [--from MAP.csv]", "write the file of a new profile, to be completed",
               "spindle profile new my-tool\nspindle profile new my-tool --from registers.csv",
               profile_new_words},
              draft.options.profile_new, commands::profile_new, bind_new);
}

void add_profile(CLI::App& app, ParseState& draft) {
  using Options = commands::ProfileNameOptions;
  constexpr Words words = {"profile", "list|show|check|new [PROFILE]",
                           "the catalogue files: which exist, what they say, whether one is valid",
                           "spindle profile list\n"
                           "spindle profile show doga-bm\n"
                           "spindle profile check ./my-tool.yaml\n"
                           "spindle profile new my-tool --from registers.csv"};
  const auto none = [](const Options&, Context&) -> Result<Outcome> {
    return tl::unexpected(Binder::missing("profile", "list, show, check or new"));
  };
  add_command(app, draft, words, draft.options.profile, none,
              [&draft](Binder& bind, Options&) { add_profile_commands(bind.command(), draft); });
}

void add_tools_commands(CLI::App& tools, ParseState& draft) {
  constexpr auto not_read = Invocation::ToolsFile::only_found;
  constexpr std::string_view dry_run_words = "say what would be written, write nothing";
  add_command(tools, draft,
              {"add", "NAME URL", "add a tool to the tools file, and ask it who it is first",
               "spindle tools add station3 tcp://192.168.10.23:5000\n"
               "spindle tools add station4 192.168.10.24 --profile doga-bmt --torque-unit N.m\n"
               "spindle tools add conveyor1 '/dev/ttyUSB0?unit=3' --profile orientalmotor-blv\n"
               "spindle tools add station5 tcp://192.168.10.25:5000 --offline",
               nullptr, not_read},
              draft.options.tools_add, commands::add_tool,
              [dry_run_words](Binder& bind, commands::ToolAddOptions& options) {
                bind.required("NAME", options.name, "by which it is told about from now on");
                bind.required("URL", options.url, "where it is: a URL, an address or a port");
                bind.option("--torque-unit", "UNIT", options.torque_unit,
                            "the unit that is set on the tool, such as N.m");
                bind.flag("--offline", options.asking, commands::Asking::offline,
                          "ask nothing; for a tool that is not there yet");
                bind.flag("-n,--dry-run", options.execution, commands::Execution::dry_run,
                          dry_run_words);
              });
  add_command(tools, draft,
              {"init", "", "write a tools file to begin with",
               "spindle tools init\nspindle tools init --tools ./spindle.yaml", nullptr, not_read},
              draft.options.tools_init, commands::init_tools,
              [dry_run_words](Binder& bind, commands::ToolsInitOptions& options) {
                bind.flag("-n,--dry-run", options.execution, commands::Execution::dry_run,
                          dry_run_words);
              });
  add_command(tools, draft,
              {"test", "[TARGET...]", "ask every tool who it is, and compare with the tools file",
               "spindle tools test\nspindle tools test @line1 --json", nullptr,
               Invocation::ToolsFile::all_tools},
              draft.options.tools_test, commands::test_tools,
              [](Binder& bind, commands::ToolsTestOptions& options) {
                bind.argument("TARGET", options.targets, "tools (default: all of the tools file)");
                bind_jobs(bind, options.jobs);
              });
}

void add_tools(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"tools", "[--check|add|init|test]",
                           "the named tools of the tools file: list, add, ask each of them",
                           "spindle tools\n"
                           "spindle tools add station3 tcp://192.168.10.23:5000\n"
                           "spindle tools test\n"
                           "spindle tools --check --tools ./spindle.yaml"};
  const auto run = [](bool check, Context& context) {
    return check ? commands::check_tools(context) : commands::tools(context);
  };
  add_command(app, draft, words, draft.options.check_tools, run,
              [&draft](Binder& bind, bool& check) {
                const auto check_file = [&draft, &check] {
                  check = true;
                  draft.tools_file = Invocation::ToolsFile::only_found;
                };
                bind.flag("--check", check_file, "every fault of the file, with its place");
                bind_columns(bind, draft);
                add_tools_commands(bind.command(), draft);
              });
}

constexpr std::string_view store_words =
    "the store (default events.db in the user's folder of state)";

std::string results_words() {
  return "Nothing is asked of a tool: results are those that 'spindle record' stored. TARGET is "
         "the "
         "name\n"
         "that a tool had then; without one all of the store is meant. Times (--since, --until, "
         "and\n"
         "--before of store trim):\n"
         "  now, today, yesterday       and 'yesterday 14:00'\n"
         "  30min, 2h, 3d, 2w           before now\n"
         "  14:00, 2026-11-30           in the zone of this computer; a day is its beginning\n"
         "  2026-11-30T14:00:00Z        ISO 8601, with or without a zone\n"
         "\n"
         "A terminal shows the newest 100 events of a store that was not asked for anything\n"
         "particular, in its own time; what is piped is everything, in UTC. CSV has every field "
         "and\n"
         "its unit. With --qdas each tool, preset and settings of it is a file of its own; what "
         "did "
         "not\n"
         "come to its end is marked as not to be evaluated.\n";
}

/// Kinds that no event has, and what does not go together.
std::optional<Error> check_results(const commands::ResultsOptions& options) {
  const std::vector<std::string> known = catalogue::event_kind_words.words();
  for (const std::string& kind : options.filter.kinds) {
    if (std::find(known.begin(), known.end(), kind) == known.end()) {
      return unknown_choice("--kind", kind, known);
    }
  }
  if (!options.curve.empty() &&
      (!options.qdas.empty() || options.following == commands::Following::yes)) {
    return usage("--curve shows one result that is stored", "leave --qdas and --follow out");
  }
  if (options.qdas.empty()) return std::nullopt;
  if (options.following == commands::Following::yes) {
    return usage("--qdas and --follow exclude each other", "leave one of them out");
  }
  if (options.told == commands::Told::results) return std::nullopt;
  return usage("--qdas writes results and nothing else", "leave --gaps and --all out");
}

void bind_results(Binder& bind, commands::ResultsOptions& options) {
  commands::ResultFilter& filter = options.filter;
  bind.argument("TARGET", filter.targets, "tool names or @groups; default: all of the store");
  bind.option("--since", "TIME", filter.since, "from this time on");
  bind.option("--until", "TIME", filter.until, "before this time");
  bind.repeatable("--tool", "NAME|SERIAL", filter.tools,
                  "the same tool at every place where it was");
  bind.option("--preset", "N", filter.preset, NumberFrom{0, 65'535}, "made with this preset");
  bind.repeatable("--kind", "KIND", filter.kinds,
                  fmt::format("of this kind: {}", catalogue::event_kind_words.alternatives()));
  bind.flag(
      "--ng", [&filter] { filter.kinds.emplace_back("fastening-ng"); },
      "the same as --kind fastening-ng");
  bind.option("--key", "SERIAL/EPOCH/NUMBER", filter.key, "the one result of this name");
  bind.flag("--gaps", options.told, commands::Told::gaps, "what was missed, and nothing else");
  bind.flag("--all", options.told, commands::Told::all,
            "also links, changes, totals, and what the recorder did");
  bind.option("-c,--count", "N", options.count, NumberFrom{1, 1'000'000'000}, "the newest so many");
  bind.flag("-f,--follow", options.following, commands::Following::yes,
            "go on with what is stored from now on");
  bind.option("--qdas", "FOLDER", options.qdas, "write files for Q-DAS (.dfq) into this folder");
  bind.option("--curve", "KEY", options.curve,
              "the curves of one result, SERIAL/EPOCH/NUMBER; with -o svg drawn");
  bind.flag("--force", options.overwrite, Overwrite::allow, "replace files that are there");
  bind.option("--store", "FILE", options.store, store_words);
  bind.check([&options] { return check_results(options); });
}

void add_results(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"results", "[TARGET...] [--since TIME]",
                           "what was recorded: as a table, JSON Lines, CSV or files for Q-DAS",
                           "spindle results --since today\n"
                           "spindle results station3 --since '2026-11-30 14:00' --ng\n"
                           "spindle results @line1 --since 30d -o csv\n"
                           "spindle results --follow --json\n"
                           "spindle results station3 --qdas quality\n"
                           "spindle results --curve 2401190042/0/1962 -o svg > curve.svg",
                           results_words};
  add_command(app, draft, words, draft.options.results, commands::results,
              [&draft](Binder& bind, commands::ResultsOptions& options) {
                bind_results(bind, options);
                bind_columns(bind, draft);
              });
}

void add_store_commands(CLI::App& store, ParseState& draft) {
  constexpr auto no_tools = Invocation::ToolsFile::only_found;
  const auto bind_store = [](Binder& bind, auto& options) {
    bind.option("--store", "FILE", options.store, store_words);
  };
  add_command(store, draft,
              {"check", "", "whether every number is a row or in a gap, and the store whole",
               "spindle store check\nspindle store check --json", nullptr, no_tools},
              draft.options.store_check, commands::check_store, bind_store);
  add_command(store, draft,
              {"trim", "--before TIME", "remove what is older; asks",
               "spindle store trim --before 90d\nspindle store trim --before 2026-01-01 --yes",
               nullptr, no_tools},
              draft.options.store_trim, commands::trim_store,
              [bind_store](Binder& bind, commands::TrimOptions& options) {
                bind.option("--before", "TIME", options.before, "what is older than this");
                bind_store(bind, options);
                bind.check([&options]() -> std::optional<Error> {
                  if (!options.before.empty()) return std::nullopt;
                  return usage("store trim: --before is missing",
                               "say what is too old: --before 90d");
                });
              });
  const auto bind_force = [](Binder& bind, commands::CopyOptions& options) {
    bind.flag("--force", options.overwrite, Overwrite::allow, "replace a file that is there");
  };
  add_command(store, draft,
              {"backup", "FILE", "a whole copy, also while results are recorded",
               "spindle store backup monday.db", nullptr, no_tools},
              draft.options.store_backup, commands::backup_store,
              [bind_store, bind_force](Binder& bind, commands::CopyOptions& options) {
                bind.required("FILE", options.file, "where to");
                bind_force(bind, options);
                bind_store(bind, options);
              });
  add_command(store, draft,
              {"sinks", "", "who is served from the store, and how much still waits for each",
               "spindle store sinks\nspindle store sinks --json", nullptr, no_tools},
              draft.options.store_sinks, commands::list_sinks, bind_store);
  add_command(store, draft,
              {"forget", "SINK", "give a sink up, so that it holds back no trim; asks",
               "spindle store forget old-broker", nullptr, no_tools},
              draft.options.store_forget, commands::forget_sink,
              [bind_store](Binder& bind, commands::ForgetOptions& options) {
                bind.required("SINK", options.sink, "its name, as store sinks shows it");
                bind_store(bind, options);
              });
  add_command(store, draft,
              {"export", "[FILE]", "everything in the store as JSON Lines",
               "spindle store export events.jsonl\nspindle store export - --store monday.db",
               nullptr, no_tools},
              draft.options.store_export, commands::export_store,
              [bind_store, bind_force](Binder& bind, commands::CopyOptions& options) {
                bind.argument("FILE", options.file, "where to; - is standard output (the default)");
                bind_force(bind, options);
                bind_store(bind, options);
              });
}

void add_store(CLI::App& app, ParseState& draft) {
  using Options = commands::StoreOptions;
  constexpr Words words = {"store", "check|trim|backup|export|sinks|forget [FILE|SINK]",
                           "the completeness and the care of what was recorded",
                           "spindle store check\n"
                           "spindle store trim --before 90d\n"
                           "spindle store backup monday.db\n"
                           "spindle store export events.jsonl"};
  const auto none = [](const Options&, Context&) -> Result<Outcome> {
    return tl::unexpected(Binder::missing("store", "check, trim, backup, export, sinks or forget"));
  };
  add_command(app, draft, words, draft.options.store, none,
              [&draft](Binder& bind, Options&) { add_store_commands(bind.command(), draft); });
}

void add_log(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"log", "[TARGET...] [NAME|PATTERN...]",
                           "what was changed on which tool, when, and how it ended",
                           "spindle log\n"
                           "spindle log station3 --since 7d\n"
                           "spindle log '*.target-torque' --json"};
  add_command(app, draft, words, draft.options.log, commands::log,
              [&draft](Binder& bind, commands::LogOptions& options) {
                bind_columns(bind, draft);
                bind.argument("TARGET", options.arguments,
                              "tools, groups, serial numbers, names or patterns of parameters");
                bind.option("--since", "TIME", options.since, "from this time on");
                bind.option("-c,--count", "N", options.count, NumberFrom{1, 1'000'000'000},
                            "the newest so many");
              });
}

void add_undo(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"undo", "[ID]",
                           "take back what a command changed, if the tool still holds it",
                           "spindle undo\n"
                           "spindle undo 3f2a91c0 --dry-run"};
  add_command(app, draft, words, draft.options.undo, commands::undo,
              [&draft](Binder& bind, commands::UndoOptions& options) {
                draft.takes_default = true;  // the record names tools
                bind.argument("ID", options.id,
                              "of a change or a command, from 'spindle log' (default: the last)");
                bind.flag("-n,--dry-run", options.execution, commands::Execution::dry_run,
                          "check and show everything, write nothing");
              });
}

void add_use(CLI::App& app, ParseState& draft) {
  constexpr Words words = {"use", "[TARGET|-]", "the tool that is meant where none is named",
                           "spindle use station3\n"
                           "spindle use\n"
                           "spindle use -"};
  add_command(app, draft, words, draft.options.use, commands::use,
              [](Binder& bind, commands::UseOptions& options) {
                bind.argument("TARGET", options.target,
                              "tool name, @group or URL; - forgets it; none: show it");
                bind.flag("--clear", options.forget, commands::Forgetting::yes, "forget it");
                bind.check([&options]() -> std::optional<Error> {
                  if (options.target == "-") {
                    options.target.clear();
                    options.forget = commands::Forgetting::yes;
                  }
                  const bool is_both =
                      !options.target.empty() && options.forget == commands::Forgetting::yes;
                  if (!is_both) return std::nullopt;
                  return usage("use: --clear forgets the default, and a TARGET makes one",
                               "leave one of them out");
                });
              });
}

/// These two are the options of the same names, as people type them; invocation_of() sees to it.
void add_help(CLI::App& app, ParseState& draft) {
  constexpr Words words = {help_command,
                           "[COMMAND]",
                           "what there is, or how one command is used",
                           "spindle help\nspindle help set\nspindle help store trim",
                           nullptr,
                           Invocation::ToolsFile::only_found};
  const auto none = [](const auto&, Context&) -> Result<Outcome> { return Outcome(); };
  add_command(app, draft, words, draft.options.helped, none,
              [](Binder& bind, std::vector<std::string>& command) {
                bind.argument("COMMAND", command, "the command, and one below it");
              });
}

void add_version(CLI::App& app, ParseState& draft) {
  constexpr Words words = {version_command,
                           "",
                           "the version of the program and of its library",
                           "spindle version\nspindle version --json",
                           nullptr,
                           Invocation::ToolsFile::only_found};
  const auto none = [](const auto&, Context&) -> Result<Outcome> { return Outcome(); };
  add_command(app, draft, words, draft.options.none, none,
              [](Binder&, std::vector<std::string>&) {});
}

void build(CLI::App& app, ParseState& draft) {
  app.set_help_flag();
  app.allow_extras();
  app.require_subcommand(0, 1);
  add_common_options(app, draft);
  for (const auto add :
       {add_identify,     add_list,        add_get,    add_set,      add_do,      add_watch,
        add_record,       add_results,     add_report, add_store,    add_forward, add_serve,
        add_remote_start, add_remote_stop, add_alarms, add_backup,   add_dump,    add_diff,
        add_restore,      add_ping,        add_scan,   add_discover, add_learn,   add_simulate,
        add_profile,      add_tools,       add_log,    add_undo,     add_use,     add_help,
        add_version}) {
    add(app, draft);
  }
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

/// Long names of all options of a command and of the program itself.
std::vector<std::string> option_names(const CLI::App& app, const CLI::App* command) {
  std::vector<std::string> names;
  for (const CLI::App* level : {&app, command}) {
    if (level == nullptr) continue;
    for (const CLI::Option* known : level->get_options()) {
      for (const std::string& name : known->get_lnames()) names.push_back("--" + name);
    }
  }
  return names;
}

Error unknown_command(const std::string& name, const std::vector<std::string>& known) {
  std::string hint = suggestion(name, known);
  if (hint.empty()) hint = "'spindle --help' lists all commands";
  Error error = usage(fmt::format("unknown command '{}'", name), std::move(hint));
  error.remedy = remedy_for(name, known, "spindle --help");
  return error;
}

Error unexpected_argument(const CLI::App& app, const ParseState& draft, const std::string& extra) {
  const std::string command = draft.chosen == nullptr ? "" : path_of(draft.chosen);
  if (extra.size() > 1 && extra.front() == '-') {
    const std::string name = extra.substr(0, extra.find('='));
    const auto known = option_names(app, draft.chosen);
    const std::string help = fmt::format("spindle {}--help", command.empty() ? "" : command + " ");
    std::string hint = suggestion(name, known);
    if (hint.empty()) hint = fmt::format("'{}' lists all options", help);
    Error error = usage(fmt::format("unknown option '{}'", name), std::move(hint));
    error.remedy = remedy_for(name, known, help);
    return error;
  }
  if (draft.chosen == nullptr || !draft.chosen->get_subcommands({}).empty()) {
    return unknown_command(extra, command_names(draft.chosen == nullptr ? app : *draft.chosen));
  }
  return for_help(command, usage(fmt::format("{}: '{}' is one argument too many", command, extra)));
}

Error empty_value(const std::string& option) {
  return usage(option + ": its value is empty", "give it one, or leave the option out");
}

/// CLI11 can only fail on options without their value, or flags with one; everything else is ours.
Error parser_error(const std::vector<std::string>& arguments, const CLI::ParseError& error) {
  const std::string what = error.what();
  for (const std::string& argument : arguments) {
    const std::string name = argument.substr(0, argument.find('='));
    const std::string bare = name.substr(std::min(name.size(), name.find_first_not_of('-')));
    if (bare.empty() || bare == name || what.find(bare) == std::string::npos) continue;
    if (name.size() + 1 == argument.size()) return empty_value(name);
    if (name != argument)
      return usage(fmt::format("'{}' takes no value", name), fmt::format("write {} alone", name));
    return usage(fmt::format("'{}' needs a value", name), fmt::format("write {} VALUE", name));
  }
  return usage("an option has no value, or one that it does not take",
               "'spindle --help' lists all options");
}

OptionDescription description_of(const CLI::Option& known) {
  OptionDescription option{.meaning = known.get_description()};
  const std::string& group = known.get_group();
  if (group.starts_with(declared_prefix)) option.declared_by = group;
  for (const std::string& name : known.get_snames()) option.names.push_back("-" + name);
  for (const std::string& name : known.get_lnames()) option.names.push_back("--" + name);
  if (option.names.empty()) {
    option.names.push_back(known.get_name(true));
  } else if (known.get_expected_max() > 0) {
    option.placeholder = known.get_type_name();
  }
  return option;
}

std::vector<OptionDescription> options_of(const CLI::App& app) {
  std::vector<OptionDescription> options;
  for (const CLI::Option* known : app.get_options()) options.push_back(description_of(*known));
  return options;
}

std::vector<CommandDescription> commands_of(const CLI::App& app, const ParseState& draft) {
  std::vector<CommandDescription> commands;
  for (const CLI::App* command : app.get_subcommands({})) {
    const Words& words = draft.words.at(command);
    CommandDescription described{.name = path_of(command),
                                 .synopsis = std::string(words.synopsis),
                                 .meaning = std::string(words.meaning),
                                 .appendix = words.appendix,
                                 .options = options_of(*command),
                                 .commands = commands_of(*command, draft)};
    for (const auto example : split(words.examples, '\n')) described.examples.emplace_back(example);
    commands.push_back(std::move(described));
  }
  return commands;
}

Description description_of(const CLI::App& app, const ParseState& draft) {
  return {.common = options_of(app), .commands = commands_of(app, draft)};
}

bool is_chosen(const ParseState& draft, std::string_view name) {
  return draft.chosen != nullptr && path_of(draft.chosen) == name;
}

Result<std::string> help_of(const CLI::App& app, const ParseState& draft) {
  const Description description = describe_grammar();  // also of commands that are not typed
  std::string name = draft.chosen == nullptr ? std::string() : path_of(draft.chosen);
  if (is_chosen(draft, help_command) && !draft.help) {
    name = fmt::format("{}", fmt::join(draft.options.helped, " "));
  }
  if (name.empty()) return program_help(description);
  const CommandDescription* command = find_command(description, name);
  if (command == nullptr) return tl::unexpected(unknown_command(name, command_names(app)));
  return command_help(*command);
}

/// What nothing in the grammar takes.
std::optional<std::string> first_extra(const CLI::App& app) {
  for (std::string& extra : app.remaining(true)) {
    if (extra != end_of_options) return std::move(extra);
  }
  return std::nullopt;
}

/// An option whose value is empty, as behind a variable of a script that is not set. To go on as if
/// it were not there could leave a motor running without an end.
std::optional<std::string> option_without_value(const CLI::App& app) {
  const auto is_empty = [](const std::string& text) { return text.empty(); };
  for (const CLI::Option* known : app.get_options()) {
    const auto& values = known->results();
    if (known->nonpositional() && std::any_of(values.begin(), values.end(), is_empty)) {
      return known->get_name();
    }
  }
  for (const CLI::App* command : app.get_subcommands()) {
    if (auto found = option_without_value(*command)) return found;
  }
  return std::nullopt;
}

/// Whether one of the words that may be a target can only be told from the tools file. A URL says
/// itself where its tool is, and a stop that has one waits for no file. A command that takes no
/// words at all is about the file, and so may be one that was given none.
bool names_tools(const CLI::App& command, Invocation::ToolsFile use) {
  constexpr std::array<std::string_view, 6> targets = {"TARGET", "BUS",     "A",
                                                       "B",      "PATTERN", "SINK"};
  bool takes_words = false;
  bool takes_targets = false;
  bool has_words = false;
  for (const CLI::Option* known : command.get_options()) {
    const bool is_argument = known->get_positional();
    const auto& words = known->results();
    takes_words = takes_words || is_argument;
    has_words = has_words || (is_argument && !words.empty());
    const std::string kind = is_argument ? known->get_name(true) : known->get_type_name();
    if (std::find(targets.begin(), targets.end(), kind) == targets.end()) continue;
    takes_targets = takes_targets || is_argument;
    if (std::any_of(words.begin(), words.end(), files::may_name_tools)) return true;
  }
  const bool is_about_all = !has_words || !takes_targets;
  return !takes_words || (use == Invocation::ToolsFile::all_tools && is_about_all);
}

/// Whether the first word is a URL that is no name: then the tools file only tells whether others
/// are tools, too, and its faults keep no command from what it is asked for.
bool begins_with_url(const CLI::App& command) {
  for (const CLI::Option* known : command.get_options()) {
    const auto& words = known->results();
    if (!known->get_positional() || words.empty()) continue;
    return link::looks_like_url(words.front()) && !files::may_name_tools(words.front());
  }
  return false;
}

/// What of the tools file is read for the words of this command.
Invocation::ToolsFile tools_use_for(const CLI::App& command, const ParseState& draft,
                                    Invocation::ToolsFile use) {
  using ToolsFile = Invocation::ToolsFile;
  const bool may_be_default = draft.takes_default && !begins_with_url(command);
  if (!may_be_default && !names_tools(command, use)) return ToolsFile::only_found;
  const bool is_by_url = use == ToolsFile::loaded && draft.takes_default && !may_be_default;
  return is_by_url ? ToolsFile::salvaged : use;
}

Invocation telling(std::string text) {
  Invocation help;
  help.text = std::move(text);
  return help;
}

/// Where columns cannot be chosen, and where they have to be.
std::optional<Error> check_columns(const ParseState& draft) {
  using report::Format;
  const Format format = draft.invocation.format;
  const bool has_all = format == Format::json || format == Format::yaml || format == Format::svg;
  if (has_all && !draft.invocation.columns.empty()) {
    return usage("--columns is about tables, CSV and -o value", "JSON and YAML have every key");
  }
  const bool resets = draft.options.alarms.options.reset == commands::AlarmReset::yes;
  if (resets && (format == Format::value || !draft.invocation.columns.empty())) {
    return usage("--columns and -o value do not go with --reset", "leave one of them out");
  }
  if (format != Format::value || draft.has_columns || draft.chosen == nullptr) return std::nullopt;
  return usage(fmt::format("{} has no list of values", path_of(draft.chosen)),
               "-o value is for 'spindle get' and other lists; --json has every key");
}

Result<Invocation> invocation_of(const CLI::App& app, ParseState& draft) {
  const auto extra = first_extra(app);
  // Where a command is misspelt, the program's help would hide it.
  const bool misspelt = extra && draft.chosen == nullptr;
  if (draft.help && !misspelt) {
    return help_of(app, draft).map(telling);
  }
  const bool wants_version = (draft.version && !misspelt) || is_chosen(draft, version_command);
  if (extra && !wants_version) return tl::unexpected(unexpected_argument(app, draft, *extra));
  if (const auto empty = option_without_value(app)) {
    return tl::unexpected(empty_value(*empty));
  }
  if (auto fault = draft.common_faults.first()) return tl::unexpected(std::move(*fault));
  Invocation& invocation = draft.invocation;
  if (wants_version) {
    invocation.asks = Invocation::Asks::version;
    return std::move(invocation);
  }
  if (!draft.only_as_text.empty() && invocation.format != report::Format::table &&
      invocation.format != report::Format::wide) {
    return tl::unexpected(
        usage(draft.only_as_text, "leave out --json and --output, or name a file"));
  }
  if (invocation.format == report::Format::svg && draft.options.results.curve.empty()) {
    return tl::unexpected(usage("only 'spindle results --curve' draws",
                                "choose another --output: table, json or csv"));
  }
  if (auto fault = check_columns(draft)) return tl::unexpected(std::move(*fault));
  if (is_chosen(draft, help_command)) return help_of(app, draft).map(telling);
  if (draft.chosen == nullptr) {
    Error error = usage("no command is given", "'spindle --help' lists all commands");
    error.remedy.right = "spindle --help";
    return tl::unexpected(std::move(error));
  }
  invocation.user.format = invocation.format;
  invocation.tools_use = draft.tools_file.value_or(draft.words[draft.chosen].tools_file);
  // One that the user names is read all the same, so that a wrong name is told; but no stop waits
  // for it.
  const bool told = !invocation.common.tools_file.empty() &&
                    invocation.tools_use != Invocation::ToolsFile::salvaged;
  if (!told) {
    invocation.tools_use = tools_use_for(*draft.chosen, draft, invocation.tools_use);
  }
  return std::move(invocation);
}

/// --json is -o json, so that of several the last one wins.
std::vector<std::string> with_one_output_option(std::vector<std::string> arguments) {
  const auto end = std::find(arguments.begin(), arguments.end(), end_of_options);
  std::replace(arguments.begin(), end, std::string("--json"), std::string("--output=json"));
  return arguments;
}

/// Where `named` is there, only commands that it names are known; help is of all of them.
Result<Invocation> parse_words(ParseState& draft, const std::vector<std::string>& arguments) {
  CLI::App app;
  build(app, draft);
  try {
    auto words = with_one_output_option(arguments);
    std::reverse(words.begin(), words.end());  // as CLI11 wants them
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    return tl::unexpected(parser_error(arguments, error));
  }
  const bool tells = draft.help || is_chosen(draft, help_command);
  if (tells && draft.named != nullptr) return tl::unexpected(usage("help needs all commands"));
  return invocation_of(app, draft);
}

Result<Invocation> parse_with(const std::vector<std::string>* named,
                              const std::vector<std::string>& arguments) {
  const auto dashes = std::find(arguments.begin(), arguments.end(), end_of_options);
  if (dashes != arguments.end()) {
    ParseState draft;
    draft.named = named;
    draft.behind_dashes.assign(dashes + 1, arguments.end());
    auto invocation = parse_words(draft, {arguments.begin(), dashes});
    if (draft.takes_behind) return invocation;
  }
  ParseState draft;
  draft.named = named;
  return parse_words(draft, arguments);
}

}  // namespace

Description describe_grammar() {
  CLI::App app;
  ParseState draft;
  draft.extent = Extent::whole;
  build(app, draft);
  return description_of(app, draft);
}

Result<Invocation> parse(const std::vector<std::string>& arguments) {
  if (arguments.empty()) return telling(program_help(describe_grammar()));
  // The commands that nothing names are a good part of a short run; a fault may have to know them.
  auto invocation = parse_with(&arguments, arguments);
  return invocation ? std::move(invocation) : parse_with(nullptr, arguments);
}

report::Format wanted_format(const std::vector<std::string>& arguments) {
  std::string_view last = "table";
  for (std::size_t index = 0; index < arguments.size(); ++index) {
    const std::string_view argument = arguments[index];
    if (argument == end_of_options) break;
    const bool has_next = index + 1 < arguments.size();
    if (argument == "--json") last = "json";
    if (argument.starts_with("--output=")) last = argument.substr(argument.find('=') + 1);
    if (argument.starts_with("-o") && argument.size() > 2) last = argument.substr(2);
    if ((argument == "-o" || argument == "--output") && has_next) last = arguments[index + 1];
  }
  return format_words.find(last).value_or(report::Format::table);
}

}  // namespace spindle::cli
