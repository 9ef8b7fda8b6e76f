#include "spindle/store/reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>

#include "store/columns.hpp"
#include "store/connection.hpp"
#include "store/coverage.hpp"
#include "store/folder.hpp"
#include "store/integrity.hpp"
#include "store/last_events.hpp"
#include "store/schema.hpp"

namespace spindle::store {
namespace {

/// The WHERE clause of a filter, and the rows that it lets through in the order of the store.
class Selection {
 public:
  Selection(std::string_view columns, std::string_view table) : columns_(columns), table_(table) {}

  void require(std::string condition) { conditions_.push_back(std::move(condition)); }

  void require_one_of(std::string_view column, const std::vector<RowId>& ids) {
    if (!ids.empty()) require(fmt::format("{} IN ({})", column, fmt::join(ids, ", ")));
  }

  void require_one_of(std::string_view column, const std::vector<std::string>& texts) {
    if (texts.empty()) return;
    std::string values;
    for (const std::string& text : texts) {
      texts_.push_back(&text);
      values += fmt::format("{}?{}", values.empty() ? "" : ", ", texts_.size());
    }
    require(fmt::format("{} IN ({})", column, values));
  }

  Statement statement(Connection& connection, const Filter& filter) const {
    std::string sql = fmt::format("SELECT {} FROM {}", columns_, table_);
    std::string_view separator = " WHERE ";
    for (const std::string& condition : conditions_) {
      sql += fmt::format("{}({})", std::exchange(separator, " AND "), condition);
    }
    sql = filter.newest ? fmt::format("SELECT * FROM ({} ORDER BY id DESC LIMIT {}) ORDER BY id",
                                      sql, *filter.newest)
                        : sql + " ORDER BY id";
    Statement statement(connection, sql);
    int place = 0;
    for (const std::string* text : texts_) statement.bind(++place, *text);
    return statement;
  }

