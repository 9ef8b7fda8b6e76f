#include <fmt/format.h>

#include <array>
#include <map>
#include <utility>

#include "listing.hpp"
#include "progress.hpp"
#include "records.hpp"
#include "shared_lines.hpp"
#include "side_by_side.hpp"
#include "snapshots.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/files/backup_file.hpp"

namespace spindle::commands {
namespace {

using catalogue::Missing;
using report::Align;
using report::Column;

constexpr std::string_view standard_output = "-";

const std::array<Column, 4> columns = {{{"TARGET", "target"},
                                        {"FILE", "file"},
                                        {"PARAMETERS", "parameters", Align::right},
                                        {"MISSING", "missing", Align::right}}};

Error bad_request(std::string message, std::string hint = {}) {
  return {.code = Errc::usage, .message = std::move(message), .hint = std::move(hint)};
}

/// Where the backup of each target goes, by the target's name.
using Paths = std::map<std::string, std::string>;

std::string path_of(const Target& target, const BackupOptions& options) {
  if (!options.file.empty()) return options.file;
  const std::string name = file_name_of(target.shown) + ".yaml";
  return options.folder.empty() ? name : fmt::format("{}/{}", options.folder, name);
}

/// All that can be known to be wrong before a tool is asked.
Result<Paths> check_paths(const std::vector<Target>& targets, const BackupOptions& options,
                          const Context& context) {
  if (!options.file.empty() && !options.folder.empty()) {
    return tl::unexpected(bad_request("--file and --dir exclude each other", "give one of them"));
  }
  if (!options.file.empty() && targets.size() > 1) {
    return tl::unexpected(
        bad_request(fmt::format("{} tools do not fit into one file", targets.size()),
                    "--dir FOLDER writes one file a tool"));
  }
  Paths paths;
  std::map<std::string, std::string> owners;
  for (const Target& target : targets) {
    std::string path = path_of(target, options);
    const auto [owner, is_new] = owners.emplace(path, target.shown);
    if (!is_new) {
      return tl::unexpected(bad_request(fmt::format("'{}' and '{}' would both be written to {}",
                                                    owner->second, target.shown, path),
                                        "back them up one by one, each into a --file of its own"));
    }
    const bool taken = path != standard_output && context.disk.exists(path);
    if (taken && options.overwrite == Overwrite::refuse) {
      Error error = bad_request("this file exists already",
                                "choose another name, or add --force to replace it");
      error.name = path;
      return tl::unexpected(std::move(error));
    }
    paths.emplace(target.shown, std::move(path));
  }
  return paths;
}

/// Loads every profile once, however many tools have it.
Result<std::map<std::string, catalogue::Profile>> load_profiles(const std::vector<Target>& targets,
                                                                const Context& context) {
  std::map<std::string, catalogue::Profile> profiles;
  for (const Target& target : targets) {
    if (profiles.contains(target.profile)) continue;
    auto profile = load_profile(target, context);
    if (!profile) return tl::unexpected(std::move(profile.error()));
    profiles.emplace(target.profile, std::move(*profile));
  }
  return profiles;
}

struct Saved {
  Target target;
  std::string path;
  ToolSnapshot taken;

  [[nodiscard]] std::size_t count(Missing why) const {
    return static_cast<std::size_t>(
        std::count_if(taken.snapshot.missing.begin(), taken.snapshot.missing.end(),
                      [why](const auto& entry) { return entry.why == why; }));
  }
};

/// Backs tools up side by side; what it refers to does not change meanwhile.
class Saving {
 public:
  Saving(const BackupOptions& options, const Paths& paths,
         const std::map<std::string, catalogue::Profile>& profiles, ProgressLine& progress,
         const Context& context)
      : options_(&options),
        paths_(&paths),
        profiles_(&profiles),
        progress_(&progress),
        context_(&context) {}

