#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "spindle/base/error.hpp"
#include "spindle/store/rows.hpp"

namespace spindle::store {

/// How far a sink has got the rows of a store: the last one of each stream that it has for good. 0:
/// none.
struct Positions {
  RowId event = 0;
  RowId gap = 0;
  RowId happening = 0;

  friend bool operator==(const Positions&, const Positions&) = default;
};

/// What a store knows of a sink that was served from it.
struct SinkRow {
  std::string name = {};
  std::string url = {};  ///< where it was last; without user and password
  Positions positions = {};
  WallTime moved = {};  ///< when it got something, or began
};

/// The place of one sink in a store, kept by the one program that serves it. Nothing that lies
/// before it can be trimmed away. Errors: `storage` (disk full, I/O error, another program), and
/// `bad_file` where it is no store any more. One thread.
class SinkCursor {
 public:
  /// Takes the sink of this name, with the right to serve it (a lock on "STORE.sink-NAME.lock",
  /// characters other than letters, digits, '.', '_' and '-' as %XX). A store of an older version
  /// is brought up to date unless another program writes it. Errors: `storage` where another
  /// program serves this sink (the message names its process id) or an older one is written;
  /// `bad_file` where there is no store.
  static Result<std::unique_ptr<SinkCursor>> open(const std::string& path, const std::string& name);

  SinkCursor() = default;
  SinkCursor(const SinkCursor&) = delete;
  SinkCursor& operator=(const SinkCursor&) = delete;
  virtual ~SinkCursor() = default;

  /// As it was stored last; nothing anywhere for a sink that is new.
  [[nodiscard]] virtual const SinkRow& row() const = 0;
  [[nodiscard]] virtual bool is_new() const = 0;

  /// Stores where the sink is now. It is safe from a crash of the program when this returns; a
  /// power cut may take some of it back, after which the sink gets these rows once more.
  virtual Result<void> move(const Positions& positions, const std::string& url, WallTime now) = 0;
};

/// Forgets a sink, so that it holds back no trim. Whether there was one. Errors: `storage` where a
/// program serves it; `bad_file` where there is no store.
Result<bool> forget_sink(const std::string& path, const std::string& name);

}  // namespace spindle::store
