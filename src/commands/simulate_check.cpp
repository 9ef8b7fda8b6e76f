#include "simulate_check.hpp"

#include <fmt/format.h>

#include <string_view>

#include "spindle/sim/simulated_tool.hpp"

namespace spindle::commands {
namespace {

/// A tool that this profile describes would not notice it.
Error useless(std::string_view option, const catalogue::Profile& profile, std::string_view why) {
  return {.code = Errc::usage,
          .message = fmt::format("{} does nothing for {}: {}", option, profile.id, why),
          .hint = "leave it out"};
}

constexpr std::string_view no_identity = "its simulation has no identity";
constexpr std::string_view no_events = "it has no operator who drives screws";
constexpr std::string_view no_alarm = "no list 'present' of its profile shows it";
constexpr std::string_view no_alarm_of_run = "its 'run' names no alarm";
constexpr std::string_view no_warnings = "its 'run' names no warning";
constexpr std::string_view no_motor = "it has no motor that a command word runs";

/// Why the fault would not be felt; empty: it is felt.
std::string_view why_not_felt(sim::FaultKind kind, const catalogue::Profile& profile) {
  const bool serial = profile.link.framing == modbus::Framing::rtu;
  switch (sim::need_of(kind)) {
    case sim::FaultNeed::network:
      return serial ? "it is on a serial line" : "";
    case sim::FaultNeed::serial_line:
      return serial ? "" : "it speaks Modbus TCP";
    case sim::FaultNeed::events:
      return sim::abilities_of(profile).pushes ? "" : "it sends nothing unasked";
    case sim::FaultNeed::screwdriver:
      return sim::abilities_of(profile).operated ? "" : "it stores what is written";
    case sim::FaultNeed::dated:
      return sim::abilities_of(profile).dated ? "" : "its events have no date";
    case sim::FaultNeed::nothing:
      break;
  }
  return {};
}

}  // namespace

std::optional<Error> useless_option(const SimulateOptions& options,
                                    const catalogue::Profile& profile) {
  const sim::DeviceOptions& bm = options.tool.bm;
  const sim::Abilities able = sim::abilities_of(profile);
  struct Row {
    std::string_view option;
    bool given;
    bool works;
    std::string_view why;
  };
  const Row rows[] = {
      {"--identity-bytes", bm.identity_bytes.has_value(), able.identity, no_identity},
      {"--firmware", bm.firmware.has_value(), able.identity, no_identity},
      {"--serial", bm.serial.has_value(), able.identity, no_identity},
      {"--model", bm.tool_model.has_value(), able.identity, no_identity},
      {"--rundown-every", bm.rundown_every.has_value(), able.operated, no_events},
      {"--event-number", bm.event_number.has_value(), able.operated, no_events},
      {"--busy", options.tool.busy.has_value(), able.configuration, no_motor},
      {"--warning", !options.tool.warnings.empty(), able.warnings, no_warnings},
      {"--alarm", !options.tool.alarms.empty(), able.alarms,
       able.operated ? no_alarm : no_alarm_of_run},
      {"--no-gap", options.gaps == sim::LineModel::Gaps::ignored,
       profile.link.framing == modbus::Framing::tcp || !profile.link.serial.gaps.empty(),
       "it asks for no gaps"},
  };
  for (const Row& row : rows) {
    if (row.given && !row.works) return useless(row.option, profile, row.why);
  }
  return std::nullopt;
}

std::optional<Error> useless_trouble(const sim::FaultPlan& faults,
                                     const std::vector<sim::Outage>& outages,
                                     const catalogue::Profile& profile) {
  for (const sim::Fault& fault : faults) {
    const std::string_view why = why_not_felt(fault.kind, profile);
    if (!why.empty()) {
      return useless(fmt::format("--fault {}", sim::to_text(fault.kind)), profile, why);
    }
  }
  for (const sim::Outage& outage : outages) {
    if (profile.link.framing == modbus::Framing::tcp || !sim::needs_radio(outage.kind)) continue;
    return useless(fmt::format("--outage {}", sim::to_text(outage.kind)), profile,
                   "it is on a serial line, not on a radio");
  }
  return std::nullopt;
}

std::vector<std::string> simulate_options(const catalogue::Profile& profile) {
  const sim::Abilities able = sim::abilities_of(profile);
  std::vector<std::string> options;
  const auto add = [&](bool is_able, std::initializer_list<const char*> names) {
    if (is_able) options.insert(options.end(), names.begin(), names.end());
  };
  add(able.identity, {"--identity-bytes", "--firmware", "--serial", "--model"});
  add(able.operated, {"--rundown-every", "--ng-every", "--burst", "--event-number"});
  add(able.configuration, {"--busy"});
  add(able.alarms, {"--alarm"});
  add(able.warnings, {"--warning"});
  return options;
}

}  // namespace spindle::commands
