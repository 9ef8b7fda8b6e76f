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
#include "spindle/work/meeting.hpp"
#include "spindle/work/shared_lines.hpp"

namespace spindle::commands {
namespace {

using report::Cell;
using report::Column;

const std::array<Column, 5> columns = {
    {{"MODEL", "tool_model"},
     {"SERIAL", "serial"},
     {"FIRMWARE", "firmware", report::Align::left, 0, report::left_out(2)},
     {"PROFILE", "profile"},
     {"ROUND TRIP", "round_trip_ms", report::Align::left, 0, report::left_out(1)}}};

/// One tool's answer, or why there is none.
struct Identified {
  report::Record record;
  std::optional<Error> misfit;  ///< it is not what --profile or the tools file says
};

template <typename Number>
Cell number_or_null(const std::optional<Number>& value) {
  return value ? number(static_cast<std::int64_t>(*value)) : Cell();
}

/// "4002 (4.0.2)" where the tool says both.
std::string shown_firmware(const catalogue::Identity& identity) {
  if (!identity.firmware) return {};
  const std::string number = std::to_string(*identity.firmware);
  return identity.version.empty() ? number : fmt::format("{} ({})", number, identity.version);
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
                     {"firmware", number_or_null(identity.firmware), shown_firmware(identity)},
                     {"raw", to_compact_hex(identity.raw)},
                     {"round_trip_ms", milliseconds(round_trip), tenths.to_string() + " ms"},
                     {"notes", identity.notes},
                     {"total_fastenings", number_or_null(identity.total)}}};
}

/// The table has no room for notes, so people get them as sentences.
void tell_notes(const Identified& identified, const Context& context) {
  if (identified.misfit) return;  // its message says them
  const report::Field* notes = identified.record.find("notes");
  for (const std::string& note : std::get<report::Texts>(notes->cell)) {
    context.renderer.note(fmt::format("{}: {}", identified.record.target, note));
  }
}

Result<Identified> identify_one(OpenTool& tool, const Context& context) {
  TRY_LET(auto met, work::meet(tool, context));
  if (!met.is_proven) {
    if (auto words = motor_state_words(tool); !words.empty()) {
      met.found.identity.notes.push_back(std::move(words));
    }
  }
  if (const auto difference = other_serial(tool.target, met.found.identity.serial);
      !difference.empty()) {
    context.renderer.note(fmt::format("{}: warning: {}", tool.target.shown, difference));
  }
  Identified identified{identity_record(tool, met.found, met.round_trip, context.clock),
                        std::move(met.misfit)};
  if (const std::string& version = met.found.identity.version; !version.empty()) {
    identified.record.fields.push_back({"firmware_version", version});
  }
  return identified;
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
