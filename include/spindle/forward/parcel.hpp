#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "spindle/store/rows.hpp"

namespace spindle::forward {

/// One row of the store on its way to a sink, with everything that a sink may want of it.
struct Parcel {
  using Row = std::variant<store::Event, store::Gap, store::Happening>;

  store::RowId id = 0;           ///< in its stream: of events, of gaps or of happenings
  store::ToolName tool = {};     ///< both empty: it is about no tool, or none that is known
  std::string target = {};       ///< what the user called the tool then; empty: not known
  std::string torque_unit = {};  ///< set on the tool then; empty: not known
  WallTime at = {};              ///< of a gap: its end
  std::int64_t epoch = 0;        ///< of events and gaps
  /// Of an event: the number of the lease under which it was recorded; empty: under none.
  std::optional<std::int64_t> fence = std::nullopt;
  bool is_result = false;  ///< an event that a fastening ended with, of known age or not
  /// Sequence number of the tool's result before this event; empty: it is the first, or no event.
  std::optional<std::int64_t> previous = std::nullopt;
  Row row = {};
  /// The record of `spindle results -o json`, one line without its end, with `collector` and, of an
  /// event, `seq` and `previous`.
  std::string json = {};

  [[nodiscard]] const store::Event* event() const { return std::get_if<store::Event>(&row); }
  [[nodiscard]] const store::Gap* gap() const { return std::get_if<store::Gap>(&row); }
  [[nodiscard]] const store::Happening* happening() const {
    return std::get_if<store::Happening>(&row);
  }
};

/// Grows by one with each event of a tool, also where its 16-bit counter wraps: epoch × 65536 +
/// number.
std::int64_t sequence_number(std::int64_t epoch, std::uint16_t number);

/// What names a parcel for ever, by all collectors and however often it is sent:
/// "maker/serial/epoch/number" of an event; "maker/serial/epoch/gap/AFTER-BEFORE/REASON" of a gap,
/// with the time of its beginning in ms in place of numbers that it has not; empty of a happening.
/// What would not be
/// clear in a name ('/', '%', control characters, what is no UTF-8) stands as %XX.
std::string key_of(const Parcel& parcel);

}  // namespace spindle::forward
