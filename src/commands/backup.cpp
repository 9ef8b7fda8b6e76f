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
    if (!target.fault.empty()) continue;  // told in its turn
    TRY(load_profile(target, context));
  }
  return {};
}

/// What a tool holds, and whether its file said that already.
struct Kept {
  ToolSnapshot taken;
  bool is_unchanged = false;
};

report::Record saved_record(const Target& target, const std::string& path, const Kept& kept,
                            const Clock& clock) {
  const ToolSnapshot& taken = kept.taken;
  const auto missing = [&](Missing why) {
    return static_cast<std::size_t>(
        std::count_if(taken.snapshot.missing.begin(), taken.snapshot.missing.end(),
                      [why](const auto& entry) { return entry.why == why; }));
  };
  return {.type = "backup",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"file", path, kept.is_unchanged ? path + " (unchanged)" : ""},
                     {"parameters", count(taken.snapshot.entries.size())},
                     {"missing", count(taken.snapshot.missing.size())},
                     {"absent", count(missing(Missing::absent))},
                     {"unreadable", count(missing(Missing::unreadable))},
                     {"left_out", count(missing(Missing::left_out))},
                     {"result", std::string(kept.is_unchanged ? "unchanged" : "saved")}}};
}

/// Whether a file was written. A backup that lacks what could not be read is a failure all the
/// same.
struct Saved {
  Outcome outcome = {};
  bool is_written = false;
  bool is_unchanged = false;  ///< the file said that already
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
    const auto kept = save(tool, context);
    if (is_quiet()) return tell_quietly(kept);
    if (!kept) return tell_failure(kept.error(), context);
    Saved saved{.is_written = !kept->is_unchanged, .is_unchanged = kept->is_unchanged};
    Listing listing(context, columns);
    listing.add(saved_record(tool.target, paths_->at(tool.target.shown), *kept, context.clock));
    saved.outcome.succeed();
    for (const Error& error : kept->taken.unreadable) {
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
    const auto count_of = [&](bool Saved::*is) {
      return static_cast<std::size_t>(
          std::count_if(all.done.begin(), all.done.end(),
                        [is](const auto& done) { return done && (*done).*is; }));
    };
    const std::size_t saved = count_of(&Saved::is_written);
    const std::size_t unchanged = count_of(&Saved::is_unchanged);
    const std::size_t failed = all.tools - saved - unchanged;
    const std::string alike = unchanged == 0 ? "" : fmt::format("{} unchanged, ", unchanged);
    return Summary{.counts = {{"saved", count(saved)},
                              {"unchanged", count(unchanged)},
                              {"failed", count(failed)}},
                   .sentence = fmt::format("{} saved, {}{} failed", saved, alike, failed)};
  }

 private:
  /// Standard output holds the backup and nothing else.
  [[nodiscard]] bool is_quiet() const { return options_->file == standard_output; }

  /// A file of a folder that needs no other text is left as it is, for those who keep it in git.
  Result<Kept> save(OpenTool& tool, const Context& context) const {
    TRY_LET(auto taken, read(tool, context));
    const std::string& path = paths_->at(tool.target.shown);
    const bool in_folder = !options_->folder.empty();
    if (in_folder && says_the_same(path, taken.snapshot, context.disk)) {
      return Kept{.taken = std::move(taken), .is_unchanged = true};
    }
    const bool is_kept = options_->overwrite == Overwrite::refuse;
    if (in_folder && is_kept && context.disk.exists(path)) {
      return tl::unexpected(holds_another(path));
    }
    return write(path, files::render_backup(taken.snapshot), context).map([&] {
      return Kept{.taken = std::move(taken)};
    });
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

  static Result<Done> tell_quietly(const Result<Kept>& kept) {
    if (!kept) return tl::unexpected(kept.error());
    const std::vector<Error>& unreadable = kept->taken.unreadable;
    if (!unreadable.empty()) return tl::unexpected(unreadable.front());
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
