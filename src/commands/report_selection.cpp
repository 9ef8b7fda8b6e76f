#include "report_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "result_key.hpp"
#include "spindle/base/text.hpp"
#include "stored_choice.hpp"

namespace spindle::commands {
namespace {

using store::Place;
using store::RowId;

/// The places that were named, by target or group. No row is 0.
Result<void> add_targets(const ReportOptions& options, const std::vector<Place>& places,
                         Context& context, store::Filter& filter) {
  std::vector<std::string> names;
  std::set<std::string> known;
  for (const Place& place : places) known.insert(place.name);
  for (const auto& [group, members] : context.tools.groups) known.insert("@" + group);
  for (const std::string& text : options.targets) {
    const auto fault = context.tools.faults.find(text);
    if (names_group(text) && fault != context.tools.faults.end()) {
      return tl::unexpected(fault->second);
    }
    const auto group = context.tools.groups.find(text.substr(1));
    if (!names_group(text)) {
      names.push_back(text);
    } else if (group != context.tools.groups.end()) {
      names.insert(names.end(), group->second.begin(), group->second.end());
    } else {
      return tl::unexpected(unknown_in_store(text, {known.begin(), known.end()}));
    }
  }
  for (const std::string& name : names) {
    const std::size_t before = filter.places.size();
    for (const Place& place : places) {
      if (place.name == name || place.url == name) filter.places.push_back(place.id);
    }
    if (filter.places.size() > before) continue;
    const auto& tools = context.tools.tools;
    const bool is_tool = std::any_of(tools.begin(), tools.end(),
                                     [&](const files::Tool& tool) { return tool.name == name; });
    if (!is_tool) return tl::unexpected(unknown_in_store(name, {known.begin(), known.end()}));
    context.renderer.note(fmt::format("{}: nothing of it is stored", name));
  }
  if (!options.targets.empty() && filter.places.empty()) filter.places = {0};
  return {};
}

Result<void> add_tools(const ReportOptions& options, const work::StoreFacts& facts,
                       store::Filter& filter) {
  for (const std::string& text : options.tools) {
    std::set<RowId> found;
    std::set<std::string> known;
    for (const store::Tool& tool : facts.tools) {
      if (tool.name.serial == text) found.insert(tool.id);
      known.insert(tool.name.serial);
    }
    for (const Place& place : facts.places) {
      if (place.name == text || place.url == text) found.insert(place.tool);
      known.insert(place.name);
    }
    if (found.empty()) return tl::unexpected(unknown_in_store(text, {known.begin(), known.end()}));
    filter.tools.insert(filter.tools.end(), found.begin(), found.end());
  }
  return {};
}

/// Gaps are of tools, not of places.
store::Filter gaps_filter(const store::Filter& events, const std::vector<Place>& places) {
  store::Filter filter{.tools = events.tools, .since = events.since, .until = events.until};
  if (events.places.empty()) return filter;
  std::set<RowId> tools;
  for (const Place& place : places) {
    const bool is_meant =
        std::find(events.places.begin(), events.places.end(), place.id) != events.places.end();
    const bool fits = events.tools.empty() || std::find(events.tools.begin(), events.tools.end(),
                                                        place.tool) != events.tools.end();
    if (is_meant && fits) tools.insert(place.tool);
  }
  filter.tools.assign(tools.begin(), tools.end());
  if (filter.tools.empty()) filter.tools = {0};
  return filter;
}

void add_products(Context& context, work::StoreFacts& facts) {
  for (const Place& place : facts.places) {
    const auto [found, is_new] = facts.products.try_emplace(place.profile);
    if (!is_new) continue;
    const auto profile = context.profiles.load(place.profile);
    const auto codes = context.profiles.load_error_codes(place.profile);
    if (profile && codes) {
      found->second = work::facts_of(*profile, *codes);
    } else {
      context.renderer.note(
          fmt::format("{}: profile '{}' cannot be loaded, so that no error code of it is known",
                      place.name, place.profile));
    }
  }
}

template <typename T>
Result<void> take(Result<T> from, T& into) {
  return std::move(from).map([&](T value) { into = std::move(value); });
}

Result<files::JointLimits> read_limits(std::string_view option, const std::string& text) {
  const auto limits = files::parse_limits(text);
  if (limits) return *limits;
  return tl::unexpected(bad_option(option, fmt::format("'{}' are no limits", text),
                                   "write LOWER:UPPER, such as 2.44:2.98, or one of the two"));
}

}  // namespace

Result<ReportSelection> select_for_report(const ReportOptions& options, store::Reader& reader,
                                          Context& context) {
  ReportSelection selection;
  store::Filter& filter = selection.filter;
  work::StoreFacts& facts = selection.facts;
  using enum store::Column;
  filter.columns = {preset, target_torque, torque, a3, error, direction};
  auto read = add_times(options.since, options.until, context.clock, filter)
                  .and_then([&] { return take(reader.tools(), facts.tools); })
                  .and_then([&] { return take(reader.places(), facts.places); })
                  .and_then([&] { return take(reader.epochs(), facts.epochs); })
                  .and_then([&] { return take(reader.settings(), facts.settings); })
                  .and_then([&] { return add_targets(options, facts.places, context, filter); })
                  .and_then([&] { return add_tools(options, facts, filter); })
                  .and_then([&] {
                    return take(reader.gaps(gaps_filter(filter, facts.places)), facts.gaps);
                  });
  if (!read) return tl::unexpected(std::move(read.error()));
  add_products(context, facts);
  return selection;
}

Result<work::StudyOptions> study_options_of(const ReportOptions& options,
                                            const files::Tools& tools) {
  work::StudyOptions study{.shift_break = options.shift_break,
                           .include_not_completed = options.include_not_completed,
                           .preset = options.preset};
  for (const files::Tool& tool : tools.tools) {
    if (tools.faults.contains(tool.name)) continue;  // told by the report
    for (const auto& [preset, limits] : tool.limits) study.joints[{tool.name, preset}] = limits;
  }
  const auto add = [&](std::string_view option, const std::string& text,
                       Quantity quantity) -> Result<void> {
    if (text.empty()) return {};
    return read_limits(option, text).map([&](const files::JointLimits& limits) {
      study.limits[quantity] = limits;
    });
  };
  return add("--limits", options.limits, Quantity::torque)
      .and_then([&] { return add("--angle-limits", options.angle_limits, Quantity::angle); })
      .map([&] { return std::move(study); });
}

Result<std::vector<work::Exclusion>> exclusions_of(const ReportOptions& options) {
  if (options.excluded.size() != options.reasons.size()) {
    return tl::unexpected(bad_option("--exclude", "each excluded result needs a reason",
                                     "add --reason TEXT behind each --exclude"));
  }
  std::vector<work::Exclusion> exclusions;
  for (std::size_t at = 0; at < options.excluded.size(); ++at) {
    const std::string& key = options.excluded[at];
    const auto named = parse_result_key(key);
    if (!named || options.reasons[at].empty()) {
      return tl::unexpected(bad_option("--exclude", fmt::format("'{}' names no result", key),
                                       std::string(result_key_hint)));
    }
    exclusions.push_back({.serial = named->serial,
                          .epoch = named->epoch,
                          .number = named->number,
                          .reason = options.reasons[at]});
  }
  return exclusions;
}

}  // namespace spindle::commands
