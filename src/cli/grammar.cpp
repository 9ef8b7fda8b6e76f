#include "grammar.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "help.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/work/connect.hpp"
#include "version.hpp"

namespace spindle::cli {
namespace {

using commands::Context;
using commands::Outcome;
using Run = std::function<Result<Outcome>(Context&)>;

/// The common options as typed.
struct Typed {
  std::string output;
  std::string profile;
  std::string tools;
  std::string timeout;
  std::string connect_timeout;
  std::string retries;
  std::string color;
  std::string trace;
  bool json = false;
  bool yes = false;
  bool no_input = false;
  bool quiet = false;
  bool verbose = false;
  bool help = false;
  bool version = false;
};

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

/// The grammar while it is being parsed: the innermost command that was named.
struct Draft {
  Extent extent = Extent::as_named;
  Typed typed;
  std::map<const CLI::App*, Words> words;
  const CLI::App* chosen = nullptr;
  /// Instead of what the command's words say.
  std::optional<Invocation::ToolsFile> tools_file = std::nullopt;
  std::string only_as_text;  ///< why neither JSON nor CSV can be had; empty: they can
  Run run;
};

constexpr std::string_view end_of_options = "--";

Error usage(std::string message, std::string hint = {}) {
  return {.code = Errc::usage, .message = std::move(message), .hint = std::move(hint)};
}

Error missing(std::string_view command, std::string_view argument) {
  return usage(fmt::format("{}: {} is missing", command, argument),
               fmt::format("'spindle {} --help' shows examples", command));
}

Error bad_option(std::string_view option, std::string message, std::string hint) {
  Error error = usage(std::move(message), std::move(hint));
  error.code = Errc::bad_value;
  error.name = option;
  return error;
}

Result<std::uint64_t> to_number(std::string_view option, const std::string& text,
                                std::uint64_t minimum, std::uint64_t maximum) {
  const auto number = parse_unsigned(text, maximum);
  if (number && *number >= minimum) return *number;
  return tl::unexpected(
      bad_option(option, fmt::format("'{}' does not fit", text),
                 fmt::format("it takes a number from {} to {}", minimum, maximum)));
}

Result<std::optional<Duration>> to_duration(std::string_view option, const std::string& text) {
  if (text.empty()) return std::nullopt;
  auto duration = parse_duration(text);
  if (duration && *duration > Duration::zero()) return *duration;
  const std::string_view why = duration ? "is too short" : "is not a duration";
  return tl::unexpected(
      bad_option(option, fmt::format("'{}' {}", text, why), "write it like 500ms, 2.5s or 5min"));
}

/// One of a few words, with a suggestion for a misspelt one.
template <typename Choice, std::size_t count>
Result<Choice> to_choice(std::string_view option, const std::string& text,
                         const std::array<std::pair<std::string_view, Choice>, count>& choices) {
  std::vector<std::string> words;
  for (const auto& [word, choice] : choices) {
    if (word == text) return choice;
    words.emplace_back(word);
  }
  std::string hint = fmt::format("it takes {}", fmt::join(words, ", "));
  if (const std::string meant = suggestion(text, words); !meant.empty()) hint += "; " + meant;
  return tl::unexpected(bad_option(option, fmt::format("'{}' is unknown", text), std::move(hint)));
}

constexpr std::array<std::pair<std::string_view, report::Format>, 3> formats = {
    {{"table", report::Format::table},
     {"json", report::Format::json},
     {"csv", report::Format::csv}}};

constexpr std::array<std::pair<std::string_view, ColorChoice>, 3> colors = {
    {{"auto", ColorChoice::automatic},
     {"always", ColorChoice::always},
     {"never", ColorChoice::never}}};

CLI::Option* option(CLI::App* app, const std::string& names, std::string& into,
                    const std::string& placeholder, const std::string& meaning) {
  return app->add_option(names, into, meaning)
      ->type_name(placeholder)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
}

CLI::Option* flag(CLI::App* app, const std::string& names, bool& into, const std::string& meaning) {
  return app->add_flag(names, into, meaning)->disable_flag_override();
}

/// Of options that only some profiles declare: CLI11's groups say which.
constexpr std::string_view declared_prefix = "of ";
constexpr const char* of_start_action = "of the run model start-action";
constexpr const char* of_command_word = "of the run model command-word";
constexpr const char* of_motors = "of the run models command-word and command-register";
constexpr const char* of_identity = "of profiles with an identity";
constexpr const char* of_screwdrivers = "of profiles that count their results";
constexpr const char* of_alarms = "of profiles whose run names alarms and warnings";

void add_common_options(CLI::App& app, Typed& typed) {
  option(&app, "-o,--output", typed.output, "FORMAT", "table, json (JSON Lines) or csv");
  flag(&app, "--json", typed.json, "the same as -o json");
  option(&app, "--profile", typed.profile, "NAME|FILE", "what the tool's registers mean");
  option(&app, "--tools", typed.tools, "FILE", "file of named tools");
  option(&app, "--timeout", typed.timeout, "DURATION", "how long to wait for one answer");
  option(&app, "--connect-timeout", typed.connect_timeout, "DURATION",
         "how long to wait for the connection");
  option(&app, "--retries", typed.retries, "N", "how often a read without an answer is repeated");
  flag(&app, "-y,--yes", typed.yes, "answer every question with yes");
  flag(&app, "--no-input", typed.no_input, "never ask; what would have to be asked is refused");
  flag(&app, "-q,--quiet", typed.quiet, "no summary, notes and progress on stderr");
  flag(&app, "-v,--verbose", typed.verbose, "every frame and decision on stderr");
  option(&app, "--trace", typed.trace, "FILE", "every frame into a pcapng file for Wireshark");
  option(&app, "--color", typed.color, "WHEN", "auto, always or never");
  flag(&app, "-h,--help", typed.help, "show this help");
  flag(&app, "--version", typed.version, "show the version");
}

/// The tool that a command was wanted from, as typed; empty where it is none or several.
template <typename TypedOptions>
std::string asked_of(const TypedOptions& typed) {
  const auto is_group = [](const std::string& target) { return target.starts_with('@'); };
  if constexpr (requires { typed.options.target.size(); }) {
    return is_group(typed.options.target) ? std::string() : typed.options.target;
  }
  if constexpr (requires { typed.options.targets.front().size(); }) {
    const auto& targets = typed.options.targets;
    if (targets.size() == 1 && !is_group(targets.front())) return targets.front();
  }
  return {};
}

/// Adds a command whose options struct CLI11 fills while `make_run` turns it into the deed. The
/// options are copied into the run, because the grammar is gone when it runs. `add_options` adds
/// what may stand behind it.
template <typename Options, typename MakeRun, typename AddOptions>
void add_command(CLI::App& parent, Draft& draft, const Words& words, Options& options,
                 MakeRun make_run, AddOptions add_options) {
  CLI::App* command = parent.add_subcommand(std::string(words.name), std::string(words.meaning));
  command->fallthrough();
  command->set_help_flag();
  draft.words[command] = words;
  command->final_callback([&draft, &options, command, make_run] {
    if (draft.chosen != nullptr) return;  // a command below this one was named
    draft.chosen = command;
    draft.run = [typed = options, make_run](Context& context) -> Result<Outcome> {
      return make_run(typed, context).map_error([&](Error error) {
        if (error.asked_of.empty()) error.asked_of = asked_of(typed);
        return error;
      });
    };
  });
  if (draft.extent == Extent::whole) {
    add_options(command);
  } else {
    command->preparse_callback([command, add_options](std::size_t) { add_options(command); });
  }
}

/// The options as typed, command by command; what needs converting is text here.
struct TypedPing {
  commands::PingOptions options;
  std::string jobs;
  std::string count;
  std::string interval;
};
struct TypedSet {
  commands::SetOptions options;
  std::string jobs;
  bool dry_run = false;
  bool save = false;
  bool broadcast = false;
};
struct TypedGet {
  commands::GetOptions options;
  std::string jobs;
  bool limits = false;
};
struct TypedDo {
  commands::DoOptions options;
  std::string jobs;
  bool accept_unverified = false;
  bool broadcast = false;
};
struct TypedRemoteStart {
  commands::RemoteStartOptions options;
  std::string limit;
  std::string operation;
  std::string watchdog;
  std::string stop;
  bool reverse = false;
  bool accept_unverified = false;
};
struct TypedRemoteStop {
  commands::RemoteStopOptions options;
  std::string stop;
  bool broadcast = false;
};
struct TypedAlarms {
  commands::AlarmsOptions options;
  std::string jobs;
  bool reset = false;
  bool accept_unverified = false;
};
struct TypedWatch {
  commands::WatchOptions options;
  std::vector<std::string> arguments;
  std::string interval;
  std::string count;
  std::string duration;
  std::string idle_timeout;
  bool all = false;
  bool initial = false;
  bool no_push = false;
  bool no_reconnect = false;
};
struct TypedTools {
  bool check = false;
};
struct TypedScan {
  commands::ScanOptions options;
  std::string units;
};
struct TypedIdentify {
  commands::IdentifyOptions options;
  std::string jobs;
};
struct TypedBackup {
  commands::BackupOptions options;
  std::string jobs;
  bool force = false;
  bool include_secrets = false;
};
struct TypedDiff {
  commands::DiffOptions options;
  std::string jobs;
};
struct TypedRestore {
  commands::RestoreOptions options;
  std::string jobs;
  bool dry_run = false;
  bool force = false;
  bool no_rollback = false;
  bool save = false;
};
struct TypedSimulate {
  commands::SimulateOptions options;
  std::string units;
  std::string baud;
  bool no_gap = false;
  std::string identity_bytes;
  std::string firmware;
  std::string serial;
  std::string model;
  std::string rundown_every;
  std::string ng_every;
  std::string burst;
  std::string busy;
};

/// Everything that CLI11 writes into; must live as long as the parser.
struct TypedCommands {
  TypedIdentify identify;
  commands::ListOptions list;
  TypedGet get;
  TypedSet set;
  TypedDo perform;
  TypedPing ping;
  TypedScan scan;
  TypedWatch watch;
  TypedRemoteStart remote_start;
  TypedRemoteStop remote_stop;
  TypedAlarms alarms;
  TypedBackup backup;
  TypedDiff diff;
  TypedRestore restore;
  TypedSimulate simulate;
  TypedTools tools;
  commands::ProfileNameOptions profile;
  commands::ProfileNameOptions profile_list;
  commands::ProfileNameOptions profile_show;
  commands::ProfileNameOptions profile_check;
};

constexpr std::string_view target_words = "tool name, @group or URL";
constexpr std::string_view jobs_words = "how many tools at a time (default 64)";

Result<void> fill_jobs(const std::string& text, std::size_t& jobs) {
  if (text.empty()) return {};
  const auto number = to_number("--jobs", text, 1, 10'000);
  if (!number) return tl::unexpected(number.error());
  jobs = *number;
  return {};
}

void add_identify(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"identify", "TARGET...",
                           "who is there: maker, model, serial, firmware, profile",
                           "spindle identify sim:doga-bm\n"
                           "spindle identify tcp://192.168.10.23:5000\n"
                           "spindle identify station3 station4 --json"};
  const auto run = [](TypedIdentify identify, Context& context) -> Result<Outcome> {
    if (identify.options.targets.empty()) return tl::unexpected(missing("identify", "TARGET"));
    auto filled = fill_jobs(identify.jobs, identify.options.jobs);
    if (!filled) return tl::unexpected(std::move(filled.error()));
    return commands::identify(identify.options, context);
  };
  add_command(app, draft, words, typed.identify, run, [&typed](CLI::App* command) {
    command->add_option("TARGET", typed.identify.options.targets, std::string(target_words));
    option(command, "--jobs", typed.identify.jobs, "N", std::string(jobs_words));
  });
}

void add_list(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"list", "[TARGET] [PATTERN...]",
                           "the parameter catalogue, offline when --profile is given",
                           "spindle list --profile doga-bm\n"
                           "spindle list --profile doga-bm 'preset.1.*'\n"
                           "spindle list station3 '*torque*' --json"};
  add_command(app, draft, words, typed.list, commands::list, [&typed](CLI::App* command) {
    command->add_option("PATTERN", typed.list.arguments,
                        "names or patterns; a tool name or URL may stand before them");
  });
}

void add_get(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"get", "TARGET [NAME|PATTERN...]",
                           "read parameters by name, pattern, number (p242) or raw register "
                           "(@holding:2, @input:3204/i16)",
                           "spindle get sim:doga-bm 'preset.1.*torque*'\n"
                           "spindle get station3 status.ready status.alarm\n"
                           "spindle get @line1 'preset.1.*' --json\n"
                           "spindle get tcp://192.168.10.23:5000 @holding:2 @input:3204/i16"};
  const auto run = [](TypedGet get, Context& context) {
    if (get.options.target.empty())
      return Result<Outcome>(tl::unexpected(missing("get", "TARGET")));
    if (auto filled = fill_jobs(get.jobs, get.options.jobs); !filled)
      return Result<Outcome>(tl::unexpected(std::move(filled.error())));
    if (get.limits) get.options.limits = device::Limits::read;
    return commands::get(get.options, context);
  };
  add_command(app, draft, words, typed.get, run, [&typed](CLI::App* command) {
    command->add_option("TARGET", typed.get.options.target, std::string(target_words));
    command->add_option("NAME", typed.get.options.names, "names, patterns, numbers, raw registers");
    flag(command, "--limits", typed.get.limits, "also read the tool's own minimum and maximum");
    option(command, "--jobs", typed.get.jobs, "N", std::string(jobs_words));
  });
}

