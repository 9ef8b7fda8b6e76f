#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "listing.hpp"
#include "result_selection.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {

/// Reads a store part by part, so that no slow reader of the output holds up who writes the store,
/// and tells each row once: events in the order of the store, a gap before the event that made it
/// known, all else where its time is.
class ResultStream {
 public:
  /// All must outlive it. What a selection by content leaves out is counted all the same.
  ResultStream(store::Reader& reader, StoredRecords& records, const Selection& selection, Told told,
               std::optional<std::size_t> newest);

  /// Tells what is stored and was not told yet, until `take` returns false.
  using Take = std::function<bool(const report::Record& record)>;
  Result<void> tell_new(const Take& take);

  [[nodiscard]] std::vector<report::Field> counts() const;
  /// "1204 events, 1187 OK, 17 NG, 2 gaps, 5 missed".
  [[nodiscard]] std::string sentence() const;

 private:
  /// What is no event and waits for its place among them.
  struct Other {
    WallTime at = {};
    report::Record record = {};
    bool is_shown = true;
    std::optional<store::Gap> gap = std::nullopt;
    bool is_told = false;
  };
  using EventName = std::tuple<store::RowId, std::int64_t, std::uint16_t>;

  Result<void> note_places();
  Result<void> find_begin();
  Result<void> read_others();
  Result<void> read_gaps();
  Result<void> read_happenings();
  void sort_others();
  Result<std::size_t> read_part();
  void tell_before(const store::EventView& row);
  void forget_older(const store::EventView& row);
  void tell(Other& other);
  void note(const store::EventView& row);

  store::Reader* reader_;
  StoredRecords* records_;
  const Selection* selection_;
  Told told_;
  std::optional<std::size_t> newest_;
  store::Filter filter_;
  store::Filter gap_filter_;
  store::Filter happening_filter_;
  store::RowId last_ = 0;  ///< the newest event that is told in this round
  bool is_first_event_ = true;
  std::vector<Other> others_ = {};
  std::size_t next_other_ = 0;
  std::map<EventName, std::size_t> gap_before_ = {};
  std::vector<report::Record> part_ = {};
  std::size_t events_ = 0;
  std::size_t ok_ = 0;
  std::size_t ng_ = 0;
  std::size_t remembered_ = 0;  ///< of unknown age: neither OK nor NG
  std::size_t gaps_ = 0;
  std::size_t missed_ = 0;
  std::size_t unknown_gaps_ = 0;
};

}  // namespace spindle::commands
