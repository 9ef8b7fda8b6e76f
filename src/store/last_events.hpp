#pragma once

#include <cstdint>
#include <optional>

#include "spindle/store/writer.hpp"
#include "store/connection.hpp"

namespace spindle::store {

/// Looks up the last that tools told.
class LastEvents {
 public:
  explicit LastEvents(Connection& connection);

  /// Empty: the tool never told anything.
  std::optional<Last> find(RowId tool);
  std::optional<std::int64_t> newest_epoch(RowId tool);

 private:
  Statement last_seen_;
  Statement newest_epoch_;
  Statement last_event_;
  Statement last_gap_;
};

}  // namespace spindle::store
