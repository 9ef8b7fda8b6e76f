#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>
#include <variant>

#include "listing.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/meeting.hpp"
#include "spindle/work/shared_lines.hpp"

namespace spindle::commands {
namespace {

using report::Column;

const std::array<Column, 5> columns = {{{"RESULT", "result"},
                                        {"ROUND TRIP", "round_trip_ms"},
                                        {"PROFILE", "profile"},
                                        {"MODEL", "tool_model"},
                                        {"SERIAL", "serial"}}};

/// How the test of one tool came out.
struct Tested {
  Outcome outcome = {};
  bool differs = false;
};

/// "no answer" of `no_answer`.
std::string in_words(const Error& error) {
  std::string words(info(error.status()).name);
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

report::Record tested_record(const Target& target, const Meeting& met, bool differs,
                             const Clock& clock) {
  const catalogue::Identity& identity = met.found.identity;
  const Decimal tenths(
      std::chrono::duration_cast<std::chrono::microseconds>(met.round_trip).count() / 100, -1);
  return {.type = "check",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"result", std::string(differs ? "differs" : "ok")},
                     {"endpoint", target.endpoint.text},
                     {"round_trip_ms", milliseconds(met.round_trip), tenths.to_string() + " ms"},
                     {"profile", text_or_null(met.found.profile),
                      fmt::format("{}", fmt::join(met.found.candidates, " or "))},
                     {"tool_model", text_or_null(identity.tool_model)},
                     {"serial", text_or_null(identity.serial)},
                     {"is_proven", met.is_proven},
                     {"code", report::Cell()}}};
}

report::Record failed_record(const Target& target, const Error& error, const Clock& clock) {
  return {.type = "check",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"result", std::string("failed"), in_words(error)},
                     {"endpoint", text_or_null(target.endpoint.text)},
                     {"round_trip_ms", report::Cell()},
                     {"profile", report::Cell()},
                     {"tool_model", report::Cell()},
                     {"serial", report::Cell()},
                     {"is_proven", false},
                     {"code", std::string(info(error.status()).name)}}};
}

class Test final : public Verb<std::monostate, Tested> {
 public:
  [[nodiscard]] Need need() const override { return Need::raw_registers; }

  Result<Plan> plan(const catalogue::Profile& /*profile*/,
                    const Target& /*target*/) const override {
    return Plan();
  }

  Result<Done> perform(OpenTool& tool, const Plan& /*plan*/, Context& context) const override {
    const auto met = work::meet(tool, context);
    if (!met) return tell_failure(tool.target, met.error(), context);
    TRY_LET(const auto differences, differences_of(tool, *met));
    Tested tested{.differs = !differences.empty()};
    tested.outcome.succeed();
    if (tested.differs) tested.outcome.negate();
    Listing listing(context, columns);
    listing.add(tested_record(tool.target, *met, tested.differs, context.clock));
    for (const std::string& difference : differences) {
      context.renderer.note(fmt::format("{}: {}", tool.target.shown, difference));
    }
    return finish(listing, tested.outcome).map([&](const Outcome&) { return tested; });
  }

  Result<Done> give_up(const Target& target, const Plan* /*plan*/, const Error& error,
                       Context& context) const override {
    return tell_failure(target, error, context);
  }

  [[nodiscard]] std::optional<Summary> summary(const AllDone& all) const override {
    std::size_t failed = 0;
    std::size_t differing = 0;
    for (const auto& done : all.done) {
      const bool has_failed = !done || done->outcome.failed() > 0;
      if (has_failed) ++failed;
      if (!has_failed && done->differs) ++differing;
    }
    const std::size_t fine = all.tools - failed - differing;
    Summary summary{
        .counts = {{"ok", count(fine)}, {"differs", count(differing)}, {"failed", count(failed)}},
        .sentence = fmt::format("{} ok", fine)};
    if (differing > 0) {
      summary.sentence += fmt::format(", {} {} from the tools file", differing,
                                      differing == 1 ? "differs" : "differ");
    }
    if (failed > 0) summary.sentence += fmt::format(", {} failed", failed);
    return summary;
  }

 private:
  /// What the tools file says otherwise than the tool, as sentences.
  [[nodiscard]] Result<std::vector<std::string>> differences_of(OpenTool& tool,
                                                                const Meeting& met) const {
    std::vector<std::string> found;
    if (met.misfit) found.push_back(message_of(*met.misfit));
    const bool fits_nothing = !met.misfit && met.found.candidates.empty();
    if (fits_nothing) {
      found.push_back(fmt::format("no profile fits what it says of itself: {}",
                                  fmt::join(met.found.identity.notes, "; ")));
    }
    std::string difference = other_serial(tool.target, met.found.identity.serial);
    if (!difference.empty()) found.push_back(std::move(difference));
    const std::string unit = tool.target.torque_unit;
    if (met.misfit || unit.empty() || tool.profile->torque_unit_from.empty()) return found;
    TRY(work::read_torque_unit(tool));
    if (tool.target.torque_unit != unit) {
      found.push_back(fmt::format(
          "its torques are in {}, and the tools file says {}",
          tool.target.torque_unit.empty() ? "a unit that is not known" : tool.target.torque_unit,
          unit));
    }
    return found;
  }

  static Result<Done> tell_failure(const Target& target, const Error& error, Context& context) {
    Tested tested;
    tested.outcome.fail(error);
    Listing listing(context, columns);
    listing.add(failed_record(target, error, context.clock));
    listing.add(with_target(error, target));
    return finish(listing, tested.outcome).map([&](const Outcome&) { return tested; });
  }
};

}  // namespace

Result<Outcome> test_tools(const ToolsTestOptions& options, Context& context) {
  std::vector<std::string> names = options.targets;
  if (names.empty()) {
    for (const files::Tool& tool : context.tools.tools) {
      if (std::find(names.begin(), names.end(), tool.name) == names.end()) {
        names.push_back(tool.name);
      }
    }
  }
  if (names.empty()) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "there is no tool to test",
                                .hint = "'spindle tools add NAME URL' adds one"});
  }
  TRY_LET(auto tools, resolve_compatible_targets(names, context));
  return run_verb(Test(), {.tools = std::move(tools), .is_group = true}, options.jobs, context);
}

}  // namespace spindle::commands
