#include <fmt/format.h>

#include <array>
#include <utility>
#include <variant>

#include "listing.hpp"
#include "motor_records.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/identification.hpp"
#include "spindle/work/shared_lines.hpp"

namespace spindle::commands {
namespace {

using report::Cell;
using report::Column;

const std::array<Column, 5> columns = {{{"MODEL", "tool_model"},
                                        {"SERIAL", "serial"},
                                        {"FIRMWARE", "firmware"},
                                        {"PROFILE", "profile"},
                                        {"ROUND TRIP", "round_trip_ms"}}};

/// One tool's answer, or why there is none.
struct Identified {
  report::Record record;
  std::optional<Error> misfit;  ///< it is not what --profile or the tools file says
};

template <typename Number>
Cell number_or_null(const std::optional<Number>& value) {
  return value ? number(static_cast<std::int64_t>(*value)) : Cell();
}

report::Record identity_record(const OpenTool& tool, const Identification& found,
                               Duration round_trip, const Clock& clock) {
  const catalogue::Identity& identity = found.identity;
  const Decimal tenths(
      std::chrono::duration_cast<std::chrono::microseconds>(round_trip).count() / 100, -1);
  return {.type = "identity",
          .target = tool.target.shown,
          .time = clock.wall(),
          .fields = {{"endpoint", tool.target.endpoint.text},
                     {"profile", text_or_null(found.profile),
                      fmt::format("{}", fmt::join(found.candidates, " or "))},
                     {"profile_candidates", found.candidates},
                     {"maker", text_or_null(found.maker)},
                     {"series", text_or_null(found.series)},
                     {"tool_model", text_or_null(identity.tool_model)},
                     {"tool_model_code", number_or_null(identity.tool_model_code)},
                     {"controller_model_code", number_or_null(identity.controller_model_code)},
                     {"id", number_or_null(identity.id)},
                     {"serial", text_or_null(identity.serial)},
                     {"firmware", number_or_null(identity.firmware)},
                     {"raw", to_compact_hex(identity.raw)},
                     {"round_trip_ms", milliseconds(round_trip), tenths.to_string() + " ms"},
                     {"notes", identity.notes},
                     {"total_fastenings", number_or_null(identity.total)}}};
}

std::optional<Error> misfit_of(const Target& target, const Identification& found) {
  if (target.profile.empty() || !found.candidates.empty()) return std::nullopt;
  return Error{.code = Errc::mismatch,
               .message = fmt::format("this is not what profile {} describes: {}", target.profile,
                                      fmt::join(found.identity.notes, "; "))};
}

/// The table has no room for notes, so people get them as sentences.
void tell_notes(const Identified& identified, const Context& context) {
  if (identified.misfit) return;  // its message says them
  const report::Field* notes = identified.record.find("notes");
  for (const std::string& note : std::get<report::Texts>(notes->cell)) {
    context.renderer.note(fmt::format("{}: {}", identified.record.target, note));
  }
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
Result<Identified> meet(OpenTool& tool, const Clock& clock) {
  TRY_LET(const auto round_trip, meet_once(tool));
  Identification found;
  found.profile = tool.profile->id;
  found.candidates = {tool.profile->id};
  found.maker = tool.profile->maker;
  found.series = tool.profile->series;
  found.identity.notes.push_back(fmt::format(
      "{}, but {} cannot prove what it is: profile {} is what the user named",
      tool.profile->link.loopback ? "answers a loop-back" : "answers",
      tool.profile->series.empty() ? "it" : with_article(tool.profile->series), tool.profile->id));
  if (auto words = motor_state_words(tool); !words.empty()) {
    found.identity.notes.push_back(std::move(words));
  }
  return Identified{identity_record(tool, found, round_trip, clock), std::nullopt};
}

Result<Identified> identify_one(OpenTool& tool, const Context& context) {
  const Target& target = tool.target;
  // What says nothing of an identity cannot be contradicted by one.
  const bool named = !target.profile.empty();
  if (named && !tool.profile->identity) return meet(tool, context.clock);
  if (!named && target.endpoint.medium != link::Medium::tcp) {
    return tl::unexpected(unproven(target));
  }
  TRY_LET(const auto answer, tool.device.report_server_id());
  const Duration round_trip = tool.device.session().last_round_trip();
  TRY_LET(const auto found, match_identity(answer, target.profile, context));
  return Identified{identity_record(tool, found, round_trip, context.clock),
                    misfit_of(target, found)};
}

class Identify final : public Verb<std::monostate, Outcome> {
 public:
  [[nodiscard]] Need need() const override { return Need::raw_registers; }

  Result<Plan> plan(const catalogue::Profile& /*profile*/,
                    const Target& /*target*/) const override {
    return Plan();
  }

  Result<Done> perform(OpenTool& tool, const Plan& /*plan*/, Context& context) const override {
    const auto identified = identify_one(tool, context);
    if (!identified) return tell_failure(identified.error(), context);
    Outcome outcome;
    Listing listing(context, columns);
    listing.add(identified->record);
    tell_notes(*identified, context);
    if (identified->misfit) {
      outcome.fail(*identified->misfit);
      listing.add(*identified->misfit);
    } else {
      outcome.succeed();
    }
    return finish(listing, outcome);
  }

  Result<Done> give_up(const Target& /*target*/, const Plan* /*plan*/, const Error& error,
                       Context& context) const override {
    Error wanted = error;
    if (!wanted.asked_of.empty()) {  // it is about a profile, and about no tool
      wanted.target.clear();
      wanted.endpoint.clear();
    }
    return tell_failure(wanted, context);
  }

 private:
  /// A list without tools has its columns all the same.
  static Result<Outcome> tell_failure(const Error& error, Context& context) {
    Outcome outcome;
    outcome.fail(error);
    Listing listing(context, columns);
    listing.add(error);
    return finish(listing, outcome);
  }
};

}  // namespace

Result<Outcome> identify(const IdentifyOptions& options, Context& context) {
  return resolve_compatible_targets(options.targets, context)
      .and_then([&](std::vector<Target> tools) {
        return run_verb(Identify(), {.tools = std::move(tools), .is_group = true}, options.jobs,
                        context);
      });
}

}  // namespace spindle::commands