constexpr std::string_view save_words =
    "store it in the tool's non-volatile memory afterwards (BLV); asks";

constexpr std::string_view broadcast_words =
    "to everybody on the serial line (unit=0): sent, not acknowledged; asks";

void add_set(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"set", "TARGET NAME=VALUE...",
                           "check everything, show old and new, write only what differs, read back",
                           "spindle set sim:doga-bm preset.1.target-torque=2.80\n"
                           "spindle set station3 preset.1.mode=TC/AM preset.1.speed=900\n"
                           "spindle set station3 preset.2.target-torque=3.10 --dry-run\n"
                           "spindle set @line1 preset.1.target-torque=2.80\n"
                           "spindle set sim:orientalmotor-blv operation.2.speed=1200"};
  const auto run = [](TypedSet set, Context& context) {
    if (set.options.target.empty())
      return Result<Outcome>(tl::unexpected(missing("set", "TARGET")));
    if (set.options.assignments.empty())
      return Result<Outcome>(tl::unexpected(missing("set", "NAME=VALUE")));
    if (auto filled = fill_jobs(set.jobs, set.options.jobs); !filled)
      return Result<Outcome>(tl::unexpected(std::move(filled.error())));
    if (set.dry_run) set.options.execution = commands::Execution::dry_run;
    if (set.save) set.options.storing = commands::Storing::yes;
    if (set.broadcast) set.options.reach = commands::Reach::everybody;
    return commands::set(set.options, context);
  };
  add_command(app, draft, words, typed.set, run, [&typed](CLI::App* command) {
    command->add_option("TARGET", typed.set.options.target, std::string(target_words));
    command->add_option("NAME=VALUE", typed.set.options.assignments, "what to write");
    flag(command, "--dry-run", typed.set.dry_run, "check and show everything, write nothing");
    flag(command, "--save", typed.set.save, std::string(save_words));
    flag(command, "--broadcast", typed.set.broadcast, std::string(broadcast_words));
    option(command, "--jobs", typed.set.jobs, "N", std::string(jobs_words));
  });
}

