#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <variant>

#include "backup_paths.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/files/backup_file.hpp"
#include "spindle/work/shared_lines.hpp"
#include "spindle/work/snapshot.hpp"

namespace spindle::commands {
namespace {

using catalogue::Missing;
using report::Align;
using report::Column;

const std::array<Column, 3> columns = {{{"FILE", "file"},
                                        {"PARAMETERS", "parameters", Align::right},
                                        {"MISSING", "missing", Align::right}}};

/// A profile that cannot be read is told before a tool is asked.
Result<void> check_profiles(const std::vector<Target>& targets, const Context& context) {
  for (const Target& target : targets) {
    TRY(load_profile(target, context));
  }
  return {};
}

report::Record saved_record(const Target& target, const std::string& path,
                            const ToolSnapshot& taken, const Clock& clock) {
  const auto missing = [&](Missing why) {
    return static_cast<std::size_t>(
        std::count_if(taken.snapshot.missing.begin(), taken.snapshot.missing.end(),
                      [why](const auto& entry) { return entry.why == why; }));
  };
  return {.type = "backup",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"file", path},
                     {"parameters", count(taken.snapshot.entries.size())},
                     {"missing", count(taken.snapshot.missing.size())},
                     {"absent", count(missing(Missing::absent))},
                     {"unreadable", count(missing(Missing::unreadable))},
                     {"left_out", count(missing(Missing::left_out))}}};
}

/// Whether a file was written. A backup that lacks what could not be read is a failure all the
/// same.
struct Saved {
  Outcome outcome = {};
  bool is_written = false;
};

/// What it refers to does not change while it runs.
class Backup final : public Verb<std::monostate, Saved> {
 public:
  Backup(const BackupOptions& options, const BackupPaths& paths)
      : options_(&options), paths_(&paths) {}

  Result<Plan> plan(const catalogue::Profile& profile, const Target& /*target*/) const override {
    if (!catalogue::stored_parameters(profile).empty()) return Plan();
    return tl::unexpected(Error{
        .code = Errc::usage,
        .message =
            fmt::format("profile {} has no settings, so there is nothing to save", profile.id),
        .hint = "'spindle dump' saves registers as they are"});
  }

  Result<Done> perform(OpenTool& tool, const Plan& /*plan*/, Context& context) const override {
    const auto taken = save(tool, context);
    if (is_quiet()) return tell_quietly(taken);
    if (!taken) return tell_failure(taken.error(), context);
    Saved saved{.is_written = true};
    Listing listing(context, columns);
    listing.add(saved_record(tool.target, paths_->at(tool.target.shown), *taken, context.clock));
    saved.outcome.succeed();
    for (const Error& error : taken->unreadable) {
      saved.outcome.fail(error);
      listing.add(error);
    }
    return finish(listing, saved.outcome).map([&](const Outcome&) { return saved; });
  }

  Result<Done> give_up(const Target& /*target*/, const Plan* /*plan*/, const Error& error,
                       Context& context) const override {
    return tell_failure(error, context);
  }

  [[nodiscard]] std::optional<Summary> summary(const AllDone& all) const override {
    const auto saved = static_cast<std::size_t>(
        std::count_if(all.done.begin(), all.done.end(),
                      [](const auto& done) { return done && done->is_written; }));
    const std::size_t failed = all.tools - saved;
    return Summary{.counts = {{"saved", count(saved)}, {"failed", count(failed)}},
                   .sentence = fmt::format("{} saved, {} failed", saved, failed)};
  }

 private:
  /// Standard output holds the backup and nothing else.
  [[nodiscard]] bool is_quiet() const { return options_->file == standard_output; }

  Result<ToolSnapshot> save(OpenTool& tool, const Context& context) const {
    auto taken = read(tool, context);
    if (!taken) return taken;
    return write(paths_->at(tool.target.shown), files::render_backup(taken->snapshot), context)
        .map([&] { return std::move(*taken); });
  }

  [[nodiscard]] Result<ToolSnapshot> read(OpenTool& tool, const Context& context) const {
    ProgressLine progress(context);
    return take_snapshot(tool, options_->secrets, context,
                         progress.counter(tool.target.shown + ": reading"));
  }

  [[nodiscard]] Result<void> write(const std::string& path, const std::string& text,
                                   const Context& context) const {
    if (path == standard_output) return context.io.out(text);
    const Privacy privacy = options_->secrets == Secrets::include ? Privacy::own : Privacy::usual;
    return context.disk.write(path, text, options_->overwrite, privacy);
  }

  static Result<Done> tell_quietly(const Result<ToolSnapshot>& taken) {
    if (!taken) return tl::unexpected(taken.error());
    if (!taken->unreadable.empty()) return tl::unexpected(taken->unreadable.front());
    Saved saved{.is_written = true};
    saved.outcome.succeed();
    return saved;
  }

  /// A list without files has its columns all the same.
  static Result<Done> tell_failure(const Error& error, Context& context) {
    Saved saved;
    saved.outcome.fail(error);
    Listing listing(context, columns);
    listing.add(error);
    return finish(listing, saved.outcome).map([&](const Outcome&) { return saved; });
  }

  const BackupOptions* options_;
  const BackupPaths* paths_;
};

}  // namespace

Result<Outcome> backup(const BackupOptions& options, Context& context) {
  TRY_LET(auto tools, resolve_compatible_targets(options.targets, context));
  TRY_LET(const auto paths, choose_paths(tools, options, context));
  TRY(check_profiles(tools, context));
  if (!options.folder.empty()) {
    auto made = context.disk.make_folders(options.folder, Privacy::usual);
    if (!made) return tl::unexpected(std::move(made.error()));
  }
  const bool is_listed = options.file != standard_output;
  return run_verb(Backup(options, paths), {.tools = std::move(tools), .is_group = is_listed},
                  options.jobs, context);
}

}  // namespace spindle::commands
