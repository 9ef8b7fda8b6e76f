#include "spindle/store/sinks.hpp"

#include <filesystem>
#include <utility>

#include "store/connection.hpp"
#include "store/lock.hpp"
#include "store/schema.hpp"

namespace spindle::store {
namespace {

Error nothing_there(const std::string& path) {
  return {.code = Errc::bad_file,
          .message = "there is no store",
          .hint = "'spindle record' makes one",
          .name = path};
}

/// A store of before there were places of sinks for all that it holds.
Result<void> bring_up_to_date(Connection& connection) {
  auto lock = WriterLock::take(connection.path());
  if (!lock) {
    lock.error().message = "is of an older version, and " + message_of(lock.error());
    lock.error().hint = "start the recorder anew with this version of spindle";
    return tl::unexpected(std::move(lock.error()));
  }
  return migrate(connection);
}

Result<std::unique_ptr<Connection>> open_store(const std::string& path) {
  TRY_LET(const auto found, examine(path));
  if (found == Found::nothing) return tl::unexpected(nothing_there(path));
  TRY_LET(auto connection, Connection::open(path, SQLITE_OPEN_READWRITE, path));
  TRY_LET(const auto version, version_of(*connection));
  if (version < known_version()) {
    TRY(bring_up_to_date(*connection));
  }
  // What a power cut takes back is sent once more; the recorder waits for no disk because of it.
  connection->run("PRAGMA synchronous = NORMAL");
  TRY(connection->outcome());
  return connection;
}

class FileCursor : public SinkCursor {
 public:
  FileCursor(WriterLock lock, std::unique_ptr<Connection> connection, const std::string& name)
      : lock_(std::move(lock)), connection_(std::move(connection)), move_(*connection_, R"(
          INSERT INTO sink (name, cursor, gap, happening, url, moved)
          VALUES (?1, ?2, ?3, ?4, ?5, ?6)
          ON CONFLICT (name) DO UPDATE SET cursor = excluded.cursor, gap = excluded.gap,
            happening = excluded.happening, url = excluded.url, moved = excluded.moved)") {
    row_.name = name;
  }

  Result<void> read() {
    Statement find(*connection_,
                   "SELECT cursor, gap, happening, url, moved FROM sink WHERE name = ?1");
    {
      Rows rows = find.query(row_.name);
      if (rows.next()) {
        is_new_ = false;
        row_.positions = {rows.integer(0), rows.integer(1), rows.integer(2)};
        row_.url = rows.text(3);
        row_.moved = rows.time(4);
      }
    }
    return connection_->outcome();
  }

  [[nodiscard]] const SinkRow& row() const override { return row_; }
  [[nodiscard]] bool is_new() const override { return is_new_; }

  Result<void> move(const Positions& positions, const std::string& url, WallTime now) override {
    move_.run(row_.name, positions.event, positions.gap, positions.happening, url, now);
    TRY(connection_->outcome());
    row_.positions = positions;
    row_.url = url;
    row_.moved = now;
    is_new_ = false;
    return {};
  }

 private:
  WriterLock lock_;
  std::unique_ptr<Connection> connection_;
  Statement move_;
  SinkRow row_ = {};
  bool is_new_ = true;
};

std::string whole(const std::string& path) {
  return std::filesystem::absolute(path).lexically_normal().string();
}

}  // namespace

Result<std::unique_ptr<SinkCursor>> SinkCursor::open(const std::string& path,
                                                     const std::string& name) {
  if (!is_there(whole(path))) return tl::unexpected(nothing_there(whole(path)));
  TRY_LET(auto lock, WriterLock::take_sink(whole(path), name));
  TRY_LET(auto connection, open_store(whole(path)));
  auto cursor = std::make_unique<FileCursor>(std::move(lock), std::move(connection), name);
  TRY(cursor->read());
  return cursor;
}

Result<bool> forget_sink(const std::string& path, const std::string& name) {
  if (!is_there(whole(path))) return tl::unexpected(nothing_there(whole(path)));
  TRY_LET(const auto lock, WriterLock::take_sink(whole(path), name));
  TRY_LET(const auto connection, open_store(whole(path)));
  Statement forget(*connection, "DELETE FROM sink WHERE name = ?1");
  forget.run(name);
  TRY(connection->outcome());
  return sqlite3_changes(connection->handle()) > 0;
}

}  // namespace spindle::store