void add_do(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"do", "TARGET [ACTION[=VALUE]...]",
                           "run actions of the catalogue; without one, list them",
                           "spindle do sim:doga-bm\n"
                           "spindle do sim:doga-bm select-preset=3 --accept-unverified --yes\n"
                           "spindle do station3 alarm-reset\n"
                           "spindle do @line1 lock=unlocked"};
  const auto run = [](TypedDo perform, Context& context) {
    if (perform.options.target.empty())
      return Result<Outcome>(tl::unexpected(missing("do", "TARGET")));
    if (auto filled = fill_jobs(perform.jobs, perform.options.jobs); !filled)
      return Result<Outcome>(tl::unexpected(std::move(filled.error())));
    if (perform.broadcast) perform.options.reach = commands::Reach::everybody;
    if (perform.accept_unverified) perform.options.acceptance = commands::Acceptance::unverified;
    return commands::perform(perform.options, context);
  };
  add_command(app, draft, words, typed.perform, run, [&typed](CLI::App* command) {
    command->add_option("TARGET", typed.perform.options.target, std::string(target_words));
    command->add_option("ACTION", typed.perform.options.actions,
                        "actions, with =VALUE where they take one");
    flag(command, "--accept-unverified", typed.perform.accept_unverified,
         "send what may move or lock the tool although its register is not certain");
    flag(command, "--broadcast", typed.perform.broadcast, std::string(broadcast_words));
    option(command, "--jobs", typed.perform.jobs, "N", std::string(jobs_words));
  });
}

Result<Outcome> run_ping(TypedPing ping, Context& context) {
  if (ping.options.target.empty()) return tl::unexpected(missing("ping", "TARGET"));
  if (auto filled = fill_jobs(ping.jobs, ping.options.jobs); !filled)
    return tl::unexpected(std::move(filled.error()));
  if (!ping.count.empty()) {
    const auto count = to_number("--count", ping.count, 1, 1'000'000);
    if (!count) return tl::unexpected(count.error());
    ping.options.count = static_cast<unsigned>(*count);
  }
  const auto interval = to_duration("--interval", ping.interval);
  if (!interval) return tl::unexpected(interval.error());
  ping.options.interval = interval->value_or(ping.options.interval);
  return commands::ping(ping.options, context);
}

void add_ping(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"ping", "TARGET [-c N]",
                           "round-trip statistics without touching any value",
                           "spindle ping sim:doga-bm -c 3 --interval 100ms\n"
                           "spindle ping station3\n"
                           "spindle ping @line1 -c 1\n"
                           "spindle ping tcp://192.168.10.23:5000 -c 100 --json"};
  add_command(app, draft, words, typed.ping, run_ping, [&typed](CLI::App* command) {
    command->add_option("TARGET", typed.ping.options.target, std::string(target_words));
    option(command, "-c,--count", typed.ping.count, "N", "how many requests (default 4)");
    option(command, "--interval", typed.ping.interval, "DURATION",
           "time between them (default 1s)");
    option(command, "--jobs", typed.ping.jobs, "N", std::string(jobs_words));
  });
}

/// "1-3,7": units of a serial line, each once, in the order given.
Result<std::vector<modbus::UnitId>> to_units(const std::string& text) {
  constexpr std::uint64_t last_unit = 247;  // Modbus over Serial Line 1.02, 2.2
  std::vector<modbus::UnitId> units;
  for (const std::string_view range : split(text, ',')) {
    const auto dash = range.find('-');
    const auto first = parse_unsigned(range.substr(0, dash), last_unit);
    const auto last =
        dash == std::string_view::npos ? first : parse_unsigned(range.substr(dash + 1), last_unit);
    if (!first || !last || *first == 0 || *last < *first) {
      return tl::unexpected(bad_option("--units", fmt::format("'{}' does not fit", text),
                                       "it takes units from 1 to 247, such as 1-31 or 1,5"));
    }
    for (std::uint64_t unit = *first; unit <= *last; ++unit) {
      const modbus::UnitId id{static_cast<std::uint8_t>(unit)};
      if (std::find(units.begin(), units.end(), id) == units.end()) units.push_back(id);
    }
  }
  return units;
}

std::string scan_words() {
  return "The line is asked at the rate and parity of the target or profile, and at no others: a\n"
         "driver that hears three bad frames in a row stops its motor, and every frame at a wrong\n"
         "rate is bad. A wrong unit costs one --timeout; nothing is asked twice. Behind a gateway\n"
         "(tcp://) a unit that the gateway can not reach counts as absent.\n";
}

