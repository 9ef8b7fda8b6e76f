#include "spindle/work/learning.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "spindle/base/text.hpp"
#include "spindle/work/register_survey.hpp"

namespace spindle::work {
namespace {

// From one moment to the next. A change that a person makes by hand lasts longer.
constexpr Duration moment_pause = std::chrono::milliseconds(150);

// A register may follow about a second later.
constexpr std::size_t moments_to_settle = 6;

// Where several still follow, so many times the changes are waited for.
constexpr std::size_t patience = 2;

/// Registers of commands that the profile knows, and of values: none of them is what is looked for.
std::set<std::uint16_t> named_registers(const catalogue::Profile& profile,
                                        modbus::RegisterTable table) {
  std::set<std::uint16_t> known;
  for (const catalogue::Action& action : profile.actions) {
    if (action.table == table) known.insert(action.address.value);
  }
  for (const catalogue::Parameter& parameter : profile.parameters) {
    if (parameter.table != table) continue;
    for (unsigned at = 0; at < catalogue::register_count(parameter.encoding); ++at) {
      known.insert(static_cast<std::uint16_t>(parameter.address.value + at));
    }
  }
  if (profile.events && profile.events->arm) known.insert(profile.events->arm->address);
  return known;
}

/// Reads what is watched, and the blocks in which there is still something to look at.
class MomentReader {
 public:
  MomentReader(OpenTool& tool, catalogue::Parameter watched, modbus::RegisterTable table,
               const std::vector<link::RegisterRun>& runs)
      : tool_(&tool), watched_(std::move(watched)) {
    const std::size_t longest = tool.device.limits().max_read;
    for (const link::RegisterRun& run : runs) {
      for (std::size_t at = 0; at < run.values.size(); at += longest) {
        const std::size_t count = std::min(longest, run.values.size() - at);
        blocks_.push_back(
            {table, static_cast<std::uint16_t>(run.first + at), static_cast<std::uint16_t>(count)});
      }
    }
  }

  void keep_only(const std::set<std::uint16_t>& candidates) {
    std::erase_if(blocks_, [&](const link::RegisterRange& block) {
      const auto next = candidates.lower_bound(block.first);
      return next == candidates.end() || *next >= unsigned{block.first} + block.count;
    });
  }

  /// Empty: what is watched changed while it was read.
  Result<std::optional<Moment>> read() {
    TRY_LET(const auto before, read_watched());
    Moment moment{.watched = before};
    for (const link::RegisterRange& block : blocks_) {
      TRY_LET(const auto values, tool_->device.read_block(block));
      for (std::size_t at = 0; at < values.size(); ++at) {
        moment.registers[static_cast<std::uint16_t>(block.first + at)] = values[at];
      }
    }
    TRY_LET(const auto behind, read_watched());
    if (before != behind) return std::nullopt;
    return moment;
  }

 private:
  Result<std::uint16_t> read_watched() {
    TRY_LET(const auto registers,
            tool_->device.read_block({watched_.table, watched_.address.value, 1}));
    return registers.front();
  }

  OpenTool* tool_;
  catalogue::Parameter watched_;
  std::vector<link::RegisterRange> blocks_ = {};
};

Learned judge(const LearnPlan& plan, const std::vector<Follower>& followers) {
  if (followers.empty()) return Learned::none;
  if (followers.size() > 1) return Learned::several;
  const Follower& one = followers.front();
  const bool is_plain =
      plan.what.by == catalogue::LearnedBy::value ? one.is_equal : one.value.has_value();
  return is_plain ? Learned::one : Learned::other;
}

/// Whether further changes can say more.
bool is_enough(const LearnPlan& plan, const FollowerSearch& search) {
  const std::size_t left = search.candidates().size();
  if (left == 0) return search.changes() > 0;
  if (search.changes() < plan.changes) return false;
  return left == 1 || search.changes() >= patience * plan.changes;
}

}  // namespace

Result<LearnPlan> plan_learning(const std::string& name, const catalogue::Profile& profile) {
  Error error{.code = Errc::usage, .name = name};
  if (const auto known = profile.find_action(name)) {
    error.message =
        fmt::format("profile {} knows its register: {}", profile.id, known->address.value);
    error.hint = "'spindle do TARGET' lists the actions";
    return tl::unexpected(std::move(error));
  }
  if (!profile.learn) {
    error.message = fmt::format("profile {} names nothing that a tool can show", profile.id);
    return tl::unexpected(std::move(error));
  }
  std::vector<std::string> names;
  for (const catalogue::LearnedAction& action : profile.learn->actions) {
    if (action.name == name) return LearnPlan{.where = *profile.learn, .what = action};
    names.push_back(action.name.to_string());
  }
  error.code = Errc::unknown_name;
  error.message = "this is nothing that can be learned";
  error.hint = suggestion(name, names);
  if (error.hint.empty()) error.hint = fmt::format("it may be {}", fmt::join(names, ", "));
  return tl::unexpected(std::move(error));
}

Result<LearnResult> learn_register(OpenTool& tool, const LearnPlan& plan, Clock& clock,
                                   const std::function<void(const LearnNews&)>& tell,
                                   const link::Progress& progress) {
  const catalogue::Profile& profile = tool.device.profile();
  TRY_LET(const auto watched, profile.find(plan.what.follows.view()));
  const RegisterSpan span{plan.where.table, plan.where.from, plan.where.to};
  const RegisterSurvey survey =
      survey_registers(tool, askable(span, profile, named_registers(profile, span.table)),
                       usual_pause, clock, progress);
  if (survey.error) return tl::unexpected(*survey.error);
  LearnResult result{.readable = survey.answered};
  if (survey.answered == 0) {
    result.how = Learned::unreadable;
    return result;
  }
  MomentReader reader(tool, watched, span.table, survey.runs);
  std::optional<FollowerSearch> search;
  TimePoint last_change = clock.now();
  while (!search || !is_enough(plan, *search)) {
    TRY_LET(const auto moment, reader.read());
    const TimePoint now = clock.now();
    if (moment && !search) {
      search.emplace(plan.what.by, *moment, moments_to_settle);
      tell({.to = moment->watched, .candidates = survey.answered});
    } else if (moment) {
      std::uint16_t before = search->numbers().back();
      if (search->take(*moment)) {
        if (plan.what.by == catalogue::LearnedBy::clearing) before = search->numbers().back();
        last_change = now;
        tell({LearnNews::Kind::changed, before, moment->watched, search->changes(),
              search->candidates().size()});
      }
      reader.keep_only(search->candidates());
    }
    if (now - last_change >= plan.idle_timeout) {
      if (search) result.numbers = search->numbers();
      result.how = Learned::idle;
      return result;
    }
    TRY(clock.sleep_until(now + moment_pause));
  }
  result.numbers = search->numbers();
  result.followers = search->followers();
  result.how = judge(plan, result.followers);
  return result;
}

}  // namespace spindle::work
