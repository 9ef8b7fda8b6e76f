#include <algorithm>

#include "listing.hpp"
#include "records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/target.hpp"

namespace spindle::commands {
namespace {

bool is_raw(const std::string& name) { return name.starts_with('@'); }

}  // namespace

Result<Outcome> get(const GetOptions& options, Context& context) {
  const auto target = resolve_target(options.target, context);
  if (!target) return tl::unexpected(target.error());
  const bool raw_only =
      !options.names.empty() && std::all_of(options.names.begin(), options.names.end(), is_raw);
  auto opened = open_prepared(
      *target, raw_only ? Need::raw_registers : Need::named_registers, context,
      [&](const catalogue::Profile& profile) { return profile.select(options.names); });
  if (!opened) return tl::unexpected(std::move(opened.error()));
  const auto readings = opened->tool.device.read_each(opened->prepared, options.limits);
  if (!readings) return tl::unexpected(readings.error());

  Outcome outcome;
  Listing listing(context, value_columns(options.limits));
  for (const device::Reading& reading : *readings) {
    if (reading.value) {
      outcome.succeed();
      listing.add(value_record(reading, *target, context.clock, options.limits));
    } else {
      outcome.fail(reading.value.error());
      listing.add(reading.value.error());
    }
  }
  return finish(listing, outcome);
}

}  // namespace spindle::commands
