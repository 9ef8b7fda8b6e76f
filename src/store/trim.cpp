#include "store/trim.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "spindle/base/duration.hpp"

namespace spindle::store {
namespace {

/// What goes of one tool: its events up to `until`, but for `last`.
struct Cut {
  RowId tool = 0;
  RowId until = 0;
  RowId last = 0;
};

/// A tool's events go in the order of the store. One that looks older than one before it was
/// stored with a clock that was wrong, and stays until that one goes; one from the future says
/// nothing of when it was.
std::vector<Cut> cuts(Connection& connection, WallTime before, WallTime now) {
  Statement tools(connection, R"(
    SELECT id,
      (SELECT max(id) FROM event WHERE tool = tool.id AND at < ?1),
      (SELECT min(id) FROM event WHERE tool = tool.id AND at >= ?1 AND at <= ?2),
      (SELECT id FROM event WHERE tool = tool.id ORDER BY epoch DESC, number DESC LIMIT 1)
    FROM tool)");
  std::vector<Cut> cuts;
  Rows rows = tools.query(before, now);
  while (rows.next()) {
    const auto newest_old = rows.maybe(1);
    if (!newest_old) continue;
    const auto first_kept = rows.maybe(2);
    const RowId until = first_kept ? std::min(*newest_old, *first_kept - 1) : *newest_old;
    cuts.push_back({.tool = rows.integer(0), .until = until, .last = rows.integer(3)});
  }
  return cuts;
}

/// The newest event that goes; 0: none does.
RowId newest_of(Connection& connection, const std::vector<Cut>& cuts) {
  Statement newest(connection,
                   "SELECT max(id) FROM event WHERE tool = ?1 AND id <= ?2 AND id <> ?3");
  RowId found = 0;
  for (const Cut& cut : cuts) {
    Rows rows = newest.query(cut.tool, cut.until, cut.last);
    if (rows.next()) found = std::max(found, rows.integer(0));
  }
  return found;
}

/// What goes is at most these.
struct Newest {
  RowId event = 0;
  RowId gap = 0;
  RowId happening = 0;
};

Result<void> check_sinks(Connection& connection, const Newest& newest) {
  Statement sinks(connection,
                  "SELECT name FROM sink WHERE cursor < ?1 OR gap < ?2 OR happening < ?3 "
                  "ORDER BY cursor LIMIT 1");
  Rows rows = sinks.query(newest.event, newest.gap, newest.happening);
  if (!rows.next()) return {};
  return tl::unexpected(Error{
      .code = Errc::usage,
      .message = fmt::format("sink '{}' has not got all that is older", rows.text(0)),
      .hint = fmt::format("let 'spindle forward {0}' deliver it, keep more, or give that sink "
                          "up for ever: 'spindle store forget {0}'",
                          rows.text(0)),
      .name = connection.path()});
}

std::size_t changes(Connection& connection) {
  return connection.failed() ? 0 : static_cast<std::size_t>(sqlite3_changes(connection.handle()));
}

std::size_t delete_events(Connection& connection, const std::vector<Cut>& cuts) {
  Statement events(connection, "DELETE FROM event WHERE tool = ?1 AND id <= ?2 AND id <> ?3");
  std::size_t deleted = 0;
  for (const Cut& cut : cuts) {
    events.run(cut.tool, cut.until, cut.last);
    deleted += changes(connection);
  }
  return deleted;
}

/// A gap stays where an event stays that was numbered before its end, and where it is all that is
/// known of a tool.
constexpr std::string_view gaps_that_go = R"(FROM gap WHERE ended < ?1
      AND EXISTS (SELECT 1 FROM event WHERE tool = gap.tool AND epoch >= gap.epoch)
      AND NOT EXISTS (SELECT 1 FROM event
                      WHERE tool = gap.tool AND epoch = gap.epoch AND number < gap.before))";
constexpr std::string_view happenings_that_go = "FROM happening WHERE at < ?1 AND type <> 'trim'";

RowId newest_of(Connection& connection, std::string_view rows_that_go, WallTime before) {
  Statement newest(connection, fmt::format("SELECT max(id) {}", rows_that_go));
  Rows rows = newest.query(before);
  return rows.next() ? rows.integer(0) : 0;
}

std::size_t delete_rows(Connection& connection, std::string_view rows_that_go, WallTime before) {
  Statement rows(connection, fmt::format("DELETE {}", rows_that_go));
  rows.run(before);
  return changes(connection);
}

void tell(Connection& connection, const Trimmed& trimmed, WallTime before, WallTime now) {
  const std::string json =
      fmt::format(R"({{"schema":"spindle/1","type":"trim","time":"{}","target":null,"before":"{}",)"
                  R"("events":{},"gaps":{},"happenings":{}}})",
                  to_text(now), to_text(before), trimmed.events, trimmed.gaps, trimmed.happenings);
  Statement happening(connection, "INSERT INTO happening (at, type, json) VALUES (?1, 'trim', ?2)");
  happening.run(now, json);
}

}  // namespace

Result<Trimmed> trim(Connection& connection, WallTime before, WallTime now) {
  const std::vector<Cut> what = cuts(connection, before, now);
  Newest newest = {.event = newest_of(connection, what)};
  Trimmed trimmed;
  trimmed.events = delete_events(connection, what);
  newest.gap = newest_of(connection, gaps_that_go, before);
  newest.happening = newest_of(connection, happenings_that_go, before);
  TRY(check_sinks(connection, newest));
  trimmed.gaps = delete_rows(connection, gaps_that_go, before);
  trimmed.happenings = delete_rows(connection, happenings_that_go, before);
  tell(connection, trimmed, before, now);
  return trimmed;
}

}  // namespace spindle::store
