#include "find_block.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "listing.hpp"
#include "progress.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "seen_on_tool.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"
#include "spindle/work/block_search.hpp"

namespace spindle::commands {
namespace {

using catalogue::BlockSearch;
using catalogue::Profile;

/// For an event, which a person makes by driving a screw.
constexpr Duration patience = std::chrono::minutes(5);

bool has_search(const Profile& profile, std::string_view name) {
  return profile.events && profile.events->search && profile.events->search->name == name;
}

void tell_news(const work::BlockSearchNews& news, const Context& context) {
  using Kind = work::BlockSearchNews::Kind;
  switch (news.kind) {
    case Kind::waiting:
      return context.renderer.note(
          fmt::format("waiting for an event: drive one screw (Ctrl-C ends it; given up after {})",
                      to_text(patience)));
    case Kind::event:
      return context.renderer.note(fmt::format("event {} was pushed; looking for it", news.number));
    case Kind::again:
      return context.renderer.note(
          fmt::format("{} places hold event {}: drive another screw, to tell them apart",
                      news.places, news.number));
  }
}

std::string registers_in_words(const std::vector<std::uint16_t>& places) {
  return fmt::format("{} {}", places.size() == 1 ? "register" : "registers",
                     fmt::join(places, ", "));
}

/// What came of it, of `asked` places.
std::string sentence_of(const work::BlockSearchResult& result) {
  if (!result.number) {
    return fmt::format("no event was pushed within {}: nothing was found out", to_text(patience));
  }
  std::string sentence;
  if (result.places.empty()) {
    sentence = fmt::format("event {} stands at none of {} places", *result.number, result.asked);
  } else {
    sentence =
        fmt::format("event {} stands at {}", *result.number, registers_in_words(result.places));
  }
  if (result.places.size() > 1) sentence += ": which of them is the last event is not known";
  if (!result.similar.empty()) {
    sentence += fmt::format("; {} {} the same event by its number and time, but not all of it",
                            registers_in_words(result.similar),
                            result.similar.size() == 1 ? "holds" : "hold");
  }
  return sentence + fmt::format("; {} of {} places can be read", result.answered, result.asked);
}

class FindBlock final : public Verb<BlockSearch, Outcome> {
 public:
  FindBlock(const std::string& name, files::SeenOnTool& seen) : name_(&name), seen_(&seen) {}

  Result<Plan> plan(const Profile& profile, const Target& /*target*/) const override {
    if (has_search(profile, *name_)) return *profile.events->search;
    TRY(profile.find_action(*name_));
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = fmt::format("profile {} has no such search", profile.id),
                                .name = *name_});
  }

  Result<Done> perform(OpenTool& tool, const Plan& plan, Context& context) const override {
    if (tool.target.endpoint.medium == link::Medium::simulated) {
      TRY_LET(auto device,
              connect_device(tool.target, *tool.profile, context, SimulatedOperator::working));
      tool.device = std::move(device);
      TRY(tool.device.require_known_registers());
    }
    ProgressLine progress(context);
    const auto result = work::search_block(
        tool, patience, context.clock, [&](const auto& news) { tell_news(news, context); },
        progress.counter(tool.target.shown + ": places read"));
    if (!result) return tl::unexpected(result.error());
    Outcome outcome;
    result->places.size() == 1 ? outcome.succeed() : outcome.negate();
    if (result->places.size() == 1) TRY(tell_place(tool, plan, *result, context));
    return tell({.counts = {{"places", report::Words(result->places)},
                            {"similar", report::Words(result->similar)},
                            {"asked", count(result->asked)},
                            {"answered", count(result->answered)}},
                 .sentence = sentence_of(*result),
                 .target = tool.target.shown},
                outcome, context)
        .map([&] { return outcome; });
  }

 private:
  Result<void> tell_place(const OpenTool& tool, const Plan& plan,
                          const work::BlockSearchResult& result, Context& context) const {
    const catalogue::EventSpec& events = *tool.device.profile().events;
    name_tool(tool, context.clock, *seen_);
    seen_->event_block = result.places.front();
    seen_->remarks = {
        fmt::format("Event {}, which was pushed, was read there, register by "
                    "register; at none of {} other places.",
                    *result.number, result.asked - 1)};
    const std::string text = files::render_user_profile(*seen_);
    report::Record record{
        .type = "block",
        .target = tool.target.shown,
        .time = context.clock.wall(),
        .fields = {{"search", plan.name},
                   {"table", std::string(modbus::to_text(catalogue::table_of(events)))},
                   {"register", number(*seen_->event_block)},
                   {"count", number(events.count)},
                   {"event_number", number(*result.number)},
                   {"profile", text}}};
    TRY(report::is_table(context.user.format)
            ? show_profile(text, context)
            : context.renderer.line(record, fmt::to_string(*seen_->event_block)));
    context.renderer.note(
        fmt::format("save these lines as {}.yaml, and use it with --profile or "
                    "in the tools file",
                    seen_->id));
    return {};
  }

  const std::string* name_;
  files::SeenOnTool* seen_;
};

}  // namespace

bool wants_search(const DoOptions& options, const Targets& targets, const Context& context) {
  const auto wanted_of = [&](const Profile& profile) {
    return std::any_of(options.actions.begin(), options.actions.end(),
                       [&](const std::string& action) { return has_search(profile, action); });
  };
  return std::any_of(targets.tools.begin(), targets.tools.end(), [&](const Target& target) {
    if (!target.profile.empty()) {
      const auto profile = load_profile(target, context);
      return profile && wanted_of(*profile);
    }
    const auto profiles = context.profiles.load_all();
    return std::any_of(profiles.begin(), profiles.end(), wanted_of);
  });
}

Result<Outcome> find_block(const DoOptions& options, const Targets& targets, Context& context) {
  if (options.actions.size() > 1 || targets.is_group) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "a search is done on one tool, and beside nothing else",
                                .hint = "name one tool and the search alone"});
  }
  TRY_LET(auto seen, begin_user_profile({}, context));
  return run_verb(FindBlock(options.actions.front(), seen), targets, 1, context);
}

std::string search_in_words(const Profile& profile, const Target& target) {
  if (!profile.events || !profile.events->search) return {};
  const BlockSearch& search = *profile.events->search;
  const auto& arm = profile.events->arm;
  const std::string writes =
      arm ? fmt::format("writes only {}, which makes the tool tell its events", arm->address)
          : std::string("reads only");
  return fmt::format("{} ({}): 'spindle do {} {}'", search.title, writes, shell_word(target.shown),
                     search.name);
}

}  // namespace spindle::commands
