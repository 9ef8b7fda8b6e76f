#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/base/enum_table.hpp"

namespace spindle::store {

/// Numbers of rows, as SQLite gives them.
using RowId = std::int64_t;

/// A tool for ever: with the epoch and the number of an event it names a result, in every store. A
/// tool that says no serial number of its own has "@" and the name of its target instead; one whose
/// serial number another tool has, too, the serial number, "@" and the name of its target.
struct ToolName {
  std::string maker;
  std::string serial;

  friend auto operator<=>(const ToolName&, const ToolName&) = default;
};

struct Tool {
  RowId id = 0;
  ToolName name = {};
  std::string model = {};  ///< as it was first heard; empty: not known
};

/// Where and as what a tool was reached. What changes makes another row.
struct Place {
  RowId id = 0;
  RowId tool = 0;
  std::string name = {};  ///< of the target, as the user calls it
  std::string url = {};
  std::string profile = {};
  std::optional<std::uint32_t> firmware = std::nullopt;
  std::string torque_unit = {};  ///< set on the tool; empty: not known
  WallTime since = {};
  std::optional<WallTime> seen = std::nullopt;       ///< until when the tool was listened to there
  std::optional<std::int64_t> fence = std::nullopt;  ///< number of the lease; empty: under none
};

/// Why the events of a tool are counted in another epoch.
enum class EpochReason : std::uint8_t {
  first,    ///< it was never heard before
  wrap,     ///< its 16-bit counter began again behind 65535
  restart,  ///< it began to count anew
  unsure,   ///< it told another event with a number that was taken
};
inline constexpr auto epoch_reason_words =
    enum_table<EpochReason>({{"first", EpochReason::first},
                             {"wrap", EpochReason::wrap},
                             {"restart", EpochReason::restart},
                             {"unsure", EpochReason::unsure}});

struct Epoch {
  RowId tool = 0;
  std::int64_t ordinal = 0;
  WallTime began = {};
  EpochReason reason = EpochReason::first;
};

/// What of an event has a column of its own, under its name in JSON. Torques are in ten-thousandths
/// of the tool's unit, all others as the tool counts them.
enum class Column : std::uint8_t {
  preset,
  target_torque,
  torque,
  speed,
  a1,
  a2,
  a3,
  snug_angle,
  fastening_time,
  screw_count,
  error,
  direction,
  seating,
  clamp,
  prevailing,
};
inline constexpr auto column_words = enum_table<Column>({{"preset", Column::preset},
                                                         {"target_torque", Column::target_torque},
                                                         {"torque", Column::torque},
                                                         {"speed", Column::speed},
                                                         {"a1", Column::a1},
                                                         {"a2", Column::a2},
                                                         {"a3", Column::a3},
                                                         {"snug_angle", Column::snug_angle},
                                                         {"fastening_time", Column::fastening_time},
                                                         {"screw_count", Column::screw_count},
                                                         {"error", Column::error},
                                                         {"direction", Column::direction},
                                                         {"seating", Column::seating},
                                                         {"clamp", Column::clamp},
                                                         {"prevailing", Column::prevailing}});
inline constexpr std::size_t column_count = 15;

/// Values by column; empty: the product does not say it.
class Columns {
 public:
  [[nodiscard]] const std::optional<std::int64_t>& operator[](Column column) const {
    return values_[static_cast<std::size_t>(column)];
  }
  std::optional<std::int64_t>& operator[](Column column) {
    return values_[static_cast<std::size_t>(column)];
  }