 private:
  std::string_view columns_;
  std::string_view table_;
  std::vector<std::string> conditions_ = {};
  std::vector<const std::string*> texts_ = {};
};

std::int64_t milliseconds(WallTime time) { return time.time_since_epoch().count(); }

constexpr int first_value = 12;  ///< column of a query for events from which on Columns stand

std::vector<Column> columns_of(const Filter& filter) {
  if (filter.columns) return *filter.columns;
  std::vector<Column> all;
  for (const auto& [word, column] : column_words) all.push_back(column);
  return all;
}

std::string event_names(const Filter& filter) {
  std::string names =
      fmt::format("id, tool, place, epoch, number, at, tool_time, source, kind, remembered, {}",
                  filter.columns ? "NULL, NULL" : "barcode, raw");
  for (const Column column : columns_of(filter)) {
    names += fmt::format(", {}", column_words.text(column));
  }
  return names;
}

Statement event_query(Connection& connection, const Filter& filter) {
  const std::string names = event_names(filter);
  Selection selection(names, "event");
  selection.require_one_of("tool", filter.tools);
  selection.require_one_of("place", filter.places);
  if (filter.since) selection.require(fmt::format("at >= {}", milliseconds(*filter.since)));
  if (filter.until) selection.require(fmt::format("at < {}", milliseconds(*filter.until)));
  if (filter.preset) selection.require(fmt::format("preset = {}", *filter.preset));
  selection.require_one_of("kind", filter.kinds);
  if (filter.epoch) selection.require(fmt::format("epoch = {}", *filter.epoch));
  if (filter.number) selection.require(fmt::format("number = {}", *filter.number));
  if (filter.after != 0) selection.require(fmt::format("id > {}", filter.after));
  return selection.statement(connection, filter);
}

void read_event(const Rows& rows, const std::vector<Column>& columns, EventView& event) {
  event.id = rows.integer(0);
  event.tool = rows.integer(1);
  event.place = rows.integer(2);
  event.epoch = rows.integer(3);
  event.number = static_cast<std::uint16_t>(rows.integer(4));
  event.at = rows.time(5);
  event.tool_time = rows.maybe_time(6);
  event.source = rows.text(7);
  event.kind = rows.text(8);
  event.remembered = rows.integer(9) != 0;
  event.barcode = rows.text(10);
  event.raw = rows.bytes(11);
  int place = first_value;
  for (const Column column : columns) event.columns[column] = rows.maybe(place++);
}

Statement gap_query(Connection& connection, const Filter& filter) {
  Selection selection("id, tool, epoch, after, before, missed, at_least, began, ended, reason",
                      "gap");
  selection.require_one_of("tool", filter.tools);
  if (filter.since) selection.require(fmt::format("ended >= {}", milliseconds(*filter.since)));
  if (filter.until) selection.require(fmt::format("began < {}", milliseconds(*filter.until)));
  if (filter.epoch) selection.require(fmt::format("epoch = {}", *filter.epoch));
  if (filter.after != 0) selection.require(fmt::format("id > {}", filter.after));
  return selection.statement(connection, filter);
}

template <typename Number>
std::optional<Number> maybe_number(const Rows& rows, int column) {
  const auto value = rows.maybe(column);
  if (!value) return std::nullopt;
  return static_cast<Number>(*value);
}

Gap read_gap(const Rows& rows) {
  return {.id = rows.integer(0),
          .tool = rows.integer(1),
          .epoch = rows.integer(2),
          .after = maybe_number<std::uint16_t>(rows, 3),
          .before = maybe_number<std::uint16_t>(rows, 4),
          .missed = maybe_number<std::uint32_t>(rows, 5),
          .at_least = rows.integer(6) != 0,
          .began = rows.time(7),
          .ended = rows.time(8),
          .reason = std::string(rows.text(9))};
}

constexpr std::string_view curve_query =
    "SELECT curve.event, epoch, at, interval_us, channels, samples FROM curve "
    "JOIN event ON event.id = curve.event ";

Curve read_curve(const Rows& rows) {
  const ByteView samples = rows.bytes(5);
  return {.event = rows.integer(0),
          .epoch = rows.integer(1),
          .at = rows.time(2),
          .interval_us = rows.integer(3),
          .channels = std::string(rows.text(4)),
          .samples = Bytes(samples.begin(), samples.end())};
}

Statement happening_query(Connection& connection, const Filter& filter) {
  Selection selection("id, tool, at, type, json", "happening");
  selection.require_one_of("tool", filter.tools);
  if (filter.since) selection.require(fmt::format("at >= {}", milliseconds(*filter.since)));
  if (filter.until) selection.require(fmt::format("at < {}", milliseconds(*filter.until)));
  selection.require_one_of("type", filter.kinds);
  if (filter.after != 0) selection.require(fmt::format("id > {}", filter.after));
  return selection.statement(connection, filter);
}

Place read_place(const Rows& rows) {
  return {.id = rows.integer(0),
          .tool = rows.integer(1),
          .name = std::string(rows.text(2)),
          .url = std::string(rows.text(3)),
          .profile = std::string(rows.text(4)),
          .firmware = maybe_number<std::uint32_t>(rows, 5),
          .torque_unit = std::string(rows.text(6)),
          .since = rows.time(7),
          .seen = rows.maybe_time(8),
          .fence = rows.maybe(9)};
}

template <typename Read>
using ListOf = std::vector<std::invoke_result_t<const Read&, const Rows&>>;

template <typename Read>
Result<ListOf<Read>> all_of(Connection& connection, Statement& statement, const Read& read) {
  ListOf<Read> all;
  {
    Rows rows = statement.rows();
    while (rows.next()) all.push_back(read(rows));
  }
  TRY(connection.outcome());
  return all;
}

template <typename Read>
Result<ListOf<Read>> all_of(Connection& connection, std::string_view sql, const Read& read) {
  Statement statement(connection, sql);
  return all_of(connection, statement, read);
}

class FileReader : public Reader {
 public:
  explicit FileReader(std::unique_ptr<Connection> connection)
      : connection_(std::move(connection)) {}

  Result<std::vector<Tool>> tools() override {
    return all_of(*connection_, "SELECT id, maker, serial, model FROM tool ORDER BY id",
                  [](const Rows& rows) {
                    return Tool{.id = rows.integer(0),
                                .name = {.maker = std::string(rows.text(1)),
                                         .serial = std::string(rows.text(2))},
                                .model = std::string(rows.text(3))};
                  });
  }

