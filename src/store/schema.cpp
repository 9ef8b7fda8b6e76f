#include "store/schema.hpp"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cstddef>
#include <optional>
#include <string_view>

#include "spindle/base/percent.hpp"

namespace spindle::store {
namespace {

/// Each one makes the next version of the one before; what was released stays as it is.
constexpr std::array<std::string_view, 3> migrations = {R"(
CREATE TABLE tool (
  id INTEGER PRIMARY KEY,
  maker TEXT NOT NULL,
  serial TEXT NOT NULL,
  model TEXT,
  UNIQUE (maker, serial)
) STRICT;

CREATE TABLE place (
  id INTEGER PRIMARY KEY,
  tool INTEGER NOT NULL REFERENCES tool,
  name TEXT NOT NULL,
  url TEXT NOT NULL,
  profile TEXT NOT NULL,
  firmware INTEGER,
  torque_unit TEXT,
  since INTEGER NOT NULL,
  seen INTEGER
) STRICT;
CREATE INDEX place_of_tool ON place (tool);

CREATE TABLE epoch (
  tool INTEGER NOT NULL REFERENCES tool,
  ordinal INTEGER NOT NULL,
  began INTEGER NOT NULL,
  reason TEXT NOT NULL CHECK (reason IN ('first', 'wrap', 'restart', 'unsure')),
  PRIMARY KEY (tool, ordinal)
) STRICT, WITHOUT ROWID;

-- id: the order of the journal, for cursors; never used twice.
CREATE TABLE event (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  tool INTEGER NOT NULL,
  epoch INTEGER NOT NULL,
  number INTEGER NOT NULL CHECK (number BETWEEN 0 AND 65535),
  place INTEGER NOT NULL REFERENCES place,
  at INTEGER NOT NULL,
  tool_time INTEGER,
  source TEXT NOT NULL,
  kind TEXT NOT NULL,
  remembered INTEGER NOT NULL DEFAULT 0,
  preset INTEGER,
  target_torque INTEGER,
  torque INTEGER,
  speed INTEGER,
  a1 INTEGER,
  a2 INTEGER,
  a3 INTEGER,
  snug_angle INTEGER,
  fastening_time INTEGER,
  screw_count INTEGER,
  error INTEGER,
  direction INTEGER,
  seating INTEGER,
  clamp INTEGER,
  prevailing INTEGER,
  barcode TEXT,
  raw BLOB NOT NULL,
  UNIQUE (tool, epoch, number),
  FOREIGN KEY (tool, epoch) REFERENCES epoch (tool, ordinal)
) STRICT;
CREATE INDEX event_of_tool ON event (tool, at);
CREATE INDEX event_at ON event (at);

CREATE TABLE gap (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  tool INTEGER NOT NULL,
  epoch INTEGER NOT NULL,
  after INTEGER,
  before INTEGER,
  missed INTEGER,
  at_least INTEGER NOT NULL DEFAULT 0,
  began INTEGER NOT NULL,
  ended INTEGER NOT NULL,
  reason TEXT NOT NULL,
  FOREIGN KEY (tool, epoch) REFERENCES epoch (tool, ordinal)
) STRICT;
CREATE INDEX gap_of_tool ON gap (tool, epoch, before);

CREATE TABLE preset (
  tool INTEGER NOT NULL REFERENCES tool,
  preset INTEGER NOT NULL,
  since INTEGER NOT NULL,
  target_torque INTEGER,
  torque_limit INTEGER,
  mode INTEGER,
  target_angle INTEGER,
  min_angle INTEGER,
  max_angle INTEGER,
  PRIMARY KEY (tool, preset, since)
) STRICT, WITHOUT ROWID;

CREATE TABLE happening (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  tool INTEGER REFERENCES tool,
  at INTEGER NOT NULL,
  type TEXT NOT NULL,
  json TEXT NOT NULL CHECK (json_valid(json))
) STRICT;
CREATE INDEX happening_at ON happening (at);

CREATE TABLE curve (
  event INTEGER PRIMARY KEY REFERENCES event ON DELETE CASCADE,
  interval_us INTEGER NOT NULL,
  channels TEXT NOT NULL,
  samples BLOB NOT NULL
) STRICT;

-- cursor: the last event that the sink has got.
CREATE TABLE sink (
  name TEXT PRIMARY KEY,
  cursor INTEGER NOT NULL,
  url TEXT NOT NULL,
  moved INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
)",
                                                        R"(
-- The last gap and the last happening that the sink has got.
ALTER TABLE sink ADD COLUMN gap INTEGER NOT NULL DEFAULT 0;
ALTER TABLE sink ADD COLUMN happening INTEGER NOT NULL DEFAULT 0;
)",
                                                        R"(
-- The number of the lease under which the tool was listened to there.
ALTER TABLE place ADD COLUMN fence INTEGER;
)"};
constexpr auto newest_version = static_cast<std::int64_t>(migrations.size());

std::int64_t number_of(Connection& connection, std::string_view sql) {
  Statement statement(connection, sql);
  Rows rows = statement.query();
  return rows.next() ? rows.integer(0) : 0;
}

Error not_ours(const std::string& path) {
  return {.code = Errc::bad_file,
          .message = "is a database of another program",
          .hint = "give the path of a store, or of a file that is not there yet",
          .name = path};
}

/// Empty: it is another program's.
Result<std::optional<Found>> judge_header(Connection& file) {
  std::optional<Found> found;
  const std::int64_t application = number_of(file, "PRAGMA application_id");
  if (application == application_id) {
    found = Found::store;
  } else if (application == 0 && number_of(file, "PRAGMA user_version") == 0 &&
             number_of(file, "SELECT count(*) FROM sqlite_master") == 0) {
    found = Found::nothing;
  }
  TRY(file.outcome());
  return found;
}

}  // namespace

