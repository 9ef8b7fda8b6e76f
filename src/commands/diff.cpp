#include <fmt/format.h>
#include <fmt/ranges.h>

#include <optional>
#include <utility>

#include "backup_paths.hpp"
#include "comparison.hpp"
#include "drift.hpp"
#include "dump_diff.hpp"
#include "run_verb.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {
namespace {

using catalogue::Lacking;
using catalogue::Profile;

/// The defaults of a profile say nothing of what has none.
Lacking lacking_of(const DiffSide& side) {
  return side.is_defaults() ? Lacking::is_not_compared : Lacking::differs;
}

/// What a tool is compared with.
struct Counterpart {
  DiffSide side = {};
  std::optional<SideContent> content = std::nullopt;  ///< empty: a tool that is still to be asked
};

/// What tools are compared with: each with its own backup, or one with another side.
struct Counterparts {
  BackupPaths backups = {};
  DiffSide side = {};
  bool is_first = false;                ///< the other side is A
  bool is_group = false;                ///< every tool gets a line of its own at the end
  std::vector<std::string> extra = {};  ///< files of no tool
};

std::string serial_of(const catalogue::Snapshot& snapshot) {
  return snapshot.identity ? snapshot.identity->serial : std::string();
}

/// What it refers to does not change while it runs.
class Diff final : public Verb<Counterpart, DiffResult> {
 public:
  Diff(const DiffOptions& options, const Counterparts& counterparts, const Context& context)
      : options_(&options), counterparts_(&counterparts), context_(&context) {}

  [[nodiscard]] Fit fit() const override { return Fit::one; }

  Result<Plan> plan(const Profile& profile, const Target& target) const override {
    TRY(check_selection(*options_, profile));
    if (counterparts_->backups.empty()) return read_known({.side = counterparts_->side}, profile);
    auto plan = find_backup(target).and_then(
        [&](DiffSide side) { return read_known({.side = std::move(side)}, profile); });
    if (!plan) plan.error() = with_target(std::move(plan.error()), target);
    return plan;
  }

  Result<Done> perform(OpenTool& tool, const Plan& plan, Context& context) const override {
    auto done = compare_tool(tool, plan, context);
    if (!done && counterparts_->is_group) {
      tell_not_compared(tool.target, done.error(), backup_of(tool.target), context);
    }
    return done;
  }

  Result<Done> give_up(const Target& target, const Plan* /*plan*/, const Error& error,
                       Context& context) const override {
    tell_not_compared(target, error, backup_of(target), context);
    return tl::unexpected(error);
  }

  [[nodiscard]] std::optional<Summary> summary(const AllDone& all) const override {
    return drift_summary(all.done, all.tools, counterparts_->extra);
  }

 private:
  /// Path of the backup of a tool; empty: it is compared with another side.
  [[nodiscard]] std::string backup_of(const Target& target) const {
    const auto found = counterparts_->backups.find(target.shown);
    return found == counterparts_->backups.end() ? std::string() : found->second;
  }

  Result<Done> compare_tool(OpenTool& tool, const Plan& plan, Context& context) const {
    TRY_LET(auto own, read_tool(tool, context));
    TRY_LET(
        auto other, plan.content ? Result<SideContent>(*plan.content) : [&] {
          tool.device.disconnect();  // the other one may be on the same line
          return read_tool(*plan.side.target, context);
        }());
    const std::string own_serial = serial_of(own.snapshot);
    ReadSides sides{std::move(own), std::move(other)};
    if (counterparts_->is_first) std::swap(sides.a, sides.b);
    return compare(sides, *options_, lacking_of(plan.side), tool.target.shown, context,
                   counterparts_->backups.empty()
                       ? std::vector<report::Field>()
                       : tell_serials({.tool = own_serial,
                                       .backup = serial_of(plan.content->snapshot),
                                       .file = plan.side.text},
                                      tool.target, context));
  }

  [[nodiscard]] Result<DiffSide> find_backup(const Target& target) const {
    const std::string& path = counterparts_->backups.at(target.shown);
    return read_backup_of(target, path, options_->folder, *context_)
        .map([&](files::BackupFile file) {
          return DiffSide{.text = path, .file = std::move(file)};
        });
  }

  /// Reads the other side as far as no tool has to be asked; `profile` says the defaults.
  [[nodiscard]] Result<Counterpart> read_known(Counterpart other, const Profile& profile) const {
    if (other.side.target) return other;
    TRY_LET(auto content,
            other.side.file ? read_file(other.side, *context_) : read_defaults(profile));
    other.content = std::move(content);
    return other;
  }

  const DiffOptions* options_;
  const Counterparts* counterparts_;
  const Context* context_;
};

/// Two sides of which none is a tool, and one at most the defaults.
Result<Outcome> diff_files(const DiffSide& a, const DiffSide& b, const DiffOptions& options,
                           Context& context) {
  TRY_LET(auto first, read_file(a.is_defaults() ? b : a, context));
  TRY(check_selection(options, first.profile));
  const bool with_defaults = a.is_defaults() || b.is_defaults();
  TRY_LET(auto other, with_defaults ? read_defaults(first.profile) : read_file(b, context));
  ReadSides sides{std::move(first), std::move(other)};
  if (a.is_defaults()) std::swap(sides.a, sides.b);
  return compare(sides, options, lacking_of(a.is_defaults() ? a : b), {}, context)
      .map([](const DiffResult& result) { return result.outcome; });
}

Result<Outcome> diff_sides(const DiffOptions& options, Context& context) {
  if (options.a == factory_defaults && options.b == factory_defaults) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "one side must be a tool or a backup",
                                .hint = "write for example 'spindle diff station3 defaults'"});
  }
  TRY_LET(const auto dumps, read_dump_sides(options, context));
  if (dumps.any()) return diff_dumps(dumps, options, context);
  TRY_LET(const auto a, resolve_side(options.a, context));
  TRY_LET(const auto b, resolve_side(options.b, context));
  if (!a.target && !b.target) return diff_files(a, b, options, context);
  const Counterparts other{.side = a.target ? b : a, .is_first = !a.target};
  return run_verb(Diff(options, other, context), {.tools = {a.target ? *a.target : *b.target}},
                  options.jobs, context);
}

Result<Outcome> diff_with_backups(const DiffOptions& options, Context& context) {
  TRY_LET(auto targets, resolve_one_or_group({options.a}, Addressing::unicast, context));
  TRY_LET(auto paths, check_names_only(options.patterns, context).and_then([&] {
    return paths_in_folder(targets.tools, options.folder);
  }));
  Counterparts backups{.backups = std::move(paths), .is_group = targets.is_group};
  if (targets.is_group) {
    backups.extra = files_of_no_tool(backups.backups, options.folder, context);
  }
  if (!backups.extra.empty()) {
    context.renderer.note(
        fmt::format("of no tool in the tools file: {}", fmt::join(backups.extra, ", ")));
  }
  return run_verb(Diff(options, backups, context), targets, options.jobs, context);
}

}  // namespace

Result<Outcome> diff(const DiffOptions& options, Context& context) {
  return options.folder.empty() ? diff_sides(options, context)
                                : diff_with_backups(options, context);
}

}  // namespace spindle::commands