  Result<std::vector<Place>> places() override;

  Result<std::vector<Epoch>> epochs() override {
    return all_of(*connection_,
                  "SELECT tool, ordinal, began, reason FROM epoch ORDER BY tool, ordinal",
                  [](const Rows& rows) {
                    const auto reason = epoch_reason_words.find(rows.text(3));
                    return Epoch{.tool = rows.integer(0),
                                 .ordinal = rows.integer(1),
                                 .began = rows.time(2),
                                 .reason = reason.value_or(EpochReason::unsure)};
                  });
  }

  Result<std::vector<PresetSettings>> settings() override {
    return all_of(
        *connection_,
        fmt::format("SELECT tool, preset, since, {} FROM preset ORDER BY tool, preset, since",
                    names_of(setting_words)),
        [](const Rows& rows) {
          PresetSettings settings = {
              .tool = rows.integer(0), .preset = rows.integer(1), .since = rows.time(2)};
          int place = 3;
          for (const auto& [word, setting] : setting_words) {
            settings[setting] = rows.maybe(place++);
          }
          return settings;
        });
  }

  Result<void> events(const Filter& filter,
                      const std::function<bool(const EventView&)>& take) override {
    const std::vector<Column> columns = columns_of(filter);
    Statement statement = event_query(*connection_, filter);
    {
      Rows rows = statement.rows();
      EventView event;
      while (rows.next()) {
        read_event(rows, columns, event);
        if (!take(event)) break;
      }
    }
    return connection_->outcome();
  }

  Result<std::optional<Curve>> curve(RowId event) override {
    std::optional<Curve> found;
    Statement statement(*connection_, fmt::format("{}WHERE curve.event = ?1", curve_query));
    {
      Rows rows = statement.query(event);
      if (rows.next()) found = read_curve(rows);
    }
    TRY(connection_->outcome());
    return found;
  }

  Result<void> curves(RowId after, const std::function<bool(const Curve&)>& take) override {
    Statement statement(*connection_,
                        fmt::format("{}WHERE curve.event > ?1 ORDER BY curve.event", curve_query));
    {
      Rows rows = statement.query(after);
      bool goes_on = true;
      while (goes_on && rows.next()) goes_on = take(read_curve(rows));
    }
    return connection_->outcome();
  }

  Result<std::vector<Gap>> gaps(const Filter& filter) override {
    Statement statement = gap_query(*connection_, filter);
    return all_of(*connection_, statement, read_gap);
  }

  Result<void> happenings(const Filter& filter,
                          const std::function<bool(const Happening&)>& take) override {
    Statement statement = happening_query(*connection_, filter);
    {
      Rows rows = statement.rows();
      while (rows.next()) {
        const Happening happening = {.id = rows.integer(0),
                                     .tool = rows.maybe(1),
                                     .at = rows.time(2),
                                     .type = std::string(rows.text(3)),
                                     .json = std::string(rows.text(4))};
        if (!take(happening)) break;
      }
    }
    return connection_->outcome();
  }

  Result<std::optional<Last>> last(const ToolName& name) override {
    connection_->run("BEGIN");
    std::optional<Last> found;
    {
      Statement find_tool(*connection_, "SELECT id FROM tool WHERE maker = ?1 AND serial = ?2");
      std::optional<RowId> tool;
      {
        Rows rows = find_tool.query(name.maker, name.serial);
        if (rows.next()) tool = rows.integer(0);
      }
      if (tool) found = LastEvents(*connection_).find(*tool);
    }
    TRY(connection_->end_transaction());
    return found;
  }

  Result<RowId> newest() override { return number("SELECT max(id) FROM event"); }

  Result<std::int64_t> state() override { return number("PRAGMA data_version"); }

  Result<Backlog> behind(const Positions& positions) override;
  Result<Positions> ends() override;
  Result<Positions> before(WallTime time) override;
  Result<std::optional<Counted>> counted_before(RowId tool, const Counted& event,
                                                const std::vector<std::string>& kinds) override;
  Result<std::vector<SinkRow>> sinks() override;

