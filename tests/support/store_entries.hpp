#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "spindle/store/reader.hpp"
#include "spindle/store/writer.hpp"

namespace spindle::test {

/// So many seconds behind the time at which all tests of the store begin.
inline WallTime second(std::int64_t seconds) {
  return WallTime(std::chrono::seconds(1'780'000'000 + seconds));
}

/// An event of the number, told that many seconds after the beginning; `variant` makes its block
/// another one.
inline store::NewEvent new_event(store::RowId tool, store::RowId place, std::uint16_t number,
                                 std::uint16_t variant = 0) {
  store::NewEvent entry;
  entry.event = {.tool = tool,
                 .place = place,
                 .number = number,
                 .at = second(number),
                 .source = "push",
                 .kind = "fastening-ok",
                 .raw = Registers(20, static_cast<std::uint16_t>(number + variant))};
  entry.event.columns[store::Column::torque] = 27'100 + number;
  entry.event.columns[store::Column::preset] = 1;
  return entry;
}

/// The same as a result that is not copied out.
struct StoredEvent {
  store::RowId id = 0;
  store::RowId tool = 0;
  std::int64_t epoch = 0;
  std::uint16_t number = 0;
  std::vector<std::uint8_t> raw = {};

  friend bool operator==(const StoredEvent&, const StoredEvent&) = default;
};

inline std::vector<StoredEvent> stored_events(store::Reader& reader,
                                              const store::Filter& filter = {}) {
  std::vector<StoredEvent> events;
  const auto read = reader.events(filter, [&](const store::EventView& event) {
    events.push_back({.id = event.id,
                      .tool = event.tool,
                      .epoch = event.epoch,
                      .number = event.number,
                      .raw = {event.raw.begin(), event.raw.end()}});
    return true;
  });
  if (!read) events.clear();
  return events;
}

}  // namespace spindle::test
