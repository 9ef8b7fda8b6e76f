#include "stops.hpp"

#include <array>

#include "records.hpp"

namespace spindle::commands {
namespace {

constexpr auto stop_words =
    enum_table<device::StopResult>({{"confirmed", device::StopResult::confirmed},
                                    {"sent", device::StopResult::sent},
                                    {"not-confirmed", device::StopResult::unconfirmed}});

}  // namespace

report::Record stop_record(device::StopResult result, const Target& target, const Clock& clock) {
  return {.type = "action",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"action", std::string("stop")},
                     {"value", report::Cell()},
                     {"result", std::string(stop_words.text(result))}}};
}

std::span<const report::Column> stop_columns() {
  static const std::array<report::Column, 3> columns = {
      {{"TARGET", "target"}, {"ACTION", "action"}, {"RESULT", "result"}}};
  return columns;
}

}  // namespace spindle::commands
