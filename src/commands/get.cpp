#include <algorithm>

#include "listing.hpp"
#include "raw_need.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "spindle/catalogue/short_name.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {
namespace {

bool is_raw(const std::string& name) { return name.starts_with('@'); }

std::vector<RegisterSpan> spans_of(const std::vector<std::string>& names) {
  std::vector<RegisterSpan> spans;
  for (const catalogue::Parameter& raw :
       catalogue::Profile().describe(names).value_or(std::vector<catalogue::Parameter>())) {
    const auto count = static_cast<std::uint16_t>(catalogue::register_count(raw.encoding));
    const auto last = static_cast<std::uint16_t>(raw.address.value + count - 1);
    spans.push_back({raw.table, raw.address.value, last});
  }
  return spans;
}

class Get final : public Verb<std::vector<catalogue::Parameter>, Outcome> {
 public:
  Get(const GetOptions& options, const Context& context) : options_(&options) {
    const auto& names = options.names;
    const bool raw_only = !names.empty() && std::all_of(names.begin(), names.end(), is_raw);
    if (!raw_only) return;
    need_ = need_of_raw(spans_of(names), context);
  }

  [[nodiscard]] Need need() const override { return need_; }
  [[nodiscard]] Fit fit() const override { return Fit::one; }

  Result<Plan> plan(const catalogue::Profile& profile, const Target& /*target*/) const override {
    return catalogue::meant_by(options_->names, profile)
        .and_then([&](const std::vector<std::string>& names) { return profile.select(names); });
  }

  [[nodiscard]] std::string_view otherwise(const std::string& word,
                                           const catalogue::Profile& profile) const override {
    return catalogue::is_meant(word, profile) ? "a parameter" : "";
  }

  Result<Done> perform(OpenTool& tool, const Plan& plan, Context& context) const override {
    TRY_LET(const auto readings, tool.device.read_each(plan, options_->limits));
    Outcome outcome;
    Listing listing(context, value_columns(options_->limits));
    for (const device::Reading& reading : readings) {
      if (reading.value) {
        outcome.succeed();
        listing.add(value_record(reading, tool.target, context.clock, *options_));
      } else {
        outcome.fail(reading.value.error());
        listing.add(reading.value.error());
      }
    }
    return finish(listing, outcome);
  }

 private:
  const GetOptions* options_;
  Need need_ = Need::named_registers;
};

}  // namespace

Result<Outcome> get(const GetOptions& options, Context& context) {
  return resolve_one_or_group(options.targets, Addressing::unicast, context)
      .and_then([&](Targets targets) {
        return run_verb(Get(options, context), reopening(std::move(targets)), options.jobs,
                        context);
      });
}

}  // namespace spindle::commands
