#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "listing.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// The tools that a command line means.
struct Targets {
  std::vector<Target> tools;
  /// They are told of, and asked about, as several: so is even a group of one tool, so that a
  /// program can rely on the columns.
  bool is_group = false;
};

/// A tool with everything that was found out about it, and what is planned for it.
template <typename Plan>
struct Planned {
  Target target;
  Plan plan;
};

template <typename Plan>
const Target& target_of(const Planned<Plan>& planned) {
  return planned.target;
}

/// How a verb came out on the tools of a group.
template <typename Plan, typename Done>
struct GroupResult {
  std::size_t tools = 0;                    ///< that were meant
  std::vector<Planned<Plan>> planned = {};  ///< those on which it was begun, if it was planned
  std::vector<Result<Done>> done = {};      ///< of those on which it was begun, in their order
  Outcome outcome = {};                     ///< of all that were meant
  bool is_rejected = false;                 ///< it does not fit some, so nothing was done on any
};

/// What a verb does on one tool, and what it says of several: how tools are opened, asked about and
/// handled side by side is the driver's part (driver.hpp). `Plan` is what is meant for a tool;
/// `Done` is what came of it, an `Outcome` or something that has one.
///
/// On one tool the order is plan, ask, open, examine, perform; where the question rests on the tool
/// it is asked behind examine. On several it is the same for each alone, or where the verb changes
/// tools: all are planned, one question stands for all of them, and each is opened again, confirmed
/// and changed.
template <typename PlanType, typename DoneType>
class Verb {
 public:
  using Plan = PlanType;
  using Done = DoneType;
  using AllPlanned = std::vector<Planned<Plan>>;
  using AllDone = GroupResult<Plan, Done>;

  /// Which tools of a group have to be fit for what is typed, as far as can be known before any is
  /// asked: otherwise the command ends.
  enum class Fit : std::uint8_t { none, one, all };
  /// What a plan for a tool of a group rests on, or the question about one tool.
  enum class Basis : std::uint8_t { profile, tool };

  Verb() = default;
  Verb(const Verb&) = delete;
  Verb& operator=(const Verb&) = delete;
  virtual ~Verb() = default;

  /// What has to be known of the registers before they are used.
  [[nodiscard]] virtual Need need() const { return Need::named_registers; }
  [[nodiscard]] virtual Fit fit() const { return Fit::none; }
  /// Whether tools are changed, so that the tools of a group are planned as a whole, and each has
  /// to be the one that is meant (see Purpose).
  [[nodiscard]] virtual bool changes_tools() const { return false; }
  [[nodiscard]] virtual Basis basis() const { return Basis::profile; }
  [[nodiscard]] virtual Basis question_basis() const { return Basis::profile; }
  /// The columns of a group whose lists are shown while they grow; none: shown at the end.
  [[nodiscard]] virtual std::vector<report::Column> live_columns() const { return {}; }

  /// What a word that was taken for a tool means otherwise, such as "a parameter"; empty: nothing.
  [[nodiscard]] virtual std::string_view otherwise(const std::string& /*word*/,
                                                   const catalogue::Profile& /*profile*/) const {
    return {};
  }

  /// What is meant for a tool of this profile. Asks and tells nothing.
  virtual Result<Plan> plan(const catalogue::Profile& profile, const Target& target) const = 0;

  /// Adds to the plan what only the tool can say. Reads only.
  virtual Result<Plan> examine(OpenTool& /*tool*/, Plan plan, Context& /*context*/) const {
    return plan;
  }

  /// Asks before anything is changed; `of` tools are meant.
  virtual Result<void> ask(const AllPlanned& /*planned*/, std::size_t /*of*/,
                           Context& /*context*/) const {
    return {};
  }

  /// The plan as it is to be carried out on a tool of a group that was opened again. Reads only.
  virtual Result<Plan> confirm(OpenTool& /*tool*/, const Plan& plan, Context& /*context*/) const {
    return plan;
  }

  /// False: conclude() needs no tool for this plan.
  [[nodiscard]] virtual bool needs_tool(const Plan& /*plan*/) const { return true; }
  virtual Result<Done> conclude(const Target& /*target*/, const Plan& /*plan*/,
                                Context& /*context*/) const {
    return tl::unexpected(Error{.code = Errc::internal});
  }

  /// Does it, and tells it. Errors that are told through a Listing of `context` are about the tool.
  virtual Result<Done> perform(OpenTool& tool, const Plan& plan, Context& context) const = 0;

  /// A tool of a group was not reached, or is not as it was planned. `plan` is null where there is
  /// none yet: then it may also be that its turn did not come. By default it is an error of this
  /// tool alone.
  virtual Result<Done> give_up(const Target& /*target*/, const Plan* /*plan*/, const Error& error,
                               Context& /*context*/) const {
    return tl::unexpected(error);
  }

  /// The last words about a group.
  [[nodiscard]] virtual std::optional<Summary> summary(const AllDone& /*all*/) const {
    return std::nullopt;
  }
};

}  // namespace spindle::commands
