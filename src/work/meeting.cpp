#include "spindle/work/meeting.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "spindle/base/text.hpp"

namespace spindle::work {
namespace {

std::optional<Error> misfit_of(const Target& target, const Identification& found) {
  if (target.profile.empty() || !found.candidates.empty()) return std::nullopt;
  return Error{.code = Errc::mismatch,
               .message = fmt::format("this is not what profile {} describes: {}", target.profile,
                                      fmt::join(found.identity.notes, "; "))};
}

/// One exchange that touches nothing. A device that knows only reads and writes of registers stays
/// silent to others, so its first parameter is read.
Result<Duration> meet_once(OpenTool& tool) {
  auto round_trip = tool.device.ping();
  const bool silent = !round_trip && round_trip.error().code == Errc::no_answer;
  const auto readable = tool.profile->select({});  // nothing that reading clears
  if (!silent || tool.profile->link.loopback || !readable || readable->empty()) return round_trip;
  const auto read = tool.device.read_each({readable->front()}, device::Limits::skip);
  if (!read) return tl::unexpected(read.error());
  return tool.device.session().last_round_trip();
}

/// A product without an identity can only be met, not proven.
Result<Meeting> meet_unproven(OpenTool& tool) {
  TRY_LET(const auto round_trip, meet_once(tool));
  const catalogue::Profile& profile = *tool.profile;
  Identification found;
  found.profile = profile.id;
  found.candidates = {profile.id};
  found.maker = profile.maker;
  found.series = profile.series;
  found.identity.notes.push_back(
      fmt::format("{}, but {} cannot prove what it is: profile {} is what the user named",
                  profile.link.loopback ? "answers a loop-back" : "answers",
                  profile.series.empty() ? "it" : with_article(profile.series), profile.id));
  return Meeting{.found = std::move(found), .round_trip = round_trip, .is_proven = false};
}

}  // namespace

Result<Meeting> meet(OpenTool& tool, const Environment& environment) {
  const Target& target = tool.target;
  // What says nothing of an identity cannot be contradicted by one.
  const bool named = !target.profile.empty();
  if (named && !tool.profile->identity) return meet_unproven(tool);
  if (!named && target.endpoint.medium != link::Medium::tcp) {
    return tl::unexpected(unproven(target));
  }
  TRY_LET(const auto answer, tool.device.report_server_id());
  const Duration round_trip = tool.device.session().last_round_trip();
  TRY_LET(auto found, match_identity(answer, target.profile, environment));
  if (const auto more = ask_more(tool, found); !more) {
    found.identity.notes.push_back(fmt::format(
        "what it says of itself in registers is not known: {}", message_of(more.error())));
  }
  auto misfit = misfit_of(target, found);
  if (!found.candidates.empty()) {
    remember_tool(tool, found.identity, found.candidates.front(), environment);
  }
  return Meeting{.found = std::move(found), .round_trip = round_trip, .misfit = std::move(misfit)};
}

}  // namespace spindle::work
