#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spindle/commands/stored_rows.hpp"
#include "spindle/forward/parcel.hpp"

namespace spindle::forward {

/// What of a store a sink has not got yet, in the order in which it is sent: by time, a gap before
/// the event that made it known. Each stream is in the order of the store, so that for each one
/// number says how far the sink is. Reads a part at a time. One thread.
class Outbox {
 public:
  /// Whether a sink is to get a parcel; it has no `json` yet.
  using Wants = std::function<bool(const Parcel& parcel)>;

  /// What is behind `from`, and not behind `until`, where there is one. `rows` must outlive it.
  Outbox(commands::StoredRows& rows, std::string collector, Wants wants,
         const store::Positions& from, std::optional<store::Positions> until = std::nullopt);

  /// Holds so many parcels that wait, or all there are.
  Result<void> fill(std::size_t wanted);

  /// The oldest that wait, at most so many.
  [[nodiscard]] std::span<const Parcel> front(std::size_t most) const;
  [[nodiscard]] bool empty() const { return parcels_.size() == gone_; }

  /// The sink has so many of the front for good.
  void acknowledge(std::size_t count);

  /// How far the sink is; what it does not want counts as got.
  [[nodiscard]] const store::Positions& positions() const { return positions_; }

 private:
  struct Loaded {
    Parcel parcel = {};
    bool is_wanted = false;
  };
  /// One stream: what is read and not yet put among the others.
  struct Stream {
    store::RowId store::Positions::*place = nullptr;
    std::deque<Loaded> rows = {};
    bool may_have_more = true;
  };

  Result<void> load(Stream& stream);
  Result<void> load_events();
  Result<void> load_gaps();
  Result<void> load_happenings();
  Result<void> add_event(const store::EventView& row);
  Result<std::optional<std::int64_t>> previous_result(const store::EventView& row);
  void name(Parcel& parcel, store::RowId tool, const store::Place* place) const;
  void add(Stream& stream, Parcel parcel, const std::function<report::Record()>& record);
  [[nodiscard]] bool is_within(const Stream& stream, store::RowId id) const;
  Result<Stream*> next();
  void put(Stream& stream);

  commands::StoredRows* rows_;
  std::string collector_;
  Wants wants_;
  std::optional<store::Positions> until_;
  /// What was stored before it was last read who is in the store: so all of it is known.
  store::Positions ends_ = {};
  store::Positions loaded_;     ///< the last that was read of each stream
  store::Positions put_;        ///< the last that was put among the others
  store::Positions positions_;  ///< the last that the sink has
  std::int64_t state_ = -1;     ///< of the store, when it was last read
  Stream gaps_ = {.place = &store::Positions::gap};
  Stream happenings_ = {.place = &store::Positions::happening};
  Stream events_ = {.place = &store::Positions::event};
  std::map<store::RowId, std::optional<std::int64_t>> results_ = {};  ///< the last one by tool
  std::vector<Parcel> parcels_ = {};
  std::vector<store::Positions> behind_ = {};  ///< where the sink is when it has this one
  std::size_t gone_ = 0;                       ///< of the front of both
};

}  // namespace spindle::forward
