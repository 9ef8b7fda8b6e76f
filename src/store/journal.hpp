#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "spindle/store/writer.hpp"
#include "store/connection.hpp"
#include "store/last_events.hpp"

namespace spindle::store {

/// What a writer stores and looks up, inside a transaction that is open. It remembers nothing: what
/// is rolled back never happened.
class Journal {
 public:
  explicit Journal(Connection& connection);

  RowId tool(const ToolName& name, const std::string& model);
  bool has_tool(const ToolName& name);
  RowId place(const Place& place);
  std::optional<Last> last(RowId tool) { return last_.find(tool); }

  void adopt(RowId tool, const Last& other);

  Stored store(const NewEvent& entry);
  Stored store(const NewGap& entry);
  Stored store(const PresetSettings& settings);
  Stored store(const Happening& happening);
  Stored store(const Seen& seen);
  Stored store(const NewCurve& entry);

 private:
  /// A row whose number an event has.
  struct Taken {
    RowId id = 0;
    WallTime at = {};
    bool is_equal = false;
  };

  [[nodiscard]] RowId new_row() const { return sqlite3_last_insert_rowid(connection_.handle()); }
  std::optional<RowId> find_tool(const ToolName& name);
  void begin_epoch(RowId tool, std::int64_t ordinal, WallTime at, EpochReason reason);
  std::optional<Taken> taken(const Event& event, std::int64_t epoch, const Bytes& raw);
  RowId insert(const Event& event, std::int64_t epoch, const Bytes& raw);
  Stored insert_conflict(const NewEvent& entry, std::int64_t epoch, const Taken& other,
                         const Bytes& raw);
  Stored store(const Gap& gap, RowId tool, std::int64_t epoch);

  Connection& connection_;
  LastEvents last_;
  Statement find_tool_;
  Statement insert_tool_;
  Statement newest_place_;
  Statement insert_place_;
  Statement set_seen_;
  Statement insert_epoch_;
  Statement find_event_;
  Statement insert_event_;
  Statement find_gap_;
  Statement insert_gap_;
  Statement newest_settings_;
  Statement insert_settings_;
  Statement find_happening_;
  Statement insert_happening_;
  Statement insert_curve_;
};

}  // namespace spindle::store
