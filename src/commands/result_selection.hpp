#pragma once

#include <set>
#include <string>
#include <vector>

#include "spindle/commands/commands.hpp"
#include "spindle/store/reader.hpp"
#include "stored_records.hpp"

namespace spindle::commands {

/// Which rows of a store a command line means.
struct Selection {
  store::Filter filter = {};                      ///< of events
  std::vector<const store::Place*> places = {};   ///< that the events can be of
  std::set<std::string, std::less<>> names = {};  ///< of the targets that were named; empty: all
  bool has_one_name = false;                      ///< of one target, not of a group
  bool is_about_content = false;                  ///< what is no result does not fit
  bool is_whole = false;                          ///< nothing was left out

  /// Whether a row without a place is meant, by the tool that it is of.
  [[nodiscard]] bool has(const store::Place* place) const {
    return names.empty() || (place != nullptr && names.contains(place->name));
  }
};

/// Errors: `unknown_name` with a suggestion, `usage`. Names that the tools file knows and the store
/// does not have no rows, and a note says so.
Result<Selection> select_results(const ResultFilter& wanted, const StoredRecords& records,
                                 const Context& context);

/// Opens the store that is meant.
Result<std::unique_ptr<store::Reader>> open_store(const std::string& named, const Context& context);

}  // namespace spindle::commands
