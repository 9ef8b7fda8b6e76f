#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/clock.hpp"

namespace spindle::sim {

/// Ways in which a wireless tool is not there for its clients for a while. The text form is the
/// enumerator with '-' for '_'.
enum class OutageKind : std::uint8_t {
  sleep,         ///< it hears and says nothing; connections survive, requests are answered late
  roam,          ///< its radio is away: nothing passes, and its connections do not survive
  reboot,        ///< power off and on: as roam, and it forgets what it does not store
  other_client,  ///< another client holds its session: all others are shut out
};

/// One kind of outage that comes again and again: each `every`, for `lasts` (shorter than `every`).
struct Outage {
  OutageKind kind = OutageKind::sleep;
  Duration lasts = {};
  Duration every = {};
};

/// "other-client": the kind as parse_outage() reads it.
std::string_view to_text(OutageKind kind);

/// Whether only a tool with a radio can be away like this.
bool needs_radio(OutageKind kind);

/// Reads "KIND=LASTS@every:INTERVAL", such as "sleep=3s@every:20s". Error `bad_value` with a
/// suggestion.
Result<Outage> parse_outage(std::string_view text);

/// All kinds, one line each, for help and manual.
struct OutageHelp {
  std::string syntax;
  std::string_view meaning;
};
std::vector<OutageHelp> outage_help();

/// When a tool is away, from one moment on: the first outage of each kind comes one interval after
/// it. Where several meet, the one named first counts. Pure.
class OutageSchedule {
 public:
  OutageSchedule(std::vector<Outage> outages, TimePoint begin)
      : outages_(std::move(outages)), begin_(begin) {}

  /// The kind that is under way; empty when the tool is there.
  [[nodiscard]] std::optional<OutageKind> at(TimePoint now) const;

  /// When an outage will next begin or end, later than `now`; empty when none ever does.
  [[nodiscard]] std::optional<TimePoint> next_change(TimePoint now) const;

 private:
  std::vector<Outage> outages_;
  TimePoint begin_;
};

}  // namespace spindle::sim
