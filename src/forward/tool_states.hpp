#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "spindle/commands/stored_rows.hpp"
#include "spindle/forward/sink.hpp"

namespace spindle::forward {

/// What is so of each tool now, as the store says it: whether it is connected, what it did last,
/// whether it has an alarm. A target that is another tool by now is that tool. One thread.
class ToolStates {
 public:
  /// `rows` must outlive it.
  explicit ToolStates(commands::StoredRows& rows) : rows_(&rows) {}

  /// Of which it changed since this was last asked; all the first time. What is said of a link is
  /// no longer known when the recorder has not heard of the tool for a minute.
  Result<std::vector<ToolState>> changed(WallTime now);

  /// The next changed() tells of all.
  void forget_told() { told_.clear(); }

  /// The names of all targets, as far as they were read.
  [[nodiscard]] std::vector<std::string> targets() const;

 private:
  /// One tool, under the name that it had last.
  struct Subject {
    store::Place place = {};
    std::string serial = {};
    std::optional<report::Record> result = std::nullopt;  ///< of its last result
    std::int64_t seq = 0;                                 ///< of that result
    report::Cell alarm = {};                              ///< its code; null: none
    report::Cell alarm_text = {};                         ///< null: not known
    std::string link = {};                                ///< as it was told last; empty: never
    WallTime heard = {};                                  ///< when it was last heard of
  };

  Result<void> read_places();
  Result<void> read_all(Subject& subject);
  Result<void> read_event(store::RowId tool, const store::Counted& counted);
  Result<void> read_new_events();
  Result<void> read_happenings();
  void take(const store::EventView& row);
  void take(const store::Happening& row);
  [[nodiscard]] report::Record record_of(const Subject& subject, WallTime now) const;

  commands::StoredRows* rows_;
  std::int64_t state_ = -1;     ///< of the store, when it was last read
  store::Positions read_ = {};  ///< up to where
  bool is_begun_ = false;
  std::map<store::RowId, Subject> subjects_ = {};     ///< by tool
  std::map<std::string, store::RowId> tool_of_ = {};  ///< by target
  std::map<std::string, std::string> told_ = {};      ///< by target, without the time
};

}  // namespace spindle::forward
