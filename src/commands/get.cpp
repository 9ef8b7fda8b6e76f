#include <algorithm>

#include "group.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"

namespace spindle::commands {
namespace {

bool is_raw(const std::string& name) { return name.starts_with('@'); }

Result<Outcome> get_one(const Target& target, const GetOptions& options, Context& context) {
  const bool raw_only =
      !options.names.empty() && std::all_of(options.names.begin(), options.names.end(), is_raw);
  auto opened = open_prepared(
      reopening(target), raw_only ? Need::raw_registers : Need::named_registers, context,
      [&](const catalogue::Profile& profile) { return profile.select(options.names); });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  const auto readings = opened->tool.device.read_each(opened->prepared, options.limits);
  if (!readings) return tl::unexpected(readings.error());

  Outcome outcome;
  Listing listing(context, value_columns(options.limits));
  for (const device::Reading& reading : *readings) {
    if (reading.value) {
      outcome.succeed();
      listing.add(value_record(reading, target, context.clock, options.limits));
    } else {
      outcome.fail(reading.value.error());
      listing.add(reading.value.error());
    }
  }
  return finish(listing, outcome);
}

Result<Outcome> get_group(const std::vector<Target>& targets, const GetOptions& options,
                          Context& context) {
  const auto checked = check_for_some(targets, context, [&](const catalogue::Profile& profile) {
    return profile.select(options.names);
  });
  if (!checked) return tl::unexpected(checked.error());
  const auto performances =
      tape_each(targets, options.jobs, context,
                [&](const Target& target, Context& own) { return get_one(target, options, own); });
  return play(performances, context).map([&] { return outcome_of_all(performances); });
}

}  // namespace

Result<Outcome> get(const GetOptions& options, Context& context) {
  const auto targets = resolve_one_or_group(options.target, Reach::one, context);
  if (!targets) return tl::unexpected(targets.error());
  return is_group(options.target, Reach::one) ? get_group(*targets, options, context)
                                              : get_one(targets->front(), options, context);
}

}  // namespace spindle::commands