bool is_there(const std::string& path) {
  sqlite3_vfs* files = sqlite3_vfs_find(nullptr);
  int found = 0;
  return files != nullptr &&
         files->xAccess(files, path.c_str(), SQLITE_ACCESS_EXISTS, &found) == SQLITE_OK &&
         found != 0;
}

std::string unchanging(const std::string& path) {
  std::string uri = "file:";
  for (const char c : path) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '/' ||
                          c == '.' || c == '-' || c == '_';
    uri += is_plain ? std::string(1, c) : percent_encoded(c);
  }
  return uri + "?immutable=1";
}

Result<Found> examine(const std::string& path) {
  if (!is_there(path)) return Found::nothing;
  TRY_LET(auto file,
          Connection::open(unchanging(path), SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, path));
  const auto found = judge_header(*file);
  if (found && *found) return **found;
  if (found) return tl::unexpected(not_ours(path));
  // A store that was cut off while it was made is no database before its journal is rolled back.
  if (is_there(path + "-journal")) return Found::nothing;
  return tl::unexpected(found.error());
}

Result<Found> check_open(Connection& connection) {
  TRY_LET(const auto found, judge_header(connection));
  if (!found) return tl::unexpected(not_ours(connection.path()));
  const std::int64_t version = number_of(connection, "PRAGMA user_version");
  TRY(connection.outcome());
  if (version <= newest_version) return *found;
  return tl::unexpected(
      Error{.code = Errc::bad_file,
            .message = fmt::format("is a store of version {}, this program knows versions up to {}",
                                   version, newest_version),
            .hint = "use the newer spindle that made it",
            .name = connection.path()});
}

Result<std::int64_t> version_of(Connection& connection) {
  TRY_LET(const auto found, check_open(connection));
  const std::int64_t version = number_of(connection, "PRAGMA user_version");
  TRY(connection.outcome());
  return found == Found::nothing ? 0 : version;
}

std::int64_t known_version() { return newest_version; }

Result<void> migrate(Connection& connection) {
  connection.run("BEGIN IMMEDIATE");
  const std::int64_t version = number_of(connection, "PRAGMA user_version");
  for (std::int64_t next = version; next < newest_version; ++next) {
    connection.run(std::string(migrations.at(static_cast<std::size_t>(next))));
  }
  if (version < newest_version) {
    connection.run(fmt::format("PRAGMA application_id = {}", application_id));
    connection.run(fmt::format("PRAGMA user_version = {}", newest_version));
  }
  return connection.end_transaction();
}

Result<void> set_durable(Connection& connection) {
  Statement mode(connection, "PRAGMA journal_mode = WAL");
  std::string now;
  {
    Rows rows = mode.query();
    if (rows.next()) now = rows.text(0);
  }
  if (!connection.failed() && now != "wal") {
    return tl::unexpected(
        Error{.code = Errc::storage,
              .message = "a write-ahead log cannot be kept here",
              .hint = "network file systems cannot hold a store: use a disk of this computer",
              .name = connection.path()});
  }
  constexpr std::int64_t longest_log = 64LL << 20U;
  connection.run("PRAGMA synchronous = FULL");
  connection.run("PRAGMA foreign_keys = ON");
  connection.run(fmt::format("PRAGMA journal_size_limit = {}", longest_log));
  return connection.outcome();
}

}  // namespace spindle::store
