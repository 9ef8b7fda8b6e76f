#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/forward/parcel.hpp"

namespace spindle::forward {

/// An array as PostgreSQL reads it from text: {a,"b c",NULL}.
class PostgresArray {
 public:
  void add(std::string_view text);
  void add(std::int64_t number);
  void add(bool truth);
  void add(WallTime time);
  void add_bytes(RegisterView registers);
  /// Ten-thousandths, exactly.
  void add_torque(const std::optional<std::int64_t>& steps);
  void add_null();
  template <typename Value>
  void add(const std::optional<Value>& value) {
    value ? add(*value) : add_null();
  }
  /// Null where the text is empty.
  void add_text_or_null(std::string_view text);

  [[nodiscard]] std::string take() && { return std::move(text_) + "}"; }

 private:
  void separate();

  std::string text_ = "{";
};

/// A text as PostgreSQL can keep it: bytes that are no UTF-8, and NUL, are written as "\xHH".
struct CleanText {
  std::string text = {};
  bool is_changed = false;
};
CleanText clean_text(std::string_view text);

/// The same for one JSON object: U+0000 cannot be kept, U+FFFD stands in its place.
CleanText clean_json(std::string_view json);

/// The remark of a row whose texts had to be changed; empty: nothing to remark.
std::string remark_on(const Parcel& parcel);

/// The arrays of one statement for these parcels, each of which is of the fitting kind. Pure.
std::vector<std::optional<std::string>> event_values(std::span<const Parcel* const> parcels,
                                                     const std::string& collector);
std::vector<std::optional<std::string>> gap_values(std::span<const Parcel* const> parcels,
                                                   const std::string& collector);
std::vector<std::optional<std::string>> happening_values(std::span<const Parcel* const> parcels,
                                                         const std::string& collector);

/// Each inserts what is not there yet; that of events returns the ids of what was.
extern const char* const insert_events;
extern const char* const insert_gaps;
extern const char* const insert_happenings;
/// Keys and raw bytes of events; returns of each its id, and whether its key is there and with
/// other bytes.
extern const char* const compare_events;
/// One row: key, what, reason, payload, raw, collector, id; returns it where it is new.
extern const char* const insert_conflict;

}  // namespace spindle::forward
