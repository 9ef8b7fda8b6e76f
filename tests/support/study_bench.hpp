#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "spindle/files/profile_store.hpp"
#include "spindle/posix/disk.hpp"
#include "spindle/work/study.hpp"

namespace spindle::test {

using namespace spindle::work;
using store::Column;
using store::Setting;

inline WallTime bench_second(std::int64_t seconds) {
  return WallTime(std::chrono::seconds(1'780'000'000 + seconds));
}

inline ProductFacts doga_facts() {
  static const files::ProfileStore profiles({SPINDLE_SOURCE_DIR "/profiles"}, posix::source_disk());
  return facts_of(profiles.load("doga-bm").value(), profiles.load_error_codes("doga-bm").value());
}

inline store::PresetSettings settings(std::int64_t since, std::int64_t target, std::int64_t percent,
                                      std::int64_t min_angle = 0, std::int64_t max_angle = 0) {
  store::PresetSettings row{.tool = 1, .preset = 1, .since = bench_second(since)};
  row[Setting::target_torque] = target * 100;
  row[Setting::torque_limit] = percent * 10'000;
  row[Setting::mode] = 0;
  row[Setting::min_angle] = min_angle;
  row[Setting::max_angle] = max_angle;
  return row;
}

/// A store of one tool at one place, and what is added to it.
struct Bench {
  StoreFacts facts = {.tools = {{.id = 1, .name = {"DOGA", "42"}}},
                      .places = {{.id = 1,
                                  .tool = 1,
                                  .name = "station3",
                                  .profile = "doga-bm",
                                  .firmware = 2103,
                                  .torque_unit = "N.m"}},
                      .epochs = {{.tool = 1}},
                      .products = {{"doga-bm", doga_facts()}}};
  StudyOptions options = {};
  std::vector<Exclusion> exclusions = {};
  std::vector<store::EventView> events = {};

  /// Torque in hundredths, at a second, which is its number, too.
  store::EventView& result(std::int64_t at, std::int64_t torque, std::int64_t error = 0) {
    store::EventView event{.tool = 1,
                           .place = 1,
                           .number = static_cast<std::uint16_t>(at),
                           .at = bench_second(at),
                           .kind = error == 0 ? "fastening-ok" : "fastening-ng"};
    event.columns[Column::preset] = 1;
    event.columns[Column::target_torque] = 27'100;
    event.columns[Column::torque] = torque * 100;
    event.columns[Column::a3] = 6300;
    event.columns[Column::error] = error;
    event.columns[Column::direction] = 0;
    events.push_back(event);
    return events.back();
  }
};

}  // namespace spindle::test
