#pragma once

#include <libpq-fe.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "postgres_address.hpp"
#include "postgres_errors.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"
#include "spindle/base/interrupt.hpp"

namespace spindle::forward {

/// What a statement returned.
class PostgresRows {
 public:
  explicit PostgresRows(PGresult* result) : result_(result) {}

  [[nodiscard]] int size() const { return ::PQntuples(result_.get()); }
  /// Empty for NULL.
  [[nodiscard]] std::optional<std::string> text(int row, int column) const {
    if (::PQgetisnull(result_.get(), row, column) != 0) return std::nullopt;
    return std::string(::PQgetvalue(result_.get(), row, column));
  }
  [[nodiscard]] bool truth(int row, int column) const { return text(row, column) == "t"; }

 private:
  struct Clear {
    void operator()(PGresult* result) const { ::PQclear(result); }
  };
  std::unique_ptr<PGresult, Clear> result_;
};

/// What a server says against a statement.
struct PostgresRefusal {
  std::string state = {};  ///< five characters of SQLSTATE; empty: it was no server that said it
  Error error = {};

  /// Whether it is about the values of a row and not about the statement: SQLSTATE classes 22 and
  /// 23.
  [[nodiscard]] bool is_about_row() const {
    return state.starts_with("22") || state.starts_with("23");
  }
};

/// Parameters as text; empty: NULL.
using PostgresValues = std::vector<std::optional<std::string>>;

/// One session with a server. No wait lasts beyond its deadline or behind an interrupt, whatever
/// the server does. Not usable any more behind an error that is no refusal. One thread.
class PostgresConnection {
 public:
  /// Errors by what failed: name_not_found, connection_refused, no_route, connect_timeout
  /// (unreachable), exception_response (authentication refused), mismatch (it is not the server
  /// that it should be), bad_file (of TLS), no_answer, closed.
  static Result<PostgresConnection> open(const PostgresAddress& address, Duration limit,
                                         Clock& clock, const Interrupt& interrupt);

  /// One statement.
  tl::expected<PostgresRows, PostgresRefusal> ask(const char* statement,
                                                  const PostgresValues& values, TimePoint deadline);

  /// Nothing is asked: waits so long and says when the server ended the session. Without an error
  /// at an interrupt.
  Result<void> listen(TimePoint deadline);

 private:
  struct Finish {
    void operator()(PGconn* connection) const { ::PQfinish(connection); }
  };
  using Handle = std::unique_ptr<PGconn, Finish>;

  PostgresConnection(Handle handle, Clock& clock, const Interrupt& interrupt)
      : handle_(std::move(handle)), clock_(&clock), interrupt_(&interrupt) {}

  Result<void> establish(const PostgresAddress& address, TimePoint deadline);
  Result<void> flush(TimePoint deadline);
  Result<PGresult*> take_result(TimePoint deadline);
  /// Whether it became so before the deadline. Error: an interrupt.
  Result<bool> wait_for(short events, TimePoint deadline);
  [[nodiscard]] Error broken() const;

  Handle handle_;
  Clock* clock_;
  const Interrupt* interrupt_;
};

}  // namespace spindle::forward
