#include <algorithm>

#include "listing.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {
namespace {

bool is_raw(const std::string& name) { return name.starts_with('@'); }

class Get final : public Verb<std::vector<catalogue::Parameter>, Outcome> {
 public:
  explicit Get(const GetOptions& options) : options_(&options) {}

  [[nodiscard]] Need need() const override {
    const auto& names = options_->names;
    const bool raw_only = !names.empty() && std::all_of(names.begin(), names.end(), is_raw);
    return raw_only ? Need::raw_registers : Need::named_registers;
  }
  [[nodiscard]] Fit fit() const override { return Fit::one; }

  Result<Plan> plan(const catalogue::Profile& profile, const Target& /*target*/) const override {
    return profile.select(options_->names);
  }

  Result<Done> perform(OpenTool& tool, const Plan& plan, Context& context) const override {
    TRY_LET(const auto readings, tool.device.read_each(plan, options_->limits));
    Outcome outcome;
    Listing listing(context, value_columns(options_->limits));
    for (const device::Reading& reading : readings) {
      if (reading.value) {
        outcome.succeed();
        listing.add(value_record(reading, tool.target, context.clock, options_->limits));
      } else {
        outcome.fail(reading.value.error());
        listing.add(reading.value.error());
      }
    }
    return finish(listing, outcome);
  }

 private:
  const GetOptions* options_;
};

}  // namespace

Result<Outcome> get(const GetOptions& options, Context& context) {
  return resolve_one_or_group(options.target, Addressing::unicast, context)
      .and_then([&](Targets targets) {
        return run_verb(Get(options), reopening(std::move(targets)), options.jobs, context);
      });
}

}  // namespace spindle::commands
