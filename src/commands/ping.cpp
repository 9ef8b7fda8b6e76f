#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <numeric>

#include "group.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"

namespace spindle::commands {
namespace {

using report::Align;

std::string in_milliseconds(Duration duration) {
  return report::to_text(milliseconds(duration)) + " ms";
}

const std::array<report::Column, 2> columns = {
    {{"SEQUENCE", "sequence", Align::right}, {"ROUND TRIP", "round_trip_ms"}}};

/// With widths, as the lines of several tools are told when they come.
const std::array<report::Column, 3> group_columns = {
    {{"TARGET", "target", Align::left, 16},
     {"SEQUENCE", "sequence", Align::right, 8},
     {"ROUND TRIP", "round_trip_ms", Align::left, 10}}};

/// What was counted, of one tool or of several.
struct Statistics {
  Outcome outcome = {};
  unsigned sent = 0;
  std::vector<Duration> times = {};

  void add(const Statistics& other) {
    outcome.add(other.outcome);
    sent += other.sent;
    times.insert(times.end(), other.times.begin(), other.times.end());
  }
};

Summary summary_of(const Statistics& statistics, const std::string& target) {
  const std::vector<Duration>& times = statistics.times;
  Summary summary{.counts = {{"sent", number(statistics.sent)}, {"received", count(times.size())}},
                  .sentence = fmt::format("{} sent, {} received", statistics.sent, times.size()),
                  .target = target};
  report::Cell minimum;
  report::Cell mean;
  report::Cell maximum;
  if (!times.empty()) {
    const auto [low, high] = std::minmax_element(times.begin(), times.end());
    const Duration total = std::accumulate(times.begin(), times.end(), Duration::zero());
    const Duration average = total / static_cast<Duration::rep>(times.size());
    minimum = milliseconds(*low);
    mean = milliseconds(average);
    maximum = milliseconds(*high);
    summary.sentence += fmt::format("; minimum {}, mean {}, maximum {}", in_milliseconds(*low),
                                    in_milliseconds(average), in_milliseconds(*high));
  }
  summary.counts.push_back({"minimum_ms", minimum});
  summary.counts.push_back({"mean_ms", mean});
  summary.counts.push_back({"maximum_ms", maximum});
  return summary;
}

report::Record ping_record(unsigned sequence, Duration round_trip, const Target& target,
                           const Clock& clock) {
  return {.type = "ping",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"sequence", number(sequence)},
                     {"round_trip_ms", milliseconds(round_trip), in_milliseconds(round_trip)}}};
}

/// Trouble after which asking again on this connection is pointless.
bool ends_ping(const Error& error) { return error.code != Errc::no_answer; }

/// The one list, which several threads tell what comes.
class Stage {
 public:
  Stage(std::span<const report::Column> shown, Context& context) : listing_(context, shown) {}

  template <typename News>
  void add(const News& news) {
    const std::lock_guard lock(mutex_);
    listing_.add(news);
  }
  [[nodiscard]] bool open() {
    const std::lock_guard lock(mutex_);
    return listing_.open();
  }
  /// Once all threads are done.
  Listing& listing() { return listing_; }

 private:
  std::mutex mutex_ = {};
  Listing listing_;
};

Result<OpenTool> connect_one(const Target& target, const Context& context) {
  auto profile = load_profile(target, context);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  return connect(target, std::move(*profile), context);
}

Statistics ping_tool(OpenTool& tool, const Target& target, const PingOptions& options, Stage& stage,
                     const Context& context) {
  Statistics counted;
  while (stage.open() && counted.sent < options.count) {
    const TimePoint next = context.clock.now() + options.interval;
    ++counted.sent;
    const auto round_trip = tool.device.ping();
    if (round_trip) {
      counted.times.push_back(*round_trip);
      counted.outcome.succeed();
      stage.add(ping_record(counted.sent, *round_trip, target, context.clock));
    } else {
      counted.outcome.fail(round_trip.error());
      stage.add(round_trip.error());
      if (ends_ping(round_trip.error())) break;
    }
    if (counted.sent == options.count) break;
    if (auto slept = context.clock.sleep_until(next); !slept) {
      counted.outcome.fail(slept.error());
      break;
    }
  }
  return counted;
}

Result<Outcome> ping_one(const Target& target, const PingOptions& options, Context& context) {
  auto tool = connect_one(target, context);
  if (!tool) return tl::unexpected(std::move(tool.error()));
  Stage stage(columns, context);
  const Statistics counted = ping_tool(*tool, target, options, stage, context);
  return finish(stage.listing(), counted.outcome, summary_of(counted, target.shown), context);
}

/// A tool that can not be reached keeps nobody from the others.
Statistics ping_member(const Target& target, const PingOptions& options, Stage& stage,
                       const Context& context) {
  auto tool = context.interrupt.signalled()
                  ? Result<OpenTool>(tl::unexpected(not_begun(target, context)))
                  : connect_one(target, context);
  if (tool) return ping_tool(*tool, target, options, stage, context);
  Statistics none;
  none.outcome.fail(tool.error());
  stage.add(of_tool(target, tool.error()));
  return none;
}

/// Each tool's own summary, then that of all.
Result<Outcome> ping_group(const std::vector<Target>& targets, const PingOptions& options,
                           Context& context) {
  Stage stage(group_columns, context);
  const auto parts = side_by_side(targets, options.jobs, [&](const Target& target) {
    return ping_member(target, options, stage, context);
  });
  if (auto ended = stage.listing().end(); !ended) return tl::unexpected(std::move(ended.error()));
  Statistics all;
  for (std::size_t index = 0; index < targets.size(); ++index) {
    const std::string& name = targets[index].shown;
    Summary summary = summary_of(parts[index], name);
    summary.sentence = fmt::format("{}: {}", name, summary.sentence);
    if (auto told = tell(std::move(summary), parts[index].outcome, context); !told) {
      return tl::unexpected(std::move(told.error()));
    }
    all.add(parts[index]);
  }
  Summary summary = summary_of(all, {});
  summary.sentence = fmt::format("{}: {}", counted(targets.size(), "tool"), summary.sentence);
  return tell(std::move(summary), all.outcome, context).map([&] { return all.outcome; });
}

}  // namespace

Result<Outcome> ping(const PingOptions& options, Context& context) {
  const auto targets = resolve_one_or_group(options.target, Reach::one, context);
  if (!targets) return tl::unexpected(targets.error());
  return is_group(options.target, Reach::one) ? ping_group(*targets, options, context)
                                              : ping_one(targets->front(), options, context);
}

}  // namespace spindle::commands