  Result<std::uint64_t> bytes() override {
    Statement statement(*connection_,
                        "SELECT page_count * page_size FROM pragma_page_count, pragma_page_size");
    std::uint64_t bytes = 0;
    {
      Rows rows = statement.rows();
      if (rows.next()) bytes = static_cast<std::uint64_t>(rows.integer(0));
    }
    TRY(connection_->outcome());
    return bytes;
  }

  Result<std::vector<Coverage>> coverage() override {
    connection_->run("BEGIN");
    auto found = store::coverage(*connection_);
    TRY(connection_->end_transaction());
    return found;
  }

  Result<std::vector<std::string>> integrity() override {
    connection_->run("BEGIN");
    auto findings = store::integrity(*connection_);
    const auto read = connection_->end_transaction();
    if (!read && read.error().code != Errc::bad_file) return tl::unexpected(read.error());
    // Too damaged to be looked at to the end.
    if (!read) findings.push_back(read.error().message);
    return findings;
  }

  Result<void> backup(const std::string& path) override;

 private:
  Result<Positions> positions_of(Statement& statement) {
    Positions positions;
    {
      Rows rows = statement.rows();
      if (rows.next()) positions = {rows.integer(0), rows.integer(1), rows.integer(2)};
    }
    TRY(connection_->outcome());
    return positions;
  }

  Result<std::int64_t> number(std::string_view sql) {
    Statement statement(*connection_, sql);
    std::int64_t found = 0;
    {
      Rows rows = statement.query();
      if (rows.next()) found = rows.integer(0);
    }
    TRY(connection_->outcome());
    return found;
  }

