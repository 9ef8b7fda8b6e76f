#include "spindle/cli/run.hpp"

#include <fmt/format.h>

#include <exception>
#include <filesystem>
#include <utility>

#include "complete.hpp"
#include "grammar.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/show_frames.hpp"
#include "spindle/files/capture.hpp"
#include "spindle/work/default_target.hpp"
#include "spindle/work/tool_memory.hpp"
#include "version.hpp"

namespace spindle::cli {
namespace {

/// Not a command for people: the completion scripts of the shells use it.
constexpr std::string_view completion_command = "__complete";

using Texts = std::vector<std::string>;

int exit_status(ExitStatus status) { return static_cast<int>(status); }

std::string variable(const World& world, std::string_view name) {
  return world.environment(name).value_or(std::string());
}

/// XDG Base Directory Specification: a variable, or its default below the home folder; empty when
/// neither is known.
std::string xdg_folder(const World& world, std::string_view name, std::string_view below_home) {
  if (std::string folder = variable(world, name); folder.starts_with('/')) return folder;
  const std::string home = variable(world, "HOME");
  return home.empty() ? std::string() : home + "/" + std::string(below_home);
}

/// Where spindle keeps what it remembers between runs; empty when it is not said.
std::string state_folder(const World& world) {
  const std::string folder = xdg_folder(world, "XDG_STATE_HOME", ".local/state");
  return folder.empty() ? folder : folder + "/spindle";
}

/// Where spindle keeps what it can do without; empty when it is not said.
std::string cache_folder(const World& world) {
  const std::string folder = xdg_folder(world, "XDG_CACHE_HOME", ".cache");
  return folder.empty() ? folder : folder + "/spindle";
}

/// The user's own profiles first, then the installed ones, then those of the build tree.
std::vector<std::string> profile_folders(const World& world) {
  std::vector<std::string> folders;
  const std::string path = variable(world, "SPINDLE_PROFILE_PATH");
  for (const std::string_view folder : split(path, ':')) {
    if (!folder.empty()) folders.emplace_back(folder);
  }
  const std::string data = xdg_folder(world, "XDG_DATA_HOME", ".local/share");
  if (!data.empty()) folders.push_back(data + "/spindle/profiles");
  for (const std::string_view below :
       {"/../share/spindle/profiles", "/profiles", "/../profiles", "/../../profiles"}) {
    const std::filesystem::path folder = world.installation.folder + std::string(below);
    folders.push_back(folder.lexically_normal().string());
  }
  return folders;
}

files::ProfileStore profile_store(const World& world) {
  return files::ProfileStore(profile_folders(world), world.disk, world.shipped);
}

/// Where a tools file is made when there is none; empty when no folder for it is known.
std::string usual_tools_file(const World& world) {
  const std::string config = xdg_folder(world, "XDG_CONFIG_HOME", ".config");
  return config.empty() ? std::string() : config + "/spindle/tools.yaml";
}

/// The tools file that counts; empty when there is none.
std::string find_tools_file(const World& world, const Invocation& invocation) {
  if (!invocation.common.tools_file.empty()) return invocation.common.tools_file;
  if (std::string named = variable(world, "SPINDLE_TOOLS"); !named.empty()) return named;
  std::vector<std::string> places = {"./spindle.yaml"};
  if (std::string own = usual_tools_file(world); !own.empty()) places.push_back(std::move(own));
  places.emplace_back("/etc/spindle/tools.yaml");
  for (std::string& place : places) {
    if (!world.disk.absent(place)) return std::move(place);
  }
  return {};
}

Result<files::Tools> find_tools(const World& world, const Invocation& invocation) {
  const std::string path = find_tools_file(world, invocation);
  if (path.empty()) return files::Tools();
  switch (invocation.tools_use) {
    case Invocation::ToolsFile::loaded:
    case Invocation::ToolsFile::all_tools:
      return files::usable_tools(path, world.disk);
    case Invocation::ToolsFile::salvaged:
      return files::salvage_tools(path, world.disk);
    case Invocation::ToolsFile::only_found:
      break;
  }
  return files::Tools{.path = path};
}

/// A terminal that shows text and nothing else.
bool is_dumb(const World& world) { return variable(world, "TERM") == "dumb"; }

report::Color color_of(const World& world, ColorChoice choice) {
  if (choice == ColorChoice::always) return report::Color::on;
  if (choice == ColorChoice::never) return report::Color::off;
  if (!variable(world, "NO_COLOR").empty()) return report::Color::off;
  const std::string force = variable(world, "CLICOLOR_FORCE");
  if (!force.empty() && force != "0") return report::Color::on;
  const bool able = world.io.out_is_terminal && !is_dumb(world);
  return able ? report::Color::on : report::Color::off;
}

/// The head of the capture file; what follows is appended frame by frame.
Result<void> begin_capture(const std::string& path, const Disk& disk) {
  if (path.empty()) return {};
  auto begun = disk.write(path, files::capture_head(), Overwrite::refuse, Privacy::usual);
  if (!begun && begun.error().status() == ExitStatus::usage) {
    begun.error().name = path;
    begun.error().hint = "choose another name for --trace";
  }
  return begun;
}

/// What work on tools needs of the world. What it is given must outlive it.
work::Environment environment_of(World& world, const Invocation& invocation,
                                 const files::Tools& tools, const files::ProfileStore& profiles,
                                 const std::string& state, const work::ShowFrames& show_frames) {
  return {.clock = world.clock,
          .interrupt = world.interrupt,
          .open = world.open,
          .uninterruptible = world.uninterruptible,
          .disk = world.disk,
          .state_folder = state,
          .version = version,
          .profiles = profiles,
          .tools = tools,
          .show_frames = show_frames,
          .common = invocation.common,
          .make_doors = world.make_doors,
          .cache_folder = cache_folder(world),
          .network = world.network,
          .target_variable = variable(world, "SPINDLE_TARGET")};
}

Result<commands::Outcome> run_command(const Invocation& invocation, World& world,
                                      report::Renderer& renderer) {
  TRY_LET(const auto tools, find_tools(world, invocation));
  const files::ProfileStore profiles = profile_store(world);
  const std::string state = state_folder(world);
  const auto show_frames = commands::show_frames(world.io, world.clock, invocation.user.frames);
  commands::Context context{environment_of(world, invocation, tools, profiles, state, show_frames),
                            {.io = world.io,
                             .serve = world.serve,
                             .end_waits = world.end_waits,
                             .companions = world.companions,
                             .user = invocation.user,
                             .supervision = world.supervision,
                             .new_tools_file = usual_tools_file(world)},
                            {.renderer = renderer}};
  // A file that is read again while a command runs is taken whole, or not at all.
  context.supervision.load_tools = [&] {
    return find_tools(world, invocation).and_then(&files::without_faults);
  };
  TRY(begin_capture(invocation.common.trace_file, world.disk));
  return invocation.run(context);
}

/// Tells why, and says with which status to end. No reader is left after a closed pipe.
int tell(const Error& error, World& world, report::Renderer& renderer) {
  if (error.code == Errc::closed_pipe) return exit_status(ExitStatus::ok);
  const auto told = renderer.error(error, world.clock.wall());
  static_cast<void>(told);  // the status says it even where the words cannot
  return exit_status(error.status());
}

/// What the shells' completion scripts ask. A broken file must not make a shell noisy.
int run_completion(const std::vector<std::string>& words, World& world) {
  auto typed = parse(words).value_or(Invocation());
  typed.tools_use = Invocation::ToolsFile::loaded;  // also where no word is typed yet
  const auto tools = find_tools(world, typed).value_or(files::Tools());
  const files::ProfileStore profiles = profile_store(world);
  const work::ToolMemory memory(world.disk, cache_folder(world));
  const std::string state = state_folder(world);
  const work::ShowFrames show_nothing;
  const auto usual =
      work::default_target(environment_of(world, typed, tools, profiles, state, show_nothing));
  const Completion completion =
      complete(words, describe_grammar(),
               {tools, profiles, &memory, usual && *usual ? (*usual)->text : std::string()});
  const auto written = world.io.out(to_text(completion));
  return exit_status(written ? ExitStatus::ok : written.error().status());
}

Result<void> tell_version(const World& world, report::Format format, report::Renderer& renderer) {
  const std::string& library = world.installation.modbus_library;
  const std::string plain = fmt::format("spindle {}\nlibmodbus {}\nprofile format {}", version,
                                        library, files::profile_format);
  if (format != report::Format::json && format != report::Format::yaml) {
    return world.io.out(plain + "\n");
  }
  report::Texts profiles;
  for (const auto& entry : profile_store(world).list()) {
    profiles.push_back(entry.id);
  }
  return renderer.line({.type = "version",
                        .target = {},
                        .time = world.clock.wall(),
                        .fields = {{"version", std::string(version)},
                                   {"libmodbus", library},
                                   {"profile_format", Decimal(files::profile_format)},
                                   {"profiles", std::move(profiles)}}},
                       plain);
}

int run_guarded(const std::vector<std::string>& arguments, World& world) {
  if (!arguments.empty() && arguments.front() == completion_command) {
    return run_completion({arguments.begin() + 1, arguments.end()}, world);
  }
  world.io.typed = arguments;
  auto invocation = parse(arguments);
  const report::Format format = invocation ? invocation->format : wanted_format(arguments);
  const report::Verbosity verbosity =
      invocation ? invocation->user.verbosity : report::Verbosity::normal;
  if (invocation) world.io.color = color_of(world, invocation->color);
  if (invocation && is_dumb(world)) invocation->user.progress = report::Showing::unwanted;
  const auto renderer =
      report::make_renderer({.format = format,
                             .verbosity = verbosity,
                             .columns = invocation ? invocation->columns : Texts(),
                             .clock = &world.clock},
                            world.io);
  if (!invocation) return tell(invocation.error(), world, *renderer);
  if (invocation->asks == Invocation::Asks::version) {
    const auto told = tell_version(world, format, *renderer);
    return told ? exit_status(ExitStatus::ok) : tell(told.error(), world, *renderer);
  }
  if (invocation->text) {
    const auto written = world.io.out(*invocation->text);
    return written ? exit_status(ExitStatus::ok) : tell(written.error(), world, *renderer);
  }
  const auto outcome = run_command(*invocation, world, *renderer);
  return outcome ? exit_status(outcome->status()) : tell(outcome.error(), world, *renderer);
}

}  // namespace

int run(const std::vector<std::string>& arguments, World& world) {
  try {
    return run_guarded(arguments, world);
  } catch (const std::exception& exception) {
    // Every library is fenced where it is called; what arrives here is a bug of ours.
    report::say_line(world.io, report::Severity::error,
                     std::string("spindle: internal error: ") + exception.what() +
                         "; please report it with the command line");
    return exit_status(ExitStatus::internal);
  }
}

}  // namespace spindle::cli