  Result<Saved> save(const Target& target) {
    auto tool = open_tool(target, profiles_->at(target.profile), Need::named_registers, *context_);
    if (!tool) return tl::unexpected(std::move(tool.error()));
    auto taken = take_snapshot(*tool, options_->secrets, *context_, reading(target));
    if (!taken) return tl::unexpected(std::move(taken.error()));
    const std::string& path = paths_->at(target.shown);
    auto written = write(path, files::render_backup(taken->snapshot));
    if (!written) return tl::unexpected(tool->target.blamed(std::move(written.error())));
    return Saved{tool->target, path, std::move(*taken)};
  }

 private:
  Result<void> write(const std::string& path, const std::string& text) {
    if (path == standard_output) return context_->io.out(text);
    const Privacy privacy = options_->secrets == Secrets::include ? Privacy::own : Privacy::usual;
    return context_->disk.write(path, text, options_->overwrite, privacy);
  }

  /// Of several tools it is shown how many are done.
  link::Progress reading(const Target& target) {
    if (paths_->size() > 1) return {};
    return progress_->counter(target.shown + ": reading");
  }

  const BackupOptions* options_;
  const Paths* paths_;
  const std::map<std::string, catalogue::Profile>* profiles_;
  ProgressLine* progress_;
  const Context* context_;
};

report::Record saved_record(const Saved& saved, const Clock& clock) {
  return {.type = "backup",
          .target = saved.target.shown,
          .time = clock.wall(),
          .fields = {{"file", saved.path},
                     {"parameters", count(saved.taken.snapshot.entries.size())},
                     {"missing", count(saved.taken.snapshot.missing.size())},
                     {"absent", count(saved.count(Missing::absent))},
                     {"unreadable", count(saved.count(Missing::unreadable))},
                     {"left_out", count(saved.count(Missing::left_out))}}};
}

/// Tells how every tool came out. A backup that lacks what could not be read is a failure.
Result<Outcome> tell(const std::vector<Result<Saved>>& results, Context& context) {
  Outcome outcome;
  Listing listing(context, columns);
  const auto fail = [&](const Error& error) {
    outcome.fail(error);
    listing.add(error);
  };
  for (const Result<Saved>& result : results) {
    if (!result) {
      fail(result.error());
      continue;
    }
    listing.add(saved_record(*result, context.clock));
    outcome.succeed();
    for (const Error& error : result->taken.unreadable) fail(error);
  }
  const auto saved = static_cast<std::size_t>(std::count_if(
      results.begin(), results.end(), [](const auto& result) { return result.has_value(); }));
  return finish(listing, outcome,
                {.counts = {{"saved", count(saved)}, {"failed", count(results.size() - saved)}},
                 .sentence = fmt::format("{} saved, {} failed", saved, results.size() - saved)},
                context);
}

/// Standard output holds the backup and nothing else.
Result<Outcome> tell_quietly(const Result<Saved>& result) {
  if (!result) return tl::unexpected(result.error());
  if (!result->taken.unreadable.empty()) return tl::unexpected(result->taken.unreadable.front());
  Outcome outcome;
  outcome.succeed();
  return outcome;
}

}  // namespace

Result<Outcome> backup(const BackupOptions& options, Context& context) {
  const auto targets = resolve_compatible_targets(options.targets, context);
  if (!targets) return tl::unexpected(targets.error());
  const auto paths = check_paths(*targets, options, context);
  if (!paths) return tl::unexpected(paths.error());
  const auto profiles = load_profiles(*targets, context);
  if (!profiles) return tl::unexpected(profiles.error());
  if (!options.folder.empty()) {
    auto made = context.disk.make_folders(options.folder, Privacy::usual);
    if (!made) return tl::unexpected(std::move(made.error()));
  }
  ProgressLine progress(context);
  Saving saving(options, *paths, *profiles, progress, context);
  const auto results = side_by_side(
      *targets, options.jobs, [&](const Target& target) { return saving.save(target); }, &progress);
  if (options.file == standard_output) return tell_quietly(results.front());
  return tell(results, context);
}

}  // namespace spindle::commands