Result<Outcome> run_scan(TypedScan scan, Context& context) {
  if (scan.options.bus.empty()) return tl::unexpected(missing("scan", "BUS"));
  auto units = to_units(scan.units.empty() ? "1-31" : scan.units);
  if (!units) return tl::unexpected(std::move(units.error()));
  scan.options.units = std::move(*units);
  return commands::scan(scan.options, context);
}

void add_scan(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"scan", "BUS [--units 1-31]",
                           "which units answer on a serial line or behind a gateway",
                           "spindle scan rtu:///dev/ttyUSB0 --timeout 100ms\n"
                           "spindle scan 'rtu:///dev/ttyUSB0?baud=115200' --units 1-5,9\n"
                           "spindle scan rtu+tcp://192.168.10.30:4001 --json\n"
                           "spindle scan tcp://192.168.10.31 --units 1-5",
                           scan_words};
  add_command(app, draft, words, typed.scan, run_scan, [&typed](CLI::App* command) {
    command->add_option("BUS", typed.scan.options.bus, "URL of the line, or a tool that is on it");
    option(command, "--units", typed.scan.units, "LIST", "which to ask (default 1-31)");
  });
}

/// Leaves it as it is where nothing is given.
template <typename Number>
Result<void> fill_number(std::string_view name, const std::string& text, std::uint64_t maximum,
                         Number& into) {
  if (text.empty()) return {};
  return to_number(name, text, 0, maximum).map([&](std::uint64_t number) {
    into = static_cast<Number>(number);
  });
}

template <typename Number>
Result<void> fill_number(std::string_view name, const std::string& text, std::uint64_t maximum,
                         std::optional<Number>& into) {
  if (text.empty()) return {};
  return fill_number(name, text, maximum, into.emplace());
}

