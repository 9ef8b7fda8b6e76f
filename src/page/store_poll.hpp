#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "page/live.hpp"
#include "page/quiet.hpp"
#include "spindle/commands/stored_rows.hpp"

namespace spindle::page {

/// Rows behind a position, as they are told: gaps and happenings first, then events, each in the
/// order of the store; none behind `until`. Ends early where `take` returns false.
Result<void> rows_between(commands::StoredRows& rows, const Position& from, const Position& until,
                          const std::function<bool(const Live::Told&)>& take);

/// Reads what is new in a store, which may not be there yet, or be replaced by another. One thread.
class StorePoll {
 public:
  /// All must outlive it.
  StorePoll(std::string path, ShiftTimes shifts, Live& live, commands::Context& context);

  /// Looks once.
  void look();

 private:
  void tell_absence();
  Result<void> open();
  Result<void> load();
  Result<void> read_history(Board& board, const Shift& shift);
  Result<void> read_new();
  Result<void> note_places(Board& board);
  const ProductWords& words_of(const std::string& profile);
  [[nodiscard]] Recorder recorder();

  std::string path_;
  ShiftTimes shifts_;
  Live* live_;
  QuietContext context_;
  std::optional<std::string> identity_ = std::nullopt;  ///< of the file that is there
  std::optional<std::string> loaded_ = std::nullopt;    ///< of the file that was read last
  std::unique_ptr<commands::StoredRows> rows_ = nullptr;
  std::map<std::string, ProductWords> words_ = {};
  Shift shift_ = {};
  Position position_ = {};
  /// Where the system's list of locks does not have the recorder, and yet rows come, it runs in
  /// another container.
  std::optional<TimePoint> stopped_since_ = std::nullopt;
  std::optional<TimePoint> moved_at_ = std::nullopt;
};

}  // namespace spindle::page
