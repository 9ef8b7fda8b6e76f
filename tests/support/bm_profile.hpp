#pragma once

#include <string>
#include <utility>
#include <vector>

#include "spindle/catalogue/profile.hpp"

namespace spindle::test {

/// A BM profile in miniature, built in code: the registers of bm-bmt's map that a simulated tool
/// needs, with three presets. For tests below the layer that reads profile files.
inline catalogue::Profile bm_profile() {
  using namespace catalogue;
  using modbus::RegisterTable;
  Profile profile;
  profile.id = "bm";
  profile.link.port = 5000;
  profile.link.max_read = 100;
  profile.identity = IdentitySpec{.minimum_bytes = 12,
                                  .id = {0, 2},
                                  .controller_model = {2, 2},
                                  .tool_model = {4, 2},
                                  .firmware = {6, 2},
                                  .serial = {8, 4},
                                  .long_serial_bytes = 13,
                                  .long_serial = {8, 5},
                                  .products = {},
                                  .total_bytes = 17,
                                  .total = {13, 4},
                                  .models = {}};
  profile.events = EventSpec{.arm = catalogue::Arming{.address = 4002,
                                                      .every = std::chrono::seconds(5),
                                                      .expires = std::chrono::seconds(10)},
                             .function = 4,
                             .first = 3200,
                             .count = 14,
                             .number = "event.number",
                             .kind = "event.status",
                             .kinds = {{0, EventKind::other},
                                       {1, EventKind::fastening_ok},
                                       {2, EventKind::fastening_ng},
                                       {3, EventKind::direction_change},
                                       {4, EventKind::preset_change},
                                       {5, EventKind::alarm_reset},
                                       {6, EventKind::error}},
                             .error = "event.error"};
  profile.limits = LimitSpec{.minimum_offset = 1000, .maximum_offset = 2000, .from = 1, .to = 724};
  profile.numbered = NumberedSpec{.prefix = "p",
                                  .from = 1,
                                  .to = 725,
                                  .access = Access::read_write,
                                  .source = "60427 section 3.1"};

  std::vector<Parameter> parameters;
  const auto add = [&parameters](RegisterTable table, std::uint16_t address, std::string name,
                                 Access access) {
    Parameter parameter;
    parameter.name = std::move(name);
    parameter.table = table;
    parameter.address = {address};
    parameter.access = access;
    parameters.push_back(std::move(parameter));
  };
  const auto add_input = [&add](std::uint16_t first, const std::string& group,
                                std::initializer_list<const char*> fields) {
    for (const char* field : fields) {
      add(RegisterTable::input, first++, group + "." + field, Access::read_only);
    }
  };
  for (std::uint16_t preset = 1; preset <= 3; ++preset) {
    auto address = static_cast<std::uint16_t>(15 * (preset - 1) + 1);
    for (const char* field :
         {"mode", "target-torque", "torque-limit", "target-angle", "min-angle", "max-angle",
          "snug-torque", "speed", "free-angle", "free-speed", "soft-start", "seating-point",
          "torque-rising-time", "ramp-up-speed", "torque-compensation"}) {
      add(RegisterTable::holding, address++, "preset." + std::to_string(preset) + "." + field,
          Access::read_write);
    }
  }
  add_input(3100, "alarm", {"1", "2"});
  add_input(3200, "event",
            {"number", "fastening-time", "preset", "target-torque", "torque", "speed", "a1", "a2",
             "a3", "screw-count", "error", "direction", "status", "snug-angle"});
  add_input(
      3300, "status",
      {"torque", "speed", "current", "preset", "torque-up", "fastening-ok", "ready", "running",
       "alarm", "direction", "screws-remaining", "inputs", "outputs", "temperature"});

  profile.parameters = std::move(parameters);

  const auto action = [](Text name, std::uint16_t address) {
    Action made;
    made.name = std::move(name);
    made.address = {address};
    return made;
  };
  Action reset = action("alarm-reset", 4000);
  reset.value = 1;
  Action lock = action("lock", 4001);
  lock.maximum = 1;
  Action start = action("start", 4003);
  start.value = 1;
  start.stop_value = 0;
  start.confirm = "status.running";
  Action preset = action("select-preset", 4004);
  preset.minimum = 1;
  preset.maximum = 3;
  Action direction = action("direction", 4005);
  direction.maximum = 1;
  profile.actions = {reset, lock, start, preset, direction};
  return profile;
}

/// Its start state: preset 1 asks for 2.71 at 235 rpm and takes 1.2 s, preset 2 needs a snug
/// torque.
inline catalogue::SimulationSpec bm_start() {
  catalogue::SimulationSpec start;
  // id 1, controller 1, tool model 3204, firmware 2103, serial 1021100042, 1234 fastenings.
  start.identity = {0, 1, 0, 1, 0, 3, 0x08, 0x37, 42, 0, 10, 21, 10, 0, 0, 0x04, 0xD2};
  start.identity_bytes = 13;
  start.limit_exception = 0x0E;
  start.stopped_error = 333;
  start.values = {{"preset.*.target-torque", 600}, {"preset.1.target-torque", 271},
                  {"preset.*.torque-limit", 1000}, {"preset.*.speed", 235},
                  {"preset.*.soft-start", 100},    {"preset.*.torque-rising-time", 200},
                  {"preset.2.snug-torque", 50},    {"status.preset", 1},
                  {"status.screws-remaining", 2},  {"status.temperature", 25},
                  {"event.number", 1961}};
  start.limits = {{"p7*", 0, 60000}, {"preset.1.*", 0, 9000}, {"preset.*.target-torque", 20, 600}};
  start.absent = {{.table = modbus::RegisterTable::holding, .from = 564, .to = 568}};
  return start;
}

}  // namespace spindle::test