  std::unique_ptr<Connection> connection_;
};

Result<Backlog> FileReader::behind(const Positions& positions) {
  Statement statement(*connection_, R"(
    SELECT (SELECT count(*) FROM event WHERE id > ?1), (SELECT count(*) FROM gap WHERE id > ?2),
      (SELECT count(*) FROM happening WHERE id > ?3),
      (SELECT min(at) FROM (SELECT (SELECT at FROM event WHERE id > ?1 ORDER BY id LIMIT 1) AS at
         UNION ALL SELECT (SELECT ended FROM gap WHERE id > ?2 ORDER BY id LIMIT 1))))");
  Backlog backlog;
  {
    Rows rows = statement.query(positions.event, positions.gap, positions.happening);
    if (rows.next()) {
      backlog = {.events = static_cast<std::size_t>(rows.integer(0)),
                 .gaps = static_cast<std::size_t>(rows.integer(1)),
                 .happenings = static_cast<std::size_t>(rows.integer(2)),
                 .oldest = rows.maybe_time(3)};
    }
  }
  TRY(connection_->outcome());
  return backlog;
}

Result<Positions> FileReader::ends() {
  Statement statement(*connection_, R"(
    SELECT (SELECT max(id) FROM event), (SELECT max(id) FROM gap), (SELECT max(id) FROM happening))");
  return positions_of(statement);
}

/// Where nothing is so new, behind everything.
Result<Positions> FileReader::before(WallTime time) {
  Statement statement(*connection_, R"(
    SELECT coalesce((SELECT min(id) - 1 FROM event WHERE at >= ?1), (SELECT max(id) FROM event), 0),
      coalesce((SELECT min(id) - 1 FROM gap WHERE ended >= ?1), (SELECT max(id) FROM gap), 0),
      coalesce((SELECT min(id) - 1 FROM happening WHERE at >= ?1),
               (SELECT max(id) FROM happening), 0))");
  statement.bind(1, time);
  return positions_of(statement);
}

Result<std::optional<Counted>> FileReader::counted_before(RowId tool, const Counted& event,
                                                          const std::vector<std::string>& kinds) {
  std::string places;
  for (std::size_t at = 0; at < kinds.size(); ++at) {
    places += fmt::format("{}?{}", at == 0 ? "" : ", ", at + 4);
  }
  Statement statement(*connection_, fmt::format(R"(
    SELECT epoch, number FROM event
    WHERE tool = ?1 AND (epoch, number) < (?2, ?3) AND kind IN ({})
    ORDER BY epoch DESC, number DESC LIMIT 1)",
                                                places));
  statement.bind(1, tool);
  statement.bind(2, event.epoch);
  statement.bind(3, event.number);
  int place = 4;
  for (const std::string& kind : kinds) statement.bind(place++, kind);
  std::optional<Counted> found;
  {
    Rows rows = statement.rows();
    if (rows.next()) {
      found =
          Counted{.epoch = rows.integer(0), .number = static_cast<std::uint16_t>(rows.integer(1))};
    }
  }
  TRY(connection_->outcome());
  return found;
}

Result<std::vector<Place>> FileReader::places() {
  constexpr std::int64_t first_with_fence = 3;
  TRY_LET(const auto version, number("PRAGMA user_version"));
  return all_of(*connection_,
                fmt::format("SELECT id, tool, name, url, profile, firmware, torque_unit, since, "
                            "seen, {} FROM place ORDER BY id",
                            version < first_with_fence ? "NULL" : "fence"),
                read_place);
}

Result<std::vector<SinkRow>> FileReader::sinks() {
  constexpr std::int64_t first_with_all = 2;
  TRY_LET(const auto version, number("PRAGMA user_version"));
  const std::string_view others = version < first_with_all ? "0, 0" : "gap, happening";
  return all_of(*connection_,
                fmt::format("SELECT name, url, cursor, {}, moved FROM sink ORDER BY name", others),
                [](const Rows& rows) {
                  return SinkRow{.name = std::string(rows.text(0)),
                                 .url = std::string(rows.text(1)),
                                 .positions = {rows.integer(2), rows.integer(3), rows.integer(4)},
                                 .moved = rows.time(5)};
                });
}

/// Copies all pages while no other writer comes between; both ends judge what went wrong.
Result<void> copy_pages(Connection& from, Connection& to) {
  sqlite3_backup* backup = sqlite3_backup_init(to.handle(), "main", from.handle(), "main");
  if (backup == nullptr) {
    to.judge(sqlite3_errcode(to.handle()));
  } else {
    sqlite3_backup_step(backup, -1);
    to.judge(sqlite3_backup_finish(backup));
  }
  return to.outcome();
}

Result<void> FileReader::backup(const std::string& path) {
  TRY(make_own_file(path, Errc::usage));
  TRY_LET(auto copy, Connection::open(path, SQLITE_OPEN_READWRITE, path));
  auto copied = copy_pages(*connection_, *copy);
  copy.reset();
  if (!copied) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
  return copied;
}

Error nothing_there(const std::string& path) {
  return {.code = Errc::bad_file,
          .message = "there is no store",
          .hint = "'spindle record' makes one",
          .name = path};
}

/// Reads the first page, so that what cannot be read is known at once.
Result<std::unique_ptr<Connection>> opened(const std::string& name, int flags,
                                           const std::string& path) {
  auto connection = Connection::open(name, flags, path);
  if (!connection) return connection;
  (*connection)->run("PRAGMA query_only = ON");
  TRY_LET(const auto found, check_open(**connection));
  if (found == Found::nothing) return tl::unexpected(nothing_there(path));
  return connection;
}

/// A reader writes beside the store, too: what was read is marked in memory that is shared through
/// a file, and a write-ahead log that a crash left is gone through. Where the folder is not
/// writable the store itself is complete if it has no such log, and is read as a file that does
/// not change.
Result<std::unique_ptr<Connection>> open_for_reading(const std::string& path) {
  auto connection = opened(path, SQLITE_OPEN_READWRITE, path);
  if (connection || connection.error().code != Errc::storage) return connection;
  if (!is_there(path + "-wal"))
    return opened(unchanging(path), SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, path);
  connection.error().hint =
      "what was stored last has to be read by a user who may write in its folder";
  return connection;
}

}  // namespace

Result<std::unique_ptr<Reader>> Reader::open(const std::string& path) {
  const std::string whole = std::filesystem::absolute(path).lexically_normal().string();
  const auto found = examine(whole);
  if (!found) return tl::unexpected(found.error());
  if (!is_there(whole)) return tl::unexpected(nothing_there(whole));
  TRY_LET(auto connection, open_for_reading(whole));
  return std::make_unique<FileReader>(std::move(connection));
}

}  // namespace spindle::store
