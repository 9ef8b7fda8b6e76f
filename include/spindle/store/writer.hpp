#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "spindle/base/error.hpp"
#include "spindle/store/rows.hpp"

namespace spindle::store {

/// An event with the gap that it made known: both are stored, or neither. The first event of a tool
/// begins its first epoch, whatever `begins` says; else it is `wrap`, `restart` or `unsure`.
struct NewEvent {
  Event event = {};
  std::optional<EpochReason> begins = std::nullopt;  ///< empty: counted on in the epoch of before
  std::optional<Gap> gap = std::nullopt;             ///< `epoch` and `tool` are the writer's
};

/// A gap that no event ended yet. It is known where its epoch has one between the same numbers and
/// with the same reason (and, where it has no numbers, the same beginning); so is that of an event.
struct NewGap {
  Gap gap = {};  ///< `epoch` is the writer's
};

/// The curves of an event that was handed over before: that of this number in the newest epoch of
/// its tool. Where it is not stored, or has curves already, nothing is added (`known`).
struct NewCurve {
  RowId tool = 0;
  std::uint16_t number = 0;
  Curve curve = {};  ///< `event` is the writer's
};

/// The tool was listened to until then.
struct Seen {
  RowId tool = 0;
  WallTime at = {};
};

using Entry = std::variant<NewEvent, NewGap, PresetSettings, Happening, Seen, NewCurve>;

/// What became of one entry.
struct Stored {
  enum class As : std::uint8_t {
    row,       ///< it is a new row
    known,     ///< the very same was there: nothing was added
    conflict,  ///< another event had its number: it is a row of a new epoch, behind a gap
    merged,    ///< it says nothing that is not there: settings that did not change, Seen
  };
  As as = As::row;
  RowId id = 0;            ///< of the row; 0: it has none
  std::int64_t epoch = 0;  ///< of an event or gap
  RowId gap = 0;           ///< row of the gap that was stored with an event; 0: none
};

struct Trimmed {
  std::size_t events = 0;
  std::size_t gaps = 0;
  std::size_t happenings = 0;
};

/// The one writer of a store. Every function is one transaction that is durable when it returns
/// (WAL, synchronous=FULL), or an error after which nothing of it is there: `storage` (disk full,
/// I/O error; trying again may help), `bad_file` (no store, a newer one, a damaged one). Several
/// threads may call it.
class Writer {
 public:
  /// Opens or makes the store and its folder's lock file (path + ".lock"). Errors: `storage` where
  /// another program writes it (the message names its process id) or it cannot be made; `bad_file`
  /// where it is no store of ours or a newer one.
  static Result<std::unique_ptr<Writer>> open(const std::string& path);

  Writer() = default;
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  virtual ~Writer() = default;

  /// The row of a tool, made where there is none.
  virtual Result<RowId> tool(const ToolName& name, const std::string& model) = 0;
  /// Whether there is a tool of this name.
  virtual Result<bool> has_tool(const ToolName& name) = 0;
  /// The row of a place, made where the newest one of the tool differs in anything but id,
  /// since and seen.
  virtual Result<RowId> place(const Place& place) = 0;
  /// Empty: it never told anything.
  virtual Result<std::optional<Last>> last(RowId tool) = 0;

  /// Another collector had the tool until this last event: what it tells from now on is counted
  /// behind that, in its epoch. What this store does not have of it is a gap `recorded_elsewhere`.
  /// Nothing is done where this store knows as much.
  virtual Result<void> adopt(RowId tool, const Last& last) = 0;

  /// Stores all entries in their order, in one transaction. What became of each stands in the same
  /// order, and all may be handed over again: nothing is there twice. An event whose number the
  /// newest epoch has already is compared in every register: equal is `known` (one that begins an
  /// epoch: with the same time, too); otherwise nothing is ever dropped (`conflict`: a new epoch,
  /// and a gap of unknown size in place of its own). Settings are newer than those stored before,
  /// whatever the clock says. Error `internal` where an entry names what is not there, or is no
  /// JSON.
  virtual Result<std::vector<Stored>> commit(std::span<const Entry> entries) = 0;

  /// Deletes what is older, but for the last event of each tool, the gap behind it, and former
  /// trims. The events of a tool go in the order of the store, so that no holes come between. Error
  /// `usage`: a sink has not got all of it, named in the message. Leaves a happening of type
  /// "trim".
  virtual Result<Trimmed> trim(WallTime before, WallTime now) = 0;
};

}  // namespace spindle::store
