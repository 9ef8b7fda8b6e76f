#include <fmt/format.h>

#include <array>

#include "listing.hpp"
#include "progress.hpp"
#include "records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {
namespace {

const std::array<report::Column, 3> columns = {{{"UNIT", "unit", report::Align::right},
                                                {"ANSWERED", "answered"},
                                                {"ROUND TRIP", "round_trip_ms"}}};

/// The line; the unit of a named tool does not matter, but in a URL it would be a misunderstanding.
Result<Target> resolve_bus(const ScanOptions& options, const Context& context) {
  auto bus = resolve_target(options.bus, context);
  if (!bus) return bus;
  const auto refuse = [&](std::string message, std::string hint) {
    return tl::unexpected(with_target(
        Error{.code = Errc::usage, .message = std::move(message), .hint = std::move(hint)}, *bus));
  };
  if (bus->endpoint.unit && bus->shown == bus->endpoint.text) {
    return refuse("scan asks many units, and the target names one",
                  "leave unit out of the target; --units says which are asked");
  }
  return bus;
}

Result<catalogue::Profile> load_bus_profile(const Target& bus, const Context& context) {
  auto profile = load_profile(bus, context);
  const bool serial = bus.endpoint.medium != link::Medium::simulated || !profile ||
                      profile->link.framing == modbus::Framing::rtu;
  if (serial) return profile;
  return tl::unexpected(with_target(Error{.code = Errc::usage,
                                          .message = "this simulated tool is not on a serial line",
                                          .hint = "'spindle ping' asks it"},
                                    bus));
}

report::Record unit_record(modbus::UnitId unit, const device::Probe& probe, const Target& bus,
                           const Clock& clock) {
  const bool data = probe.answered == device::Answered::data;
  report::Cell time = milliseconds(probe.round_trip);
  std::string shown = report::to_text(time) + " ms";
  return {.type = "unit",
          .target = bus.shown,
          .time = clock.wall(),
          .fields = {{"unit", number(unit.value)},
                     {"answered", std::string(data ? "data" : "exception")},
                     {"round_trip_ms", std::move(time), std::move(shown)}}};
}

/// Nothing came, or only what this side's own adapter said.
bool is_silence(const Error& error) {
  return error.code == Errc::no_answer || error.code == Errc::local_echo;
}

/// A gateway says for a unit that it cannot reach it.
bool is_absence(const device::Probe& probe) {
  using enum modbus::ExceptionCode;
  return probe.exception == static_cast<std::uint8_t>(gateway_path_unavailable) ||
         probe.exception == static_cast<std::uint8_t>(gateway_target_failed_to_respond);
}

/// Something speaks where one unit should, and cannot be understood: two units of one address, a
/// bad line.
bool is_noise(const Error& error) {
  return error.code == Errc::bad_checksum || error.code == Errc::incomplete_answer ||
         error.code == Errc::malformed_answer;
}

Error with_unit(Error error, modbus::UnitId unit) {
  error.name = fmt::format("unit {}", unit.value);
  if (is_noise(error)) error.hint = "do two units have this address? else check wiring and rate";
  return error;
}

}  // namespace

Result<Outcome> scan(const ScanOptions& options, Context& context) {
  if (options.registers) return scan_registers(options, context);
  TRY_LET(const auto bus, resolve_bus(options, context));
  TRY_LET(auto profile, load_bus_profile(bus, context));
  auto tool = connect(bus, std::move(profile), context);
  if (!tool) return tl::unexpected(std::move(tool.error()));

  Outcome outcome;
  Listing listing(context, columns);
  ProgressLine progress(context);
  std::int64_t asked = 0;
  for (const modbus::UnitId unit : options.units) {
    if (!listing.open()) break;
    progress.advance({.what = "units asked:",
                      .done = static_cast<std::size_t>(asked++),
                      .total = options.units.size(),
                      .more = fmt::format("{} found", outcome.succeeded())});
    const auto probe = tool->device.probe(unit);
    if (probe && is_absence(*probe)) continue;
    if (probe) {
      outcome.succeed();
      listing.add(unit_record(unit, *probe, bus, context.clock));
    } else if (!is_silence(probe.error())) {
      outcome.fail(probe.error());
      listing.add(with_unit(probe.error(), unit));
      if (!is_noise(probe.error())) break;
    }
  }
  if (outcome.succeeded() == 0) outcome.negate();
  const bool one_for_all = bus.endpoint.medium == link::Medium::tcp && asked > 1 &&
                           outcome.succeeded() == static_cast<std::size_t>(asked);
  if (one_for_all) {
    context.renderer.note(
        "every unit that was asked answers: this may be one tool that does not look at the unit");
  }
  return finish(listing, outcome,
                {.counts = {{"asked", number(asked)}, {"found", count(outcome.succeeded())}},
                 .sentence = fmt::format("{} asked, {} found", asked, outcome.succeeded()),
                 .target = bus.shown},
                context);
}

}  // namespace spindle::commands
