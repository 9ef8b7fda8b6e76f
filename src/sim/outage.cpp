#include "spindle/sim/outage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"

namespace spindle::sim {
namespace {

struct KindInfo {
  OutageKind kind;
  std::string_view name;
  std::string_view meaning;
};

constexpr std::array kinds = {
    KindInfo{OutageKind::sleep, "sleep",
             "hears and says nothing, then answers late; connections survive"},
    KindInfo{OutageKind::roam, "roam", "out of reach of its access point; connections are lost"},
    KindInfo{
        OutageKind::reboot, "reboot",
        "switched off and on: connections and all that is not stored are lost, events count from "
        "0"},
    KindInfo{OutageKind::other_client, "other-client",
             "another client holds its session: all others are shut out"},
};

constexpr std::string_view every_mark = "@every:";

Error bad(std::string_view text, std::string message) {
  return {.code = Errc::bad_value,
          .message = fmt::format("outage '{}': {}", text, message),
          .hint = "write it like sleep=3s@every:20s"};
}

Result<OutageKind> parse_kind(std::string_view text, std::string_view name) {
  std::vector<std::string> names;
  for (const KindInfo& row : kinds) {
    if (row.name == name) return row.kind;
    names.emplace_back(row.name);
  }
  Error error = bad(text, fmt::format("no such kind '{}'", name));
  if (std::string hint = suggestion(name, names); !hint.empty()) error.hint = std::move(hint);
  return tl::unexpected(std::move(error));
}

}  // namespace

std::string_view to_text(OutageKind kind) {
  return std::find_if(kinds.begin(), kinds.end(),
                      [kind](const KindInfo& row) { return row.kind == kind; })
      ->name;
}

bool needs_radio(OutageKind kind) {
  return kind == OutageKind::roam || kind == OutageKind::other_client;
}

Result<Outage> parse_outage(std::string_view text) {
  const auto equals = text.find('=');
  TRY_LET(const auto kind, parse_kind(text, text.substr(0, std::min(equals, text.find('@')))));
  const auto mark = text.find(every_mark);
  if (equals == std::string_view::npos || mark == std::string_view::npos || mark < equals) {
    return tl::unexpected(bad(text, "how long and how often it happens is missing"));
  }
  const auto lasts = parse_duration(text.substr(equals + 1, mark - equals - 1));
  const auto every = parse_duration(text.substr(mark + every_mark.size()));
  if (!lasts || !every) {
    return tl::unexpected(bad(text, message_of(lasts ? every.error() : lasts.error())));
  }
  if (*lasts <= Duration::zero() || *lasts >= *every) {
    return tl::unexpected(bad(text, "it must last some time, and less than the interval"));
  }
  return Outage{kind, *lasts, *every};
}

std::vector<OutageHelp> outage_help() {
  std::vector<OutageHelp> help;
  help.reserve(kinds.size());
  for (const KindInfo& row : kinds) {
    help.push_back({fmt::format("{}=TIME@every:TIME", row.name), row.meaning});
  }
  return help;
}

std::optional<OutageKind> OutageSchedule::at(TimePoint now) const {
  for (const Outage& outage : outages_) {
    const Duration elapsed = now - begin_;
    if (elapsed >= outage.every && elapsed % outage.every < outage.lasts) return outage.kind;
  }
  return std::nullopt;
}

std::optional<TimePoint> OutageSchedule::next_change(TimePoint now) const {
  std::optional<TimePoint> next;
  for (const Outage& outage : outages_) {
    const Duration elapsed = std::max(now - begin_, Duration::zero());
    const TimePoint round = begin_ + (elapsed - elapsed % outage.every);
    const bool first = elapsed < outage.every;
    const bool lasts = !first && elapsed % outage.every < outage.lasts;
    const TimePoint change = lasts ? round + outage.lasts : round + outage.every;
    if (!next || change < *next) next = change;
  }
  return next;
}

}  // namespace spindle::sim