Result<Outcome> run_simulate(TypedSimulate typed, Context& context) {
  commands::SimulateOptions& options = typed.options;
  if (options.profile.empty()) return tl::unexpected(missing("simulate", "PROFILE"));
  sim::BmOptions& bm = options.tool.bm;
  auto filled =
      fill_number("--identity-bytes", typed.identity_bytes, 255, bm.identity_bytes)
          .and_then([&] { return fill_number("--firmware", typed.firmware, 0xFFFF, bm.firmware); })
          .and_then([&] { return fill_number("--serial", typed.serial, 0xFFFF'FFFF, bm.serial); })
          .and_then([&] { return fill_number("--model", typed.model, 0xFFFF, bm.tool_model); })
          .and_then(
              [&] { return fill_number("--ng-every", typed.ng_every, 1'000'000, bm.ng_every); })
          .and_then([&] { return fill_number("--burst", typed.burst, 10'000, bm.burst); });
  if (!filled) return tl::unexpected(std::move(filled.error()));
  if (!typed.units.empty()) {
    auto units = to_units(typed.units);
    if (!units) return tl::unexpected(std::move(units.error()));
    options.tool.units = std::move(*units);
  }
  if (!typed.baud.empty()) {
    const auto baud = to_number("--baud", typed.baud, 1, 4'000'000);
    if (!baud) return tl::unexpected(baud.error());
    options.tool.baud = static_cast<unsigned>(*baud);
  }
  if (typed.no_gap) options.gaps = sim::LineModel::Gaps::ignored;
  const auto rundown_every = to_duration("--rundown-every", typed.rundown_every);
  if (!rundown_every) return tl::unexpected(rundown_every.error());
  bm.rundown_every = *rundown_every;
  const auto busy = to_duration("--busy", typed.busy);
  if (!busy) return tl::unexpected(busy.error());
  constexpr Duration longest_busy = std::chrono::seconds(1);
  if (*busy && **busy > longest_busy) {
    return tl::unexpected(bad_option("--busy", fmt::format("'{}' is too long", typed.busy),
                                     "Configuration takes 1s or less"));
  }
  options.tool.busy = *busy;
  const bool work_is_described = !typed.ng_every.empty() || !typed.burst.empty();
  if (work_is_described && !bm.rundown_every) {
    return tl::unexpected(
        usage("--ng-every and --burst need --rundown-every", "add for example --rundown-every 5s"));
  }
  if (bm.burst == 0) {
    return tl::unexpected(usage("--burst 0 would be no result", "it takes 1 or more"));
  }
  return commands::simulate(options, context);
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

/// TARGET... [NAME|PATTERN...]: the first argument is a target, and so is every one behind it that
/// can be nothing else.
void part_arguments(const TypedWatch& typed, commands::WatchOptions& options,
                    const Context& context) {
  for (const std::string& argument : typed.arguments) {
    const bool is_target = options.targets.empty() ||
                           (options.names.empty() && commands::is_target(argument, context));
    (is_target ? options.targets : options.names).push_back(argument);
  }
}

Result<void> understand_watch(const TypedWatch& typed, commands::WatchOptions& options) {
  const auto interval = to_duration("--interval", typed.interval);
  if (!interval) return tl::unexpected(interval.error());
  const auto duration = to_duration("--duration", typed.duration);
  if (!duration) return tl::unexpected(duration.error());
  const auto idle_timeout = to_duration("--idle-timeout", typed.idle_timeout);
  if (!idle_timeout) return tl::unexpected(idle_timeout.error());
  if (!typed.count.empty()) {
    const auto count = to_number("--count", typed.count, 1, 1'000'000'000);
    if (!count) return tl::unexpected(count.error());
    options.count = *count;
  }
  options.interval = *interval;
  options.duration = *duration;
  options.idle_timeout = *idle_timeout;
  if (typed.initial) options.samples = device::Samples::changes_and_first;
  if (typed.all) options.samples = device::Samples::all;
  if (typed.no_push) options.events = device::EventMode::unarmed;
  if (typed.no_reconnect) options.reconnection = device::Reconnection::never;
  return {};
}

Result<Outcome> run_watch(TypedWatch typed, Context& context) {
  if (typed.arguments.empty()) return tl::unexpected(missing("watch", "TARGET"));
  part_arguments(typed, typed.options, context);
  if (auto understood = understand_watch(typed, typed.options); !understood) {
    return tl::unexpected(std::move(understood.error()));
  }
  return commands::watch(typed.options, context);
}

void add_watch(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"watch", "TARGET... [NAME|PATTERN...]",
                           "events as they happen and changes of polled values, until stopped",
                           "spindle watch station3\n"
                           "spindle watch station3 station4 --json --count 100\n"
                           "spindle watch station3 status.ready status.alarm --interval 500ms"};
  add_command(app, draft, words, typed.watch, run_watch, [&typed](CLI::App* command) {
    TypedWatch& watch = typed.watch;
    command->add_option("TARGET", watch.arguments,
                        "tools, then names or patterns of values to poll");
    option(command, "--interval", watch.interval, "DURATION",
           "time between two polls (default 200ms)");
    command->add_flag("--all", watch.all, "every polled sample instead of changes");
    command->add_flag("--initial", watch.initial, "also the first value of everything polled");
    option(command, "--count", watch.count, "N", "end after so many events, changes and samples");
    option(command, "--duration", watch.duration, "DURATION", "end after this time");
    option(command, "--idle-timeout", watch.idle_timeout, "DURATION",
           "end when nothing came for this time; status 1 if nothing came at all");
    command->add_flag("--no-push", watch.no_push,
                      "poll the event counter; for tools whose output another client uses");
    command->add_flag("--no-reconnect", watch.no_reconnect, "end when the link is lost");
  });
}

constexpr std::array<std::pair<std::string_view, catalogue::StopMode>, 2> stop_modes = {
    {{"decelerate", catalogue::StopMode::decelerate}, {"instant", catalogue::StopMode::instant}}};

Result<std::optional<catalogue::StopMode>> to_stop_mode(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto mode = to_choice("--stop", text, stop_modes);
  if (!mode) return tl::unexpected(mode.error());
  return *mode;
}

Result<void> understand_motor(TypedRemoteStart& typed) {
  const auto watchdog = to_duration("--watchdog", typed.watchdog);
  if (!watchdog) return tl::unexpected(watchdog.error());
  const auto stop = to_stop_mode(typed.stop);
  if (!stop) return tl::unexpected(stop.error());
  typed.options.watchdog = *watchdog;
  typed.options.stop = *stop;
  if (typed.reverse) typed.options.direction_of_motor = catalogue::Direction::reverse;
  return fill_number("--operation", typed.operation, 0xFFFF, typed.options.operation);
}

Result<Outcome> run_remote_start(TypedRemoteStart typed, Context& context) {
  if (typed.options.target.empty()) return tl::unexpected(missing("remote-start", "TARGET"));
  const auto limit = to_duration("--for", typed.limit);
  if (!limit) return tl::unexpected(limit.error());
  typed.options.limit = *limit;
  if (auto motor = understand_motor(typed); !motor) return tl::unexpected(motor.error());
  if (typed.accept_unverified) typed.options.acceptance = commands::Acceptance::unverified;
  return commands::remote_start(typed.options, context);
}

constexpr std::string_view accept_unverified_words =
    "send what may move or lock the tool although its register is not certain";

void add_remote_start(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {
      "remote-start", "TARGET [--preset N] [--direction D] [--speed SPEED] [--for DURATION]",
      "start the tool under a guard that always ends in a stop; wait for the result",
      "spindle remote-start station3 --preset 2\n"
      "spindle remote-start station3 --for 2s --yes --json\n"
      "spindle remote-start sim:doga-bm --preset 1 --accept-unverified --yes\n"
      "spindle remote-start conveyor1 --speed 500 --for 2s --watchdog 1s"};
  add_command(app, draft, words, typed.remote_start, run_remote_start, [&typed](CLI::App* command) {
    auto& options = typed.remote_start.options;
    command->add_option("TARGET", options.target, "tool name or URL");
    option(command, "--for", typed.remote_start.limit, "DURATION", "stop after this time");
    option(command, "--preset", options.preset, "N", "select this preset first")
        ->group(of_start_action);
    option(command, "--direction", options.direction, "D", "select this direction first")
        ->group(of_start_action);
    option(command, "--speed", options.speed, "SPEED",
           "how fast, in the unit of the profile: 500 (r/min), 25.5 (Hz)")
        ->group(of_motors);
    flag(command, "--reverse", typed.remote_start.reverse, "turn the motor the other way round")
        ->group(of_motors);
    option(command, "--stop", typed.remote_start.stop, "HOW", "decelerate (default) or instant")
        ->group(of_motors);
    option(command, "--operation", typed.remote_start.operation, "N",
           "operation data to set and run (default: those of the profile)")
        ->group(of_command_word);
    option(command, "--acceleration", options.acceleration, "SECONDS", "time to reach the speed")
        ->group(of_command_word);
    option(command, "--deceleration", options.deceleration, "SECONDS", "time to stand still")
        ->group(of_command_word);
    option(command, "--watchdog", typed.remote_start.watchdog, "DURATION",
           "let the driver itself stop when it hears nothing for so long")
        ->group(of_command_word);
    command->add_flag("--accept-unverified", typed.remote_start.accept_unverified,
                      std::string(accept_unverified_words));
  });
}

void add_remote_stop(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"remote-stop",
                           "TARGET...",
                           "stop now; never asks",
                           "spindle remote-stop station3\n"
                           "spindle remote-stop @line1\n"
                           "spindle remote-stop 'rtu:///dev/ttyUSB0?unit=0' --profile "
                           "orientalmotor-blv --broadcast",
                           nullptr,
                           Invocation::ToolsFile::salvaged};
  const auto run = [](TypedRemoteStop stop, Context& context) {
    if (stop.options.targets.empty()) {
      return Result<Outcome>(tl::unexpected(missing("remote-stop", "TARGET")));
    }
    const auto mode = to_stop_mode(stop.stop);
    if (!mode) return Result<Outcome>(tl::unexpected(mode.error()));
    stop.options.stop = *mode;
    if (stop.broadcast) stop.options.reach = commands::Reach::everybody;
    return commands::remote_stop(stop.options, context);
  };
  add_command(app, draft, words, typed.remote_stop, run, [&typed](CLI::App* command) {
    command->add_option("TARGET", typed.remote_stop.options.targets, std::string(target_words));
    option(command, "--stop", typed.remote_stop.stop, "HOW",
           "how a motor stops: decelerate (default) or instant");
    flag(command, "--broadcast", typed.remote_stop.broadcast,
         "everybody on the serial line (unit=0): sent, not acknowledged");
  });
}

void add_alarms(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"alarms", "TARGET [--reset]",
                           "present alarm and last error, with meaning and remedy",
                           "spindle alarms sim:doga-bm\n"
                           "spindle alarms @line1\n"
                           "spindle alarms station3 --reset"};
  const auto run = [](TypedAlarms alarms, Context& context) {
    if (alarms.options.target.empty()) {
      return Result<Outcome>(tl::unexpected(missing("alarms", "TARGET")));
    }
    if (auto filled = fill_jobs(alarms.jobs, alarms.options.jobs); !filled)
      return Result<Outcome>(tl::unexpected(std::move(filled.error())));
    if (alarms.reset) alarms.options.reset = commands::AlarmReset::yes;
    if (alarms.accept_unverified) alarms.options.acceptance = commands::Acceptance::unverified;
    return commands::alarms(alarms.options, context);
  };
  add_command(app, draft, words, typed.alarms, run, [&typed](CLI::App* command) {
    command->add_option("TARGET", typed.alarms.options.target, std::string(target_words));
    command->add_flag("--reset", typed.alarms.reset, "also reset the present alarm");
    command->add_flag("--accept-unverified", typed.alarms.accept_unverified,
                      std::string(accept_unverified_words));
    option(command, "--jobs", typed.alarms.jobs, "N", std::string(jobs_words));
  });
}

Result<Outcome> run_backup(TypedBackup typed, Context& context) {
  if (typed.options.targets.empty()) return tl::unexpected(missing("backup", "TARGET"));
  if (auto filled = fill_jobs(typed.jobs, typed.options.jobs); !filled) {
    return tl::unexpected(std::move(filled.error()));
  }
  if (typed.force) typed.options.overwrite = Overwrite::allow;
  if (typed.include_secrets) typed.options.secrets = commands::Secrets::include;
  return commands::backup(typed.options, context);
}

void add_backup(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"backup", "TARGET... [-f FILE|-] [--dir FOLDER]",
                           "every stored parameter into a file that people can read and git can "
                           "compare",
                           "spindle backup station3\n"
                           "spindle backup station3 -f before-the-change.yaml\n"
                           "spindle backup @line1 --dir backups --force"};
  add_command(app, draft, words, typed.backup, run_backup, [&typed, &draft](CLI::App* command) {
    auto& options = typed.backup.options;
    command->add_option("TARGET", options.targets, std::string(target_words));
    option(command, "-f,--file", options.file, "FILE",
           "where to (default TARGET.yaml in the present folder); - is standard output")
        ->each([&draft](const std::string& file) {
          if (file == "-") draft.only_as_text = "with -f - the backup itself is on standard output";
        });
    option(command, "--dir", options.folder, "FOLDER",
           "one file TARGET.yaml a tool in this folder");
    command->add_flag("--force", typed.backup.force, "replace files that are there");
    command->add_flag("--include-secrets", typed.backup.include_secrets,
                      "also what the profile marks as secret");
    option(command, "--jobs", typed.backup.jobs, "N", std::string(jobs_words));
  });
}

/// Beside --dir no second side and no FILE is named, so what stands there is the first NAME.
void make_name_of(std::string& argument, std::vector<std::string>& names) {
  if (!argument.empty()) names.insert(names.begin(), std::exchange(argument, {}));
}

Result<Outcome> run_diff(TypedDiff typed, Context& context) {
  commands::DiffOptions& options = typed.options;
  if (options.a.empty()) return tl::unexpected(missing("diff", "A"));
  if (!options.folder.empty()) {
    make_name_of(options.b, options.patterns);
  } else if (options.b.empty()) {
    return tl::unexpected(missing("diff", "B"));
  }
  return fill_jobs(typed.jobs, options.jobs).and_then([&] {
    return commands::diff(options, context);
  });
}

void add_diff(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"diff", "A {B|--dir FOLDER} [NAME|PATTERN...] [--ignore PATTERN]",
                           "compare tools, backup files and defaults by parameter name",
                           "spindle diff station3 station3.yaml\n"
                           "spindle diff monday.yaml friday.yaml 'preset.*' --json\n"
                           "spindle diff station3 station4 --ignore 'preset.1.*'\n"
                           "spindle diff @line1 --dir backups"};
  add_command(app, draft, words, typed.diff, run_diff, [&typed](CLI::App* command) {
    auto& options = typed.diff.options;
    command->add_option("A", options.a, "tool, backup file, or 'defaults'; with --dir also @group");
    command->add_option("B", options.b, "tool, backup file, or 'defaults'");
    command->add_option("NAME", options.patterns, "compare only these");
    command->add_option("--ignore", options.ignored, "leave these out, repeatable")
        ->type_name("PATTERN")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    option(command, "--dir", options.folder, "FOLDER",
           "compare each tool with its own backup in this folder, as backup --dir writes it");
    option(command, "--jobs", typed.diff.jobs, "N", std::string(jobs_words));
  });
}

Result<Outcome> run_restore(TypedRestore typed, Context& context) {
  commands::RestoreOptions& options = typed.options;
  if (options.target.empty()) return tl::unexpected(missing("restore", "TARGET"));
  if (!options.folder.empty()) {
    make_name_of(options.file, options.patterns);
  } else if (options.file.empty()) {
    return tl::unexpected(missing("restore", "FILE"));
  }
  if (typed.dry_run) options.execution = commands::Execution::dry_run;
  if (typed.force) options.model = commands::ModelCheck::off;
  if (typed.no_rollback) options.on_failure = commands::OnFailure::leave;
  if (typed.save) options.storing = commands::Storing::yes;
  return fill_jobs(typed.jobs, options.jobs).and_then([&] {
    return commands::restore(options, context);
  });
}

void add_restore(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"restore", "TARGET {FILE|--dir FOLDER} [NAME|PATTERN...]",
                           "plan, confirm, write what differs, verify; put back if it fails",
                           "spindle restore station3 station3.yaml --dry-run\n"
                           "spindle restore station3 station3.yaml 'preset.1.*'\n"
                           "spindle restore station3 old-tool.yaml --yes --json\n"
                           "spindle restore @line1 --dir backups"};
  add_command(app, draft, words, typed.restore, run_restore, [&typed](CLI::App* command) {
    auto& options = typed.restore.options;
    command->add_option("TARGET", options.target, "tool name or URL; with --dir also @group");
    command->add_option("FILE", options.file, "backup file");
    command->add_option("NAME", options.patterns, "restore only these");
    option(command, "--dir", options.folder, "FOLDER",
           "restore each tool from its own backup in this folder, as backup --dir writes it");
    command->add_flag("--dry-run", typed.restore.dry_run, "show the plan, write nothing");
    command->add_flag("--force", typed.restore.force, "also to a tool of another model");
    command->add_flag("--no-rollback", typed.restore.no_rollback,
                      "leave what was written when something fails");
    command->add_flag("--save", typed.restore.save, std::string(save_words));
    option(command, "--jobs", typed.restore.jobs, "N", std::string(jobs_words));
  });
}

/// The options about what only some simulated tools have.
void add_abilities(CLI::App* command, TypedSimulate& typed) {
  option(command, "--identity-bytes", typed.identity_bytes, "N",
         "length of the identity: 12, 13 or 17")
      ->group(of_identity);
  option(command, "--firmware", typed.firmware, "N", "firmware number to report")
      ->group(of_identity);
  option(command, "--serial", typed.serial, "N", "serial number to report")->group(of_identity);
  option(command, "--model", typed.model, "N", "tool model code to report")->group(of_identity);
  option(command, "--rundown-every", typed.rundown_every, "DURATION",
         "an operator who drives a screw at this interval (default: nobody)")
      ->group(of_screwdrivers);
  option(command, "--ng-every", typed.ng_every, "N",
         "every so many of the operator's screws end NG")
      ->group(of_screwdrivers);
  option(command, "--burst", typed.burst, "N",
         "results that each of the operator's screws brings, all at once (default 1)")
      ->group(of_screwdrivers);
}

void add_simulate(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {
      "simulate", "PROFILE [--listen URL]",
      "a simulated tool to learn on, script against and test with",
      "spindle simulate doga-bm\n"
      "spindle simulate doga-bm --listen tcp://127.0.0.1:5000 -v\n"
      "spindle simulate doga-bm --rundown-every 3s --ng-every 5\n"
      "spindle simulate doga-bm --fault late=1500ms@every:10 --fault split=3\n"
      "spindle simulate doga-bm --rundown-every 2s --outage roam=5s@every:30s\n"
      "spindle simulate doga-bm --firmware 4001",
      trouble_words};
  add_command(app, draft, words, typed.simulate, run_simulate, [&typed](CLI::App* command) {
    auto& options = typed.simulate.options;
    command->add_option("PROFILE", options.profile, "what to simulate, such as doga-bm");
    option(command, "--listen", options.listen, "URL",
           "where to listen (default a free port of 127.0.0.1)");
    option(command, "--pty", options.pty, "PATH",
           "serial tools: make a pseudo terminal that this path leads to; it has no parity, so a "
           "wrong one goes unnoticed");
    option(command, "--units", typed.simulate.units, "LIST",
           "serial tools: which units, such as 1-3");
    option(command, "--baud", typed.simulate.baud, "N", "serial tools: rate of the line");
    flag(command, "--no-gap", typed.simulate.no_gap,
         "serial tools: also hear clients that keep too short a silence");
    command->add_option("--fault", options.faults, "make the tool misbehave, repeatable; see below")
        ->type_name("FAULT")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    option(command, "--busy", typed.simulate.busy, "DURATION",
           "how long Configuration takes (default 200ms, at most 1s)")
        ->group(of_command_word);
    const auto repeatable = [command](const char* name, std::vector<std::string>& into,
                                      const char* meaning) {
      command->add_option(name, into, meaning)
          ->type_name("CODE")
          ->expected(1)
          ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
          ->group(of_alarms);
    };
    repeatable("--alarm", options.alarms,
               "an alarm that the tool raises, such as 30h, or 30h@5s after a time; repeatable");
    repeatable("--warning", options.warnings, "a warning in the same form");
    add_abilities(command, typed.simulate);
    command
        ->add_option("--outage", options.outages,
                     "let the tool be away at times, repeatable; see below")
        ->type_name("OUTAGE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  });
}

void add_profile(CLI::App& app, Draft& draft, TypedCommands& typed) {
  using Options = commands::ProfileNameOptions;
  constexpr Words words = {"profile", "list|show|check [PROFILE]",
                           "the catalogue files: which exist, what they say, whether one is valid",
                           "spindle profile list\n"
                           "spindle profile show doga-bm\n"
                           "spindle profile check ./my-tool.yaml"};
  const auto none = [](const Options&, Context&) -> Result<Outcome> {
    return tl::unexpected(missing("profile", "list, show or check"));
  };
  const auto list = [](const Options&, Context& context) {
    return commands::profile_list(context);
  };
  const auto show = [](const Options& options, Context& context) {
    return options.profile.empty()
               ? Result<Outcome>(tl::unexpected(missing("profile show", "PROFILE")))
               : commands::profile_show(options, context);
  };
  const auto check = [](const Options& options, Context& context) {
    return options.profile.empty()
               ? Result<Outcome>(tl::unexpected(missing("profile check", "PROFILE")))
               : commands::profile_check(options, context);
  };
  add_command(app, draft, words, typed.profile, none, [=, &typed, &draft](CLI::App* command) {
    add_command(*command, draft,
                {"list", "", "all profiles that can be named", "spindle profile list"},
                typed.profile_list, list, [](CLI::App*) {});
    add_command(
        *command, draft,
        {"show", "PROFILE", "everything that a profile says", "spindle profile show doga-bm"},
        typed.profile_show, show, [&typed](CLI::App* shown) {
          shown->add_option("PROFILE", typed.profile_show.profile, "name or file");
        });
    add_command(*command, draft,
                {"check", "PROFILE", "every fault of a file, with its place",
                 "spindle profile check ./my-tool.yaml"},
                typed.profile_check, check, [&typed](CLI::App* checked) {
                  checked->add_option("PROFILE", typed.profile_check.profile, "name or file");
                });
  });
}

void add_tools(CLI::App& app, Draft& draft, TypedCommands& typed) {
  constexpr Words words = {"tools", "[--check]",
                           "the named tools of the tools file, with endpoints and profiles",
                           "spindle tools\n"
                           "spindle tools --json\n"
                           "spindle tools --check --tools ./spindle.yaml"};
  const auto run = [](const TypedTools& tools, Context& context) {
    return tools.check ? commands::check_tools(context) : commands::tools(context);
  };
  add_command(app, draft, words, typed.tools, run, [&typed, &draft](CLI::App* command) {
    command->add_flag_callback(
        "--check",
        [&] {
          typed.tools.check = true;
          draft.tools_file = Invocation::ToolsFile::only_found;
        },
        "every fault of the file, with its place");
  });
}

void add_commands(CLI::App& app, Draft& draft, TypedCommands& typed) {
  add_identify(app, draft, typed);
  add_list(app, draft, typed);
  add_get(app, draft, typed);
  add_set(app, draft, typed);
  add_do(app, draft, typed);
  add_watch(app, draft, typed);
  add_remote_start(app, draft, typed);
  add_remote_stop(app, draft, typed);
  add_alarms(app, draft, typed);
  add_backup(app, draft, typed);
  add_diff(app, draft, typed);
  add_restore(app, draft, typed);
  add_ping(app, draft, typed);
  add_scan(app, draft, typed);
  add_simulate(app, draft, typed);
  add_profile(app, draft, typed);
  add_tools(app, draft, typed);
}

void build(CLI::App& app, Draft& draft, TypedCommands& typed) {
  app.set_help_flag();
  app.allow_extras();
  app.require_subcommand(0, 1);
  add_common_options(app, draft.typed);
  add_commands(app, draft, typed);
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

std::string path_of(const CLI::App* command) {
  std::string path = command->get_name();
  for (const CLI::App* parent = command->get_parent();
       parent != nullptr && parent->get_parent() != nullptr; parent = parent->get_parent()) {
    path.insert(0, parent->get_name() + " ");
  }
  return path;
}

Error unexpected_argument(const CLI::App& app, const Draft& draft, const std::string& extra) {
  const std::string command = draft.chosen == nullptr ? "" : path_of(draft.chosen);
  if (extra.size() > 1 && extra.front() == '-') {
    const std::string name = extra.substr(0, extra.find('='));
    std::string hint = suggestion(name, option_names(app, draft.chosen));
    if (hint.empty())
      hint =
          fmt::format("'spindle {}--help' lists all options", command.empty() ? "" : command + " ");
    return usage(fmt::format("unknown option '{}'", name), hint);
  }
  if (draft.chosen == nullptr || !draft.chosen->get_subcommands({}).empty()) {
    std::string hint =
        suggestion(extra, command_names(draft.chosen == nullptr ? app : *draft.chosen));
    if (hint.empty()) hint = "'spindle --help' lists all commands";
    return usage(fmt::format("unknown command '{}'", extra), hint);
  }
  return usage(fmt::format("{}: '{}' is one argument too many", command, extra),
               fmt::format("'spindle {} --help' shows examples", command));
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

Result<void> understand_common(const Typed& typed, Invocation& invocation) {
  const std::string output = typed.output.empty() ? "table" : typed.output;
  const auto format = to_choice("--output", output, formats);
  if (!format) return tl::unexpected(format.error());
  const auto color = to_choice("--color", typed.color.empty() ? "auto" : typed.color, colors);
  if (!color) return tl::unexpected(color.error());
  const auto timeout = to_duration("--timeout", typed.timeout);
  if (!timeout) return tl::unexpected(timeout.error());
  const auto connect_timeout = to_duration("--connect-timeout", typed.connect_timeout);
  if (!connect_timeout) return tl::unexpected(connect_timeout.error());
  work::CommonOptions& common = invocation.common;
  auto retries = fill_number("--retries", typed.retries, 100, common.retries);
  if (!retries) return retries;
  invocation.format = *format;
  invocation.color = *color;
  invocation.talk = typed.quiet ? report::Talk::quiet : report::Talk::normal;
  common.profile = typed.profile;
  common.tools_file = typed.tools;
  common.timeout = *timeout;
  common.connect_timeout = *connect_timeout;
  if (typed.no_input) invocation.user.consent = commands::Consent::no_input;
  if (typed.yes) invocation.user.consent = commands::Consent::given;
  common.trace_file = typed.trace;
  if (typed.verbose) invocation.user.verbosity = commands::Verbosity::frames;
  if (typed.quiet || typed.verbose) invocation.user.progress = report::Showing::unwanted;
  return {};
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

std::vector<CommandDescription> commands_of(const CLI::App& app, const Draft& draft) {
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

Description description_of(const CLI::App& app, const Draft& draft) {
  return {.common = options_of(app), .commands = commands_of(app, draft)};
}

std::string help_of(const CLI::App& app, const Draft& draft) {
  const Description description = description_of(app, draft);
  if (draft.chosen == nullptr) return program_help(description);
  const CommandDescription* command = find_command(description, path_of(draft.chosen));
  return command_help(description, *command);
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
/// words at all is about the file.
bool names_tools(const CLI::App& command) {
  constexpr std::array<std::string_view, 5> targets = {"TARGET", "BUS", "A", "B", "PATTERN"};
  bool takes_words = false;
  for (const CLI::Option* known : command.get_options()) {
    if (!known->get_positional()) continue;
    takes_words = true;
    const std::string name = known->get_name(true);
    if (std::find(targets.begin(), targets.end(), name) == targets.end()) continue;
    const auto& words = known->results();
    if (std::any_of(words.begin(), words.end(), files::may_name_tools)) return true;
  }
  return !takes_words;
}

Result<Invocation> invocation_of(const CLI::App& app, Draft& draft) {
  Invocation invocation;
  const auto extra = first_extra(app);
  // Where a command is misspelt, the program's help would hide it.
  const bool misspelt = extra && draft.chosen == nullptr;
  if (draft.typed.help && !misspelt) {
    invocation.text = help_of(app, draft);
    return invocation;
  }
  const bool wants_version = draft.typed.version && !misspelt;
  if (extra && !wants_version) return tl::unexpected(unexpected_argument(app, draft, *extra));
  if (const auto empty = option_without_value(app)) {
    return tl::unexpected(empty_value(*empty));
  }
  if (auto understood = understand_common(draft.typed, invocation); !understood) {
    return tl::unexpected(std::move(understood.error()));
  }
  if (wants_version) {
    invocation.asks = Invocation::Asks::version;
    return invocation;
  }
  if (!draft.only_as_text.empty() && invocation.format != report::Format::table) {
    return tl::unexpected(
        usage(draft.only_as_text, "leave out --json and --output, or name a file"));
  }
  if (draft.chosen == nullptr) {
    return tl::unexpected(usage("no command is given", "'spindle --help' lists all commands"));
  }
  invocation.tools_use = draft.tools_file.value_or(draft.words[draft.chosen].tools_file);
  // One that the user names is read all the same, so that a wrong name is told; but no stop waits
  // for it.
  const bool told =
      !draft.typed.tools.empty() && invocation.tools_use != Invocation::ToolsFile::salvaged;
  if (!told && !names_tools(*draft.chosen)) {
    invocation.tools_use = Invocation::ToolsFile::only_found;
  }
  invocation.run = std::move(draft.run);
  return invocation;
}

/// --json is -o json, so that of several the last one wins.
std::vector<std::string> with_one_output_option(std::vector<std::string> arguments) {
  const auto end = std::find(arguments.begin(), arguments.end(), end_of_options);
  std::replace(arguments.begin(), end, std::string("--json"), std::string("--output=json"));
  return arguments;
}

}  // namespace

Description describe_grammar() {
  CLI::App app;
  Draft draft;
  draft.extent = Extent::whole;
  TypedCommands typed;
  build(app, draft, typed);
  return description_of(app, draft);
}

Result<Invocation> parse(const std::vector<std::string>& arguments) {
  CLI::App app;
  Draft draft;
  TypedCommands typed;
  build(app, draft, typed);
  try {
    auto words = with_one_output_option(arguments);
    std::reverse(words.begin(), words.end());  // as CLI11 wants them
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    return tl::unexpected(parser_error(arguments, error));
  }
  return invocation_of(app, draft);
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
  const auto* const found = std::find_if(formats.begin(), formats.end(),
                                         [&](const auto& row) { return row.first == last; });
  return found == formats.end() ? report::Format::table : found->second;
}

}  // namespace spindle::cli
