#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <variant>

#include "listing.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"

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

class Ping final : public Verb<std::monostate, Statistics> {
 public:
  explicit Ping(const PingOptions& options) : options_(&options) {}

  [[nodiscard]] Need need() const override { return Need::raw_registers; }
  [[nodiscard]] std::vector<report::Column> live_columns() const override {
    return {group_columns.begin(), group_columns.end()};
  }

  Result<Plan> plan(const catalogue::Profile& /*profile*/,
                    const Target& /*target*/) const override {
    return Plan();
  }

  Result<Done> perform(OpenTool& tool, const Plan& /*plan*/, Context& context) const override {
    Statistics counted;
    Listing listing(context, columns);
    while (listing.open() && counted.sent < options_->count) {
      const TimePoint next = context.clock.now() + options_->interval;
      const bool goes_on = ask_once(tool, counted, listing, context.clock);
      if (!goes_on || counted.sent == options_->count) break;
      if (auto slept = context.clock.sleep_until(next); !slept) {
        counted.outcome.fail(slept.error());
        break;
      }
    }
    return end(listing, counted, tool.target, context);
  }

  /// A tool that cannot be reached keeps none of the others from being asked, and is counted.
  Result<Done> give_up(const Target& target, const Plan* /*plan*/, const Error& error,
                       Context& context) const override {
    Statistics none;
    none.outcome.fail(error);
    Listing listing(context, columns);
    listing.add(error);
    return end(listing, none, target, context);
  }

  [[nodiscard]] std::optional<Summary> summary(const AllDone& all) const override {
    Statistics sum;
    for (const Result<Done>& done : all.done) {
      if (done) sum.add(*done);
    }
    Summary summary = summary_of(sum, {});
    summary.sentence = fmt::format("{}: {}", counted(all.tools, "tool"), summary.sentence);
    return summary;
  }

 private:
  /// False: asking again on this connection is pointless.
  static bool ask_once(OpenTool& tool, Statistics& counted, Listing& listing, const Clock& clock) {
    ++counted.sent;
    const auto round_trip = tool.device.ping();
    if (round_trip) {
      counted.times.push_back(*round_trip);
      counted.outcome.succeed();
      listing.add(ping_record(counted.sent, *round_trip, tool.target, clock));
      return true;
    }
    counted.outcome.fail(round_trip.error());
    listing.add(round_trip.error());
    return round_trip.error().code == Errc::no_answer;
  }

  static Result<Done> end(Listing& listing, const Statistics& counted, const Target& target,
                          Context& context) {
    return finish(listing, counted.outcome, summary_of(counted, target.shown), context)
        .map([&](const Outcome&) { return counted; });
  }

  const PingOptions* options_;
};

}  // namespace

Result<Outcome> ping(const PingOptions& options, Context& context) {
  return resolve_one_or_group(options.targets, Addressing::unicast, context)
      .and_then([&](const Targets& targets) {
        return run_verb(Ping(options), targets, options.jobs, context);
      });
}

}  // namespace spindle::commands