 private:
  std::array<std::optional<std::int64_t>, column_count> values_ = {};
};

/// How many steps of a torque column make one of the tool's unit.
inline constexpr std::int64_t torque_scale = 10'000;

/// One event, as it is handed over to be stored.
struct Event {
  RowId tool = 0;
  RowId place = 0;
  std::uint16_t number = 0;
  WallTime at = {};  ///< of this computer's clock
  std::optional<WallTime> tool_time = std::nullopt;
  std::string source = {};  ///< push, poll, catch-up
  std::string kind = {};    ///< as in JSON
  bool remembered = false;  ///< the tool held it when it was found: its age is not known
  Columns columns = {};
  std::string barcode = {};
  Registers raw = {};  ///< the whole event block
};

/// One stored event as it is read. Texts and bytes are valid until the next one is asked for.
struct EventView {
  RowId id = 0;  ///< order of the store; never used twice
  RowId tool = 0;
  RowId place = 0;
  std::int64_t epoch = 0;
  std::uint16_t number = 0;
  WallTime at = {};
  std::optional<WallTime> tool_time = std::nullopt;
  std::string_view source = {};
  std::string_view kind = {};
  bool remembered = false;
  Columns columns = {};
  std::string_view barcode = {};
  ByteView raw = {};  ///< two bytes a register, the high one first
};

/// The curves of one stored event.
struct Curve {
  RowId event = 0;
  std::int64_t epoch = 0;        ///< of the event, as it is read
  WallTime at = {};              ///< likewise
  std::int64_t interval_us = 0;  ///< from one sample to the next; 0: not known
  std::string channels = {};     ///< what the channels are, as JSON of who stored it
  Bytes samples = {};  ///< of all channels, one behind the other: binary32, the high byte first
};

/// Events that happened, or may have, and are no rows.
struct Gap {
  RowId id = 0;
  RowId tool = 0;
  std::int64_t epoch = 0;
  /// The numbers between which they are missing; empty: not known.
  std::optional<std::uint16_t> after = std::nullopt;
  std::optional<std::uint16_t> before = std::nullopt;
  std::optional<std::uint32_t> missed = std::nullopt;  ///< empty: not known
  bool at_least = false;  ///< there may be more: the tool may have begun to count anew meanwhile
  WallTime began = {};
  WallTime ended = {};
  std::string reason = {};
};

/// What of a preset decides whether a result is good.
enum class Setting : std::uint8_t {
  target_torque,
  torque_limit,
  mode,
  target_angle,
  min_angle,
  max_angle,
};
inline constexpr auto setting_words =
    enum_table<Setting>({{"target_torque", Setting::target_torque},
                         {"torque_limit", Setting::torque_limit},
                         {"mode", Setting::mode},
                         {"target_angle", Setting::target_angle},
                         {"min_angle", Setting::min_angle},
                         {"max_angle", Setting::max_angle}});
inline constexpr std::size_t setting_count = 6;

/// The reason of a gap whose events are in the store of another collector, which had the tool then.
/// It is no loss, and told to none but who reads this store.
inline constexpr std::string_view recorded_elsewhere = "recorded by another collector";

/// The settings of one preset as they were read. Target torque in ten-thousandths of the tool's
/// unit, torque limit in ten-thousandths of a percent, angles in degrees.
struct PresetSettings {
  RowId tool = 0;
  std::int64_t preset = 0;
  WallTime since = {};
  std::array<std::optional<std::int64_t>, setting_count> values = {};

  [[nodiscard]] const std::optional<std::int64_t>& operator[](Setting setting) const {
    return values[static_cast<std::size_t>(setting)];
  }
  std::optional<std::int64_t>& operator[](Setting setting) {
    return values[static_cast<std::size_t>(setting)];
  }
};

/// What else happened: links, alarms, motors, the recorder's own start and end, totals, trims.
struct Happening {
  RowId id = 0;
  std::optional<RowId> tool = std::nullopt;
  WallTime at = {};
  std::string type = {};  ///< of the record, as in JSON
  std::string json = {};  ///< the whole record
};

/// What is known of the last that a tool told.
struct Last {
  std::int64_t epoch = 0;
  std::uint16_t number = 0;  ///< the last that is a row, or the last inside a gap behind it
  std::optional<Registers> block = std::nullopt;  ///< where it is a row
  WallTime seen = {};                             ///< until when the tool was listened to
};

}  // namespace spindle::store
