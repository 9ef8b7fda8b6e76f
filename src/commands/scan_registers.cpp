#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <variant>

#include "listing.hpp"
#include "progress.hpp"
#include "raw_need.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/register_sets.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/change.hpp"
#include "spindle/work/register_survey.hpp"

namespace spindle::commands {
namespace {

using report::Align;

const std::array<report::Column, 5> columns = {{{"TABLE", "table"},
                                                {"FROM", "from", Align::right},
                                                {"TO", "to", Align::right},
                                                {"COUNT", "count", Align::right},
                                                {"NAMES", "names"}}};

/// The names that fit into a table; a program has all of them.
constexpr std::size_t most_names = 3;

/// What the profile calls the registers of a run.
std::vector<std::string> names_in(const link::RegisterRun& run, const catalogue::Profile& profile) {
  std::vector<std::string> names;
  for (const catalogue::Parameter& parameter : profile.parameters) {
    const std::uint16_t address = parameter.address.value;
    const bool is_inside = run.first <= address && address <= run.last();
    if (parameter.table == run.table && is_inside) names.push_back(parameter.name);
  }
  return names;
}

std::string in_words(const std::vector<std::string>& names) {
  if (names.size() <= most_names) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{}, and {} more", fmt::join(names.begin(), names.begin() + most_names, ", "),
                     names.size() - most_names);
}

report::Record run_record(const link::RegisterRun& run, const OpenTool& tool, const Clock& clock) {
  auto names = names_in(run, tool.device.profile());
  std::string shown = in_words(names);
  return {.type = "registers",
          .target = tool.target.shown,
          .time = clock.wall(),
          .fields = {{"table", std::string(modbus::to_text(run.table))},
                     {"from", number(run.first)},
                     {"to", number(run.last())},
                     {"count", count(run.values.size())},
                     {"names", std::move(names), std::move(shown)}}};
}

/// Those of the span that are never read.
std::size_t count_unread(const RegisterSpan& span, const catalogue::Profile& profile) {
  const auto consumed = catalogue::consumed_registers(profile, span.table);
  return static_cast<std::size_t>(
      std::distance(consumed.lower_bound(span.from), consumed.upper_bound(span.to)));
}

class ScanRegisters final : public Verb<std::monostate, Outcome> {
 public:
  ScanRegisters(const ScanOptions& options, const Context& context)
      : options_(&options), need_(need_of_raw({*options.registers}, context)) {}

  [[nodiscard]] Need need() const override { return need_; }

  Result<Plan> plan(const catalogue::Profile& /*profile*/,
                    const Target& /*target*/) const override {
    return Plan();
  }

  Result<Done> perform(OpenTool& tool, const Plan& /*plan*/, Context& context) const override {
    const catalogue::Profile& profile = tool.device.profile();
    const RegisterSpan& span = *options_->registers;
    const RegisterSurvey survey = read(tool, context);
    Outcome outcome;
    Listing listing(context, columns);
    for (const link::RegisterRun& run : survey.runs) {
      listing.add(run_record(run, tool, context.clock));
    }
    survey.answered > 0 ? outcome.succeed() : outcome.negate();
    if (survey.error) outcome.fail(*survey.error);
    if (survey.error && !is_interruption(*survey.error)) listing.add(*survey.error);
    return finish(listing, outcome,
                  summary_of(survey, count_unread(span, profile), tool.target.shown), context);
  }

 private:
  RegisterSurvey read(OpenTool& tool, const Context& context) const {
    ProgressLine progress(context);
    return survey_registers(tool, askable(*options_->registers, tool.device.profile()),
                            options_->pause, context.clock,
                            progress.counter(tool.target.shown + ": registers asked"));
  }

  static Summary summary_of(const RegisterSurvey& survey, std::size_t unread,
                            const std::string& target) {
    Summary summary{.counts = {{"registers", count(survey.answered)},
                               {"runs", count(survey.runs.size())},
                               {"requests", count(survey.requests)},
                               {"not_read", count(unread)}},
                    .sentence = fmt::format("{} {} in {}, {}", counted(survey.answered, "register"),
                                            survey.answered == 1 ? "answers" : "answer",
                                            counted(survey.runs.size(), "run"),
                                            counted(survey.requests, "request")),
                    .target = target};
    if (unread > 0) {
      summary.sentence += fmt::format("; {} not read, because reading clears {}", unread,
                                      unread == 1 ? "it" : "them");
    }
    if (survey.error) summary.sentence += "; not all was asked";
    return summary;
  }

  const ScanOptions* options_;
  Need need_;
};

}  // namespace

Result<Outcome> scan_registers(const ScanOptions& options, Context& context) {
  TRY_LET(auto target, resolve_target(options.bus, context));
  return run_verb(ScanRegisters(options, context), {.tools = {std::move(target)}}, 1, context);
}

}  // namespace spindle::commands
