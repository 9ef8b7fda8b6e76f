#include "postgres_connection.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

namespace spindle::forward {
namespace {

/// So that a signal without a descriptor of its own is seen, too.
constexpr Duration longest_wait = std::chrono::seconds(1);

int milliseconds_until(TimePoint deadline, TimePoint now) {
  const Duration left = std::clamp(Duration(deadline - now), Duration::zero(), longest_wait);
  return static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count());
}

Error silent(Duration waited) {
  return {.code = Errc::no_answer,
          .message = "the database is connected, but does not answer",
          .hint = "is the server overloaded, stopped or cut off? it is tried again",
          .waited = waited};
}

Error not_in_time(const PostgresAddress& address, bool is_met) {
  if (is_met) {
    return {.code = Errc::no_answer,
            .message = address.shown + ": connected, but the database does not greet",
            .hint = "is the server overloaded, or is it no PostgreSQL?"};
  }
  return {.code = Errc::connect_timeout,
          .message = address.shown + ": no connection to the database in time",
          .hint = "the server may be down, or a firewall between"};
}

/// What libpq wants to wait for.
short events_of(PostgresPollingStatusType wanted) {
  return wanted == PGRES_POLLING_READING ? POLLIN : POLLOUT;
}

std::string field_of(const PGresult* result, int field) {
  const char* text = ::PQresultErrorField(result, field);
  return text == nullptr ? std::string() : std::string(text);
}

void ignore_notice(void*, const PGresult*) {}

}  // namespace

Result<PostgresConnection> PostgresConnection::open(const PostgresAddress& address, Duration limit,
                                                    Clock& clock, const Interrupt& interrupt) {
  if (interrupt.raised()) return tl::unexpected(interrupt.error());
  std::vector<const char*> keys;
  std::vector<const char*> values;
  for (const auto& [key, value] : address.words) {
    keys.push_back(key.c_str());
    values.push_back(value.c_str());
  }
  keys.push_back(nullptr);
  values.push_back(nullptr);
  const TimePoint deadline = clock.now() + limit * static_cast<int>(address.hosts);
  PostgresConnection connection(Handle(::PQconnectStartParams(keys.data(), values.data(), 0)),
                                clock, interrupt);
  TRY(connection.establish(address, deadline));
  return connection;
}

Result<void> PostgresConnection::establish(const PostgresAddress& address, TimePoint deadline) {
  PGconn* const raw = handle_.get();
  const auto failed = [&] {
    Error error = connection_error(raw == nullptr ? "" : ::PQerrorMessage(raw));
    if (error.message.find(" at \"") == std::string::npos) {
      error.message = fmt::format("{}: {}", address.shown, error.message);
    }
    return tl::unexpected(std::move(error));
  };
  if (raw == nullptr || ::PQstatus(raw) == CONNECTION_BAD) return failed();
  ::PQsetErrorVerbosity(raw, PQERRORS_VERBOSE);
  ::PQsetNoticeReceiver(raw, ignore_notice, nullptr);
  for (PostgresPollingStatusType wanted = PGRES_POLLING_WRITING; wanted != PGRES_POLLING_OK;) {
    if (wanted == PGRES_POLLING_FAILED) return failed();
    TRY_LET(const bool ready, wait_for(events_of(wanted), deadline));
    if (!ready) {
      return tl::unexpected(not_in_time(address, ::PQstatus(raw) != CONNECTION_STARTED));
    }
    wanted = ::PQconnectPoll(raw);
  }
  ::PQsetnonblocking(raw, 1);
  return {};
}

Result<bool> PostgresConnection::wait_for(short events, TimePoint deadline) {
  for (;;) {
    if (interrupt_->raised()) return tl::unexpected(interrupt_->error());
    const TimePoint now = clock_->now();
    if (now >= deadline) return false;
    std::array<pollfd, 2> waited = {
        pollfd{.fd = ::PQsocket(handle_.get()), .events = events, .revents = 0},
        pollfd{.fd = interrupt_->descriptor(), .events = POLLIN, .revents = 0}};
    ::poll(waited.data(), waited.size(), milliseconds_until(deadline, now));
    if (waited[0].revents != 0 && !interrupt_->raised()) return true;
  }
}

Error PostgresConnection::broken() const {
  Error error = connection_error(::PQerrorMessage(handle_.get()));
  if (error.code == Errc::exception_response) error.code = Errc::closed;
  return error;
}

Result<void> PostgresConnection::flush(TimePoint deadline) {
  const TimePoint began = clock_->now();
  for (;;) {
    const int left = ::PQflush(handle_.get());
    if (left == 0) return {};
    if (left < 0) return tl::unexpected(broken());
    // A server that is busy telling something takes nothing before that is read.
    TRY_LET(const bool ready, wait_for(POLLIN | POLLOUT, deadline));
    if (!ready) return tl::unexpected(silent(clock_->now() - began));
    if (::PQconsumeInput(handle_.get()) == 0) return tl::unexpected(broken());
  }
}

/// Null behind the last one.
Result<PGresult*> PostgresConnection::take_result(TimePoint deadline) {
  const TimePoint began = clock_->now();
  while (::PQisBusy(handle_.get()) != 0) {
    TRY_LET(const bool ready, wait_for(POLLIN, deadline));
    if (!ready) return tl::unexpected(silent(clock_->now() - began));
    if (::PQconsumeInput(handle_.get()) == 0) return tl::unexpected(broken());
  }
  return ::PQgetResult(handle_.get());
}

tl::expected<PostgresRows, PostgresRefusal> PostgresConnection::ask(const char* statement,
                                                                    const PostgresValues& values,
                                                                    TimePoint deadline) {
  const auto failed = [](Error error) {
    return tl::unexpected(PostgresRefusal{.error = std::move(error)});
  };
  std::vector<const char*> texts;
  texts.reserve(values.size());
  for (const auto& value : values) texts.push_back(value ? value->c_str() : nullptr);
  if (::PQsendQueryParams(handle_.get(), statement, static_cast<int>(texts.size()), nullptr,
                          texts.data(), nullptr, nullptr, 0) == 0) {
    return failed(broken());
  }
  auto flushed = flush(deadline);
  if (!flushed) return failed(std::move(flushed.error()));
  auto first = take_result(deadline);
  if (!first) return failed(std::move(first.error()));
  PostgresRows rows(*first);
  for (auto more = first; more && *more != nullptr;) {
    more = take_result(deadline);
    if (!more) return failed(std::move(more.error()));
    ::PQclear(*more);
  }
  const ExecStatusType status = ::PQresultStatus(*first);
  if (status == PGRES_TUPLES_OK || status == PGRES_COMMAND_OK) return rows;
  const std::string state = field_of(*first, PG_DIAG_SQLSTATE);
  if (state.empty() || ::PQstatus(handle_.get()) == CONNECTION_BAD) return failed(broken());
  return tl::unexpected(PostgresRefusal{
      .state = state, .error = statement_error(state, field_of(*first, PG_DIAG_MESSAGE_PRIMARY))});
}

Result<void> PostgresConnection::listen(TimePoint deadline) {
  for (;;) {
    const auto ready = wait_for(POLLIN, deadline);
    if (!ready || !*ready) return {};
    if (::PQconsumeInput(handle_.get()) == 0) return tl::unexpected(broken());
    // What is heard without a question is a notice or the reason of an end.
    if (::PQisBusy(handle_.get()) == 0 && ::PQstatus(handle_.get()) == CONNECTION_BAD) {
      return tl::unexpected(broken());
    }
  }
}

}  // namespace spindle::forward
