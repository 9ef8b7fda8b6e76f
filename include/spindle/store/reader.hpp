#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spindle/base/error.hpp"
#include "spindle/store/rows.hpp"
#include "spindle/store/sinks.hpp"

namespace spindle::store {

/// Which rows are wanted. What is empty asks for all. Gaps are asked by tools, epoch, after, newest
/// and the time that they share with since and until; happenings by tools, since, until, after,
/// newest and, as kinds, their types.
struct Filter {
  std::vector<RowId> tools = {};
  std::vector<RowId> places = {};                ///< of events only
  std::optional<WallTime> since = std::nullopt;  ///< from this time on
  std::optional<WallTime> until = std::nullopt;  ///< before this time
  std::optional<std::int64_t> preset = std::nullopt;
  std::vector<std::string> kinds = {};
  std::optional<std::int64_t> epoch = std::nullopt;
  std::optional<std::uint16_t> number = std::nullopt;
  RowId after = 0;                                   ///< rows behind this one
  std::optional<std::size_t> newest = std::nullopt;  ///< at most so many, the newest ones
  /// Of events, only these columns, and neither barcode nor raw: half the time.
  std::optional<std::vector<Column>> columns = std::nullopt;
};

/// How the numbers of one tool in one epoch are covered by rows and gaps: each number from the
/// first to the last is a row, else in a gap, else a hole.
struct Coverage {
  RowId tool = 0;
  std::int64_t epoch = 0;
  std::uint16_t first = 0;  ///< that is a row or in a gap; 0 where the epoch before it is stored
                            ///< and its counter only wrapped
  std::uint16_t last = 0;   ///< the same; 65535 where the counter wraps behind it
  std::size_t rows = 0;
  std::size_t in_gaps = 0;
  std::size_t holes = 0;
  std::size_t unknown_gaps = 0;  ///< gaps of unknown size, or that may be larger
};

/// What stands behind a sink's place.
struct Backlog {
  std::size_t events = 0;
  std::size_t gaps = 0;
  std::size_t happenings = 0;
  std::optional<WallTime> oldest = std::nullopt;  ///< of its events and gaps; empty: it has none
};

/// An event by how its tool counts it.
struct Counted {
  std::int64_t epoch = 0;
  std::uint16_t number = 0;
};

/// Reads a store, also while it is written, and by several programs. Every function sees the store
/// as it was at one moment; one that takes long keeps the writer's log from being emptied. Errors:
/// `bad_file` where it is no store, a newer or a damaged one; `storage` where it cannot be read.
/// One thread.
class Reader {
 public:
  static Result<std::unique_ptr<Reader>> open(const std::string& path);

  Reader() = default;
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  virtual ~Reader() = default;

  virtual Result<std::vector<Tool>> tools() = 0;
  virtual Result<std::vector<Place>> places() = 0;  ///< the oldest first
  virtual Result<std::vector<Epoch>> epochs() = 0;
  virtual Result<std::vector<PresetSettings>> settings() = 0;  ///< by tool, preset and time

  /// In the order of the store, until `take` returns false.
  virtual Result<void> events(const Filter& filter,
                              const std::function<bool(const EventView&)>& take) = 0;
  /// The curves of an event; empty: none are stored.
  virtual Result<std::optional<Curve>> curve(RowId event) = 0;
  /// All curves of events behind this one, until `take` returns false.
  virtual Result<void> curves(RowId after, const std::function<bool(const Curve&)>& take) = 0;
  virtual Result<std::vector<Gap>> gaps(const Filter& filter) = 0;
  virtual Result<void> happenings(const Filter& filter,
                                  const std::function<bool(const Happening&)>& take) = 0;

  /// The last that a tool told; empty: nothing, or there is no such tool.
  virtual Result<std::optional<Last>> last(const ToolName& name) = 0;

  /// The newest event's id; 0: there is none.
  virtual Result<RowId> newest() = 0;

  /// The size of the store, without what its log holds.
  virtual Result<std::uint64_t> bytes() = 0;

  virtual Result<std::vector<Coverage>> coverage() = 0;
  /// What SQLite's integrity check and ours find wrong, a line each; empty: nothing.
  virtual Result<std::vector<std::string>> integrity() = 0;

  /// A whole copy, made while others write. Error `usage`: the file is there.
  virtual Result<void> backup(const std::string& path) = 0;

  /// Changes whenever another program has stored something.
  virtual Result<std::int64_t> state() = 0;

  /// How many rows there are behind these.
  virtual Result<Backlog> behind(const Positions& positions) = 0;
  /// The newest row of each stream.
  virtual Result<Positions> ends() = 0;
  /// The positions before everything that was stored of this time or later.
  virtual Result<Positions> before(WallTime time) = 0;
  /// The event of these kinds that a tool counted last before this number; empty: there is none.
  virtual Result<std::optional<Counted>> counted_before(RowId tool, const Counted& event,
                                                        const std::vector<std::string>& kinds) = 0;
  /// The sinks that were served from here, by name.
  virtual Result<std::vector<SinkRow>> sinks() = 0;
};

}  // namespace spindle::store
