#include "store/connection.hpp"

#include <fmt/format.h>

#include <utility>

namespace spindle::store {
namespace {

/// The part of an answer that says what kind of failure it is.
int kind_of(int answer) { return answer & 0xFF; }

Errc code_of(int answer) {
  switch (kind_of(answer)) {
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return Errc::bad_file;
    case SQLITE_FULL:
    case SQLITE_IOERR:
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_PROTOCOL:
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_NOLFS:
    case SQLITE_TOOBIG:
    case SQLITE_NOMEM:
      return Errc::storage;
    default:
      return Errc::internal;
  }
}

/// What is wrong, and what would help.
std::pair<std::string_view, std::string_view> words_for(int answer) {
  switch (kind_of(answer)) {
    case SQLITE_CORRUPT:
      return {"is damaged", "put the file aside and go on with a backup of it, or a new one"};
    case SQLITE_NOTADB:
      return {"is no store", "give the path of a store, or of a file that is not there yet"};
    case SQLITE_FULL:
      return {"the disk is full", "make room on it"};
    case SQLITE_IOERR:
      return {"the disk failed", "check the disk, and the system's log of it"};
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_PROTOCOL:
      return {"another program has held it for too long", "try again, or end the other program"};
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return {"may not be written", "check the rights of the file and its folder"};
    case SQLITE_CANTOPEN:
      return {"cannot be opened", "check the rights of the file and its folder"};
    case SQLITE_NOMEM:
      return {"there is not enough memory", "end other programs"};
    default:
      return {"failed", ""};
  }
}

Error error_of(int answer, const char* detail, const std::string& path) {
  const auto [what, help] = words_for(answer);
  return {.code = code_of(answer),
          .message = fmt::format("{} ({})", what, detail),
          .hint = std::string(help),
          .name = path};
}

}  // namespace

Result<std::unique_ptr<Connection>> Connection::open(const std::string& name, int flags,
                                                     const std::string& path) {
  sqlite3* handle = nullptr;
  const int answer = sqlite3_open_v2(name.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  // It has to be closed even where it could not be opened.
  auto connection = std::make_unique<Connection>(handle, path);
  if (answer == SQLITE_OK) {
    sqlite3_extended_result_codes(handle, 1);
    sqlite3_busy_timeout(handle, longest_wait_ms);
  }
  connection->judge(answer);
  TRY(connection->outcome());
  return connection;
}

void Connection::run(const std::string& sql) {
  if (failed()) return;
  judge(sqlite3_exec(handle(), sql.c_str(), nullptr, nullptr, nullptr));
}

void Connection::judge(int answer) {
  if (answer == SQLITE_OK || answer == SQLITE_ROW || answer == SQLITE_DONE || failed()) return;
  const char* detail = handle() == nullptr ? sqlite3_errstr(answer) : sqlite3_errmsg(handle());
  failure_ = error_of(answer, detail, path_);
}

Result<void> Connection::outcome() {
  if (!failed()) return {};
  return tl::unexpected(*std::exchange(failure_, std::nullopt));
}

Result<void> Connection::end_transaction() {
  run("COMMIT");
  if (failed()) roll_back();
  return outcome();
}

void Connection::roll_back() {
  // Some failures end a transaction by themselves.
  if (sqlite3_get_autocommit(handle()) != 0) return;
  sqlite3_exec(handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

bool Rows::next() {
  if (connection_.failed()) return false;
  const int answer = sqlite3_step(statement_);
  connection_.judge(answer);
  return answer == SQLITE_ROW;
}

std::string_view Rows::text(int column) const {
  const unsigned char* text = sqlite3_column_text(statement_, column);
  if (text == nullptr) return {};
  return {reinterpret_cast<const char*>(text),
          static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
}

ByteView Rows::bytes(int column) const {
  const void* bytes = sqlite3_column_blob(statement_, column);
  if (bytes == nullptr) return {};
  return {static_cast<const std::uint8_t*>(bytes),
          static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
}

Statement::Statement(Connection& connection, std::string_view sql) : connection_(connection) {
  if (connection.failed()) return;
  sqlite3_stmt* statement = nullptr;
  connection.judge(sqlite3_prepare_v3(connection.handle(), sql.data(), static_cast<int>(sql.size()),
                                      SQLITE_PREPARE_PERSISTENT, &statement, nullptr));
  statement_.reset(statement);
}

void Statement::bind(int place, std::string_view value) {
  // The null pointer of an empty view would be NULL.
  const char* text = value.data() == nullptr ? "" : value.data();
  connection_.judge(
      sqlite3_bind_text64(statement_.get(), place, text, value.size(), nullptr, SQLITE_UTF8));
}

void Statement::bind(int place, ByteView value) {
  if (value.empty()) {
    connection_.judge(sqlite3_bind_zeroblob(statement_.get(), place, 0));
    return;
  }
  connection_.judge(
      sqlite3_bind_blob64(statement_.get(), place, value.data(), value.size(), nullptr));
}

}  // namespace spindle::store
