#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "listing.hpp"
#include "records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"

namespace spindle::commands {
namespace {

using report::Field;

std::string in_milliseconds(Duration duration) {
  return report::to_text(milliseconds(duration)) + " ms";
}

const std::array<report::Column, 2> columns = {
    {{"SEQUENCE", "sequence", report::Align::right}, {"ROUND TRIP", "round_trip_ms"}}};

Result<void> summarise(unsigned sent, const std::vector<Duration>& times, const Target& target,
                       ExitStatus status, Context& context) {
  std::vector<Field> fields = {{"sent", number(sent)},
                               {"received", number(static_cast<std::int64_t>(times.size()))}};
  std::string sentence = fmt::format("{} sent, {} received", sent, times.size());
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
    sentence += fmt::format("; minimum {}, mean {}, maximum {}", in_milliseconds(*low),
                            in_milliseconds(average), in_milliseconds(*high));
  }
  fields.push_back({"minimum_ms", minimum});
  fields.push_back({"mean_ms", mean});
  fields.push_back({"maximum_ms", maximum});
  return context.renderer.summary(
      summary_record(std::move(fields), status, target.shown, context.clock), sentence);
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

}  // namespace

Result<Outcome> ping(const PingOptions& options, Context& context) {
  const auto target = resolve_target(options.target, context);
  if (!target) return tl::unexpected(target.error());
  auto profile = load_profile(*target, context);
  if (!profile) return tl::unexpected(std::move(profile.error()));
  auto tool = connect(*target, std::move(*profile), context);
  if (!tool) return tl::unexpected(std::move(tool.error()));
  Outcome outcome;
  std::vector<Duration> times;
  Listing listing(context, columns);
  unsigned sent = 0;
  while (listing.open() && sent < options.count) {
    const TimePoint next = context.clock.now() + options.interval;
    ++sent;
    const auto round_trip = tool->device.ping();
    if (round_trip) {
      times.push_back(*round_trip);
      outcome.succeed();
      listing.add(ping_record(sent, *round_trip, *target, context.clock));
    } else {
      outcome.fail(round_trip.error());
      listing.add(round_trip.error());
      if (ends_ping(round_trip.error())) break;
    }
    if (sent == options.count) break;
    if (auto slept = context.clock.sleep_until(next); !slept) {
      outcome.fail(slept.error());
      break;
    }
  }
  return listing.end()
      .and_then([&] { return summarise(sent, times, *target, outcome.status(), context); })
      .map([&] { return outcome; });
}

}  // namespace spindle::commands
