#pragma once

#include <sqlite3.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"

namespace spindle::store {

/// How long one that writes waits for another one.
inline constexpr int longest_wait_ms = 10'000;

/// A connection to a database. The first failure is kept until it is taken; what is asked after it
/// does nothing and finds no rows, so that a transaction is written down without a look at every
/// step and judged at its end.
class Connection {
 public:
  Connection(sqlite3* handle, std::string path) : handle_(handle), path_(std::move(path)) {}

  /// Opens `name`, a path or, with SQLITE_OPEN_URI, a URI; errors name `path`.
  static Result<std::unique_ptr<Connection>> open(const std::string& name, int flags,
                                                  const std::string& path);

  /// Runs statements that take no values and whose rows are not wanted.
  void run(const std::string& sql);

  /// Keeps what SQLite answered, unless it is no failure or another one came first.
  void judge(int answer);

  [[nodiscard]] bool failed() const { return failure_.has_value(); }
  /// Forgets the failure that is returned.
  Result<void> outcome();

  /// Ends the transaction that is open: whole, or not at all where something failed.
  Result<void> end_transaction();
  /// Ends it as if it had never begun; does nothing where none is open.
  void roll_back();

  [[nodiscard]] sqlite3* handle() const { return handle_.get(); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  struct Closer {
    void operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }
  };

  std::unique_ptr<sqlite3, Closer> handle_;
  std::string path_;
  std::optional<Error> failure_ = std::nullopt;
};

/// The rows that a statement finds; ends it when they go.
class Rows {
 public:
  Rows(Connection& connection, sqlite3_stmt* statement)
      : connection_(connection), statement_(statement) {}
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;
  ~Rows() { sqlite3_reset(statement_); }

  /// Goes to the next row; false: there is none.
  bool next();

  [[nodiscard]] std::int64_t integer(int column) const {
    return sqlite3_column_int64(statement_, column);
  }
  [[nodiscard]] std::optional<std::int64_t> maybe(int column) const {
    if (sqlite3_column_type(statement_, column) == SQLITE_NULL) return std::nullopt;
    return integer(column);
  }
  [[nodiscard]] WallTime time(int column) const {
    return WallTime(std::chrono::milliseconds(integer(column)));
  }
  [[nodiscard]] std::optional<WallTime> maybe_time(int column) const {
    if (sqlite3_column_type(statement_, column) == SQLITE_NULL) return std::nullopt;
    return time(column);
  }
  /// Texts and bytes are valid until the next row.
  [[nodiscard]] std::string_view text(int column) const;
  [[nodiscard]] ByteView bytes(int column) const;

 private:
  Connection& connection_;
  sqlite3_stmt* statement_;
};

/// A statement that is kept. Values are given for ?1, ?2 and so on; texts and bytes among them must
/// outlive the rows.
class Statement {
 public:
  Statement(Connection& connection, std::string_view sql);

  template <typename... Values>
  Rows query(const Values&... values) {
    int place = 0;
    (bind(++place, values), ...);
    return {connection_, statement_.get()};
  }

  /// For what finds no rows.
  template <typename... Values>
  void run(const Values&... values) {
    query(values...).next();
  }

  /// One value by its place.
  template <typename Integer>
  requires std::is_integral_v<Integer>
  void bind(int place, Integer value) {
    connection_.judge(
        sqlite3_bind_int64(statement_.get(), place, static_cast<std::int64_t>(value)));
  }
  void bind(int place, WallTime value) { bind(place, value.time_since_epoch().count()); }
  void bind(int place, std::string_view value);
  void bind(int place, const std::string& value) { bind(place, std::string_view(value)); }
  void bind(int place, const char* value) { bind(place, std::string_view(value)); }
  void bind(int place, ByteView value);
  template <typename Value>
  void bind(int place, const std::optional<Value>& value) {
    if (value) {
      bind(place, *value);
    } else {
      connection_.judge(sqlite3_bind_null(statement_.get(), place));
    }
  }

  /// What was bound with bind().
  Rows rows() { return {connection_, statement_.get()}; }

 private:
  struct Finalizer {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };

  Connection& connection_;
  std::unique_ptr<sqlite3_stmt, Finalizer> statement_;
};

}  // namespace spindle::store
