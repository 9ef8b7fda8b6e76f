#pragma once

#include <memory>
#include <string>

#include "spindle/commands/context.hpp"
#include "spindle/store/reader.hpp"

namespace spindle::commands {

/// A store that is read as the records of `spindle results`, for the programs that hand them on.
class StoredRows {
 public:
  /// Errors: those of store::Reader. `context` must outlive it.
  static Result<std::unique_ptr<StoredRows>> open(const std::string& path, Context& context);

  StoredRows() = default;
  StoredRows(const StoredRows&) = delete;
  StoredRows& operator=(const StoredRows&) = delete;
  virtual ~StoredRows() = default;

  virtual store::Reader& reader() = 0;
  /// Reads which tools and places are new; to be called before rows that were stored since.
  virtual Result<void> refresh() = 0;

  /// As `spindle results -o json` tells it; report::to_json() makes a line of it.
  virtual report::Record event(const store::EventView& row) = 0;
  virtual report::Record gap(const store::Gap& row) = 0;
  virtual report::Record happening(const store::Happening& row) = 0;

  /// Null where they are not known. They stay valid.
  [[nodiscard]] virtual const store::Tool* tool(store::RowId id) const = 0;
  [[nodiscard]] virtual const store::Place* place(store::RowId id) const = 0;
  /// Where a tool was reached at a time; null for one that was never reached.
  [[nodiscard]] virtual const store::Place* place_at(store::RowId tool, WallTime time) const = 0;
};

}  // namespace spindle::commands
