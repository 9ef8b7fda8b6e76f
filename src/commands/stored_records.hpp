#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "event_records.hpp"
#include "spindle/store/reader.hpp"
#include "watched_tool.hpp"

namespace spindle::commands {

/// What is kept in ten-thousandths, with the decimals that it needs, two at least.
Decimal in_units(std::int64_t steps);

/// The rows of a store as the records that they were when they were told. What a profile says is
/// taken from the present one: it may have been corrected since. Where it is not known any more, or
/// its events have another size, there is what the store itself understands, and a note says so.
class StoredRecords {
 public:
  /// Reads who is in the store. `shelf` and `context` must outlive it.
  static Result<StoredRecords> make(store::Reader& reader, ProfileShelf& shelf, Context& context);

  /// Reads who came since; tells the places that are new. What is known stays where it is.
  Result<std::vector<const store::Place*>> refresh(store::Reader& reader);

  [[nodiscard]] const std::deque<store::Tool>& tools() const { return tools_; }
  [[nodiscard]] const std::deque<store::Place>& places() const { return places_; }
  [[nodiscard]] const store::Tool* tool(store::RowId id) const;
  [[nodiscard]] const store::Place* place(store::RowId id) const;
  /// Where a tool was reached at a time; null for a tool that was never reached.
  [[nodiscard]] const store::Place* place_at(store::RowId tool, WallTime time) const;

  report::Record event(const store::EventView& row);
  report::Record gap(const store::Gap& row);
  /// With what a table shows of it.
  [[nodiscard]] report::Record happening(const store::Happening& row) const;

  /// Of a place's profile; null where it is not known or has no events.
  const KnownProfile* known(const store::Place& place);

  /// As `watch` shows the tools of these places.
  std::vector<report::Column> table_columns(const std::vector<const store::Place*>& places,
                                            Tools tools);
  /// Everything that is known of their events, gaps and happenings, units too.
  std::vector<report::Column> all_columns(const std::vector<const store::Place*>& places);

 private:
  /// What is known of a place's tool.
  struct Speaker {
    Target target = {};
    const KnownProfile* known = nullptr;
    bool is_strange = false;                            ///< its profile is not known any more
    std::optional<NewsRecords> records = std::nullopt;  ///< of gaps also where `known` is null
  };

  StoredRecords(ProfileShelf& shelf, Context& context) : shelf_(&shelf), context_(&context) {}

  Speaker& speaker(const store::Place& place);
  [[nodiscard]] Naming naming(store::RowId tool, std::int64_t epoch, store::RowId id) const;
  report::Record event_by_columns(const store::EventView& row, const Speaker& speaker) const;

  ProfileShelf* shelf_;
  Context* context_;
  std::deque<store::Tool> tools_ = {};
  std::deque<store::Place> places_ = {};
  std::map<store::RowId, const store::Tool*> tool_by_id_ = {};
  std::map<store::RowId, const store::Place*> place_by_id_ = {};
  std::map<store::RowId, std::unique_ptr<Speaker>> speakers_ = {};
  std::set<std::string> told_ = {};  ///< profiles of which a note spoke
};

}  // namespace spindle::commands
