#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "backup_paths.hpp"
#include "listing.hpp"
#include "progress.hpp"
#include "raw_need.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/register_sets.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/files/dump_file.hpp"
#include "spindle/work/register_survey.hpp"

namespace spindle::commands {
namespace {

using report::Align;

const std::array<report::Column, 4> columns = {{{"FILE", "file"},
                                                {"REGISTERS", "registers", Align::right},
                                                {"RUNS", "runs", Align::right},
                                                {"LEFT OUT", "left_out", Align::right}}};

/// What is read, and how many registers of it are not, because they are secret or because reading
/// clears them.
struct Wanted {
  std::vector<link::RegisterRange> ranges = {};
  std::size_t left_out = 0;
};

/// Registers as they are in the set, without those that are left out.
void add_registers(modbus::RegisterTable table, const catalogue::Addresses& addresses,
                   const catalogue::Addresses& without, Wanted& wanted) {
  for (auto at = addresses.begin(); at != addresses.end();) {
    const std::uint16_t from = *at;
    std::uint16_t to = from;
    for (++at; at != addresses.end() && *at == to + 1; ++at) to = *at;
    const auto ranges = link::ranges_between(table, from, to, without);
    wanted.ranges.insert(wanted.ranges.end(), ranges.begin(), ranges.end());
    wanted.left_out +=
        static_cast<std::size_t>(std::distance(without.lower_bound(from), without.upper_bound(to)));
  }
}

catalogue::Addresses addresses_of(const RegisterSpan& span) {
  catalogue::Addresses addresses;
  for (std::uint32_t at = span.from; at <= span.to; ++at) {
    addresses.insert(addresses.end(), static_cast<std::uint16_t>(at));
  }
  return addresses;
}

files::Dump make_dump(const OpenTool& tool, RegisterSurvey survey, const Context& context) {
  files::Dump dump{.time = spindle::to_text(context.clock.wall()),
                   .version = std::string(context.version),
                   .target = tool.target.shown,
                   .profile = tool.device.profile().id,
                   .identity = identity_of(tool.device)};
  for (link::RegisterRun& run : survey.runs) {
    dump.runs.push_back({run.table, run.first, std::move(run.values)});
  }
  return dump;
}

/// What it refers to does not change while it runs.
class DumpRegisters final : public Verb<Wanted, Outcome> {
 public:
  DumpRegisters(const DumpOptions& options, const Context& context) : options_(&options) {
    if (!options.registers) return;
    need_ = options.secrets == Secrets::leave_out ? need_of_raw({*options.registers}, context)
                                                  : Need::raw_registers;
  }

  /// Registers that the command line names are read whatever they mean, but for secrets.
  [[nodiscard]] Need need() const override { return need_; }

  Result<Plan> plan(const catalogue::Profile& profile, const Target& /*target*/) const override {
    Wanted wanted;
    for (const modbus::RegisterTable table : tables()) {
      auto without = catalogue::consumed_registers(profile, table);
      if (options_->secrets == Secrets::leave_out) {
        without.merge(catalogue::secret_registers(profile, table));
      }
      add_registers(table,
                    options_->registers ? addresses_of(*options_->registers)
                                        : catalogue::known_registers(profile, table),
                    without, wanted);
    }
    if (!wanted.ranges.empty()) return wanted;
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "there is no register to read",
                                .hint = "say which: --registers 0..999"});
  }

  Result<Plan> examine(OpenTool& tool, Plan plan, Context& /*context*/) const override {
    if (need_ != Need::raw_secrets) return plan;
    return this->plan(tool.device.profile(), tool.target);
  }

  Result<Done> perform(OpenTool& tool, const Plan& plan, Context& context) const override {
    RegisterSurvey survey = read(tool, plan, context);
    if (survey.error) return tl::unexpected(std::move(*survey.error));
    const auto [answered, requests] = std::pair(survey.answered, survey.requests);
    report::Record record = saved_record(survey, plan, tool.target, context.clock);
    Outcome outcome;
    answered > 0 ? outcome.succeed() : outcome.negate();
    const std::string text = files::render_dump(make_dump(tool, std::move(survey), context));
    if (options_->file == standard_output) {
      return context.io.out(text).map([&] { return outcome; });
    }
    auto written = context.disk.write(options_->file, text, options_->overwrite, Privacy::own);
    if (!written) return tl::unexpected(std::move(written.error()));
    Listing listing(context, columns);
    listing.add(record);
    const std::string sentence =
        fmt::format("{} saved, {} left out, {}", counted(answered, "register"), plan.left_out,
                    counted(requests, "request"));
    std::vector<report::Field> counts(record.fields.begin() + 1, record.fields.end());
    return finish(listing, outcome,
                  {.counts = std::move(counts), .sentence = sentence, .target = tool.target.shown},
                  context);
  }

 private:
  [[nodiscard]] std::vector<modbus::RegisterTable> tables() const {
    if (options_->registers) return {options_->registers->table};
    if (options_->table) return {*options_->table};
    std::vector<modbus::RegisterTable> tables;
    for (const std::string& word : modbus::table_words.words()) {
      tables.push_back(*modbus::table_words.find(word));
    }
    return tables;
  }

  RegisterSurvey read(OpenTool& tool, const Plan& plan, const Context& context) const {
    ProgressLine progress(context);
    return survey_registers(tool, plan.ranges, options_->pause, context.clock,
                            progress.counter(tool.target.shown + ": reading"));
  }

  [[nodiscard]] report::Record saved_record(const RegisterSurvey& survey, const Plan& plan,
                                            const Target& target, const Clock& clock) const {
    return {.type = "dump",
            .target = target.shown,
            .time = clock.wall(),
            .fields = {{"file", options_->file},
                       {"registers", count(survey.answered)},
                       {"runs", count(survey.runs.size())},
                       {"requests", count(survey.requests)},
                       {"left_out", count(plan.left_out)}}};
  }

  const DumpOptions* options_;
  Need need_ = Need::named_registers;
};

}  // namespace

Result<Outcome> dump(const DumpOptions& options, Context& context) {
  TRY_LET(auto target, resolve_target(options.target, context));
  const bool is_kept = options.file != standard_output && options.overwrite == Overwrite::refuse &&
                       context.disk.exists(options.file);
  if (is_kept) {
    Error error{.code = Errc::usage,
                .message = "this file exists already",
                .hint = "choose another name, or add --force to replace it"};
    error.name = options.file;
    return tl::unexpected(std::move(error));
  }
  return run_verb(DumpRegisters(options, context), {.tools = {std::move(target)}}, 1, context);
}

}  // namespace spindle::commands
