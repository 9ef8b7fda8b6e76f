#include "postgres_tables.hpp"

#include <fmt/format.h>

#include <map>
#include <set>
#include <utility>

#include "postgres_batch.hpp"
#include "postgres_schema.hpp"

namespace spindle::forward {
namespace {

constexpr const char* ask_columns = R"(
SELECT wanted.relation, wanted.name, to_regclass(wanted.relation) IS NOT NULL,
  format_type(found.atttypid, found.atttypmod)
FROM unnest($1::text[], $2::text[]) AS wanted (relation, name)
LEFT JOIN pg_attribute AS found ON found.attrelid = to_regclass(wanted.relation)
  AND found.attname = wanted.name AND found.attnum > 0 AND NOT found.attisdropped)";

// Columns that a table has beyond ours and that cannot be left empty.
constexpr const char* ask_strangers = R"(
SELECT wanted.relation, found.attname
FROM unnest($1::text[]) AS wanted (relation)
JOIN pg_attribute AS found ON found.attrelid = to_regclass(wanted.relation)
WHERE found.attnum > 0 AND NOT found.attisdropped AND found.attnotnull AND NOT found.atthasdef
  AND found.attidentity = '')";

constexpr const char* ask_keys = R"(
SELECT wanted.relation, has_table_privilege(to_regclass(wanted.relation), 'INSERT'),
  has_table_privilege(to_regclass(wanted.relation), 'SELECT'),
  EXISTS (SELECT FROM pg_index AS key WHERE key.indrelid = to_regclass(wanted.relation)
    AND key.indisunique AND key.indisvalid AND key.indpred IS NULL
    AND (wanted.columns = '' OR wanted.columns = (
      SELECT string_agg(part.attname, ',' ORDER BY part.attname COLLATE "C")
      FROM pg_attribute AS part
      WHERE part.attrelid = key.indrelid AND part.attnum = ANY (key.indkey))))
FROM unnest($1::text[], $2::text[]) AS wanted (relation, columns))";

constexpr std::string_view schema_hint =
    "'spindle forward SINK --print-schema' prints the tables as they have to be";

Result<PostgresRows> answer(PostgresConnection& connection, const char* statement,
                            const PostgresValues& values, TimePoint deadline) {
  auto rows = connection.ask(statement, values, deadline);
  if (!rows) return tl::unexpected(std::move(rows.error().error));
  return std::move(*rows);
}

Result<void> check_columns(PostgresConnection& connection, TimePoint deadline) {
  PostgresArray tables;
  PostgresArray names;
  for (const WantedColumn& column : wanted_columns()) {
    tables.add(column.table);
    names.add(column.name);
  }
  TRY_LET(const auto rows, answer(connection, ask_columns,
                                  {std::move(tables).take(), std::move(names).take()}, deadline));
  std::map<std::pair<std::string, std::string>, FoundColumn> found;
  for (int row = 0; row < rows.size(); ++row) {
    found[{rows.text(row, 0).value_or(""), rows.text(row, 1).value_or("")}] = {
        .has_table = rows.truth(row, 2), .type = rows.text(row, 3)};
  }
  for (const WantedColumn& column : wanted_columns()) {
    auto fault = fault_of(column, found[{std::string(column.table), std::string(column.name)}]);
    if (fault) return tl::unexpected(std::move(*fault));
  }
  return {};
}

Result<void> check_strangers(PostgresConnection& connection, TimePoint deadline) {
  PostgresArray tables;
  for (const WantedKey& key : wanted_keys()) tables.add(key.table);
  TRY_LET(const auto rows, answer(connection, ask_strangers, {std::move(tables).take()}, deadline));
  std::set<std::pair<std::string, std::string>> ours;
  for (const WantedColumn& column : wanted_columns()) {
    ours.emplace(std::string(column.table), std::string(column.name));
  }
  for (int row = 0; row < rows.size(); ++row) {
    const std::pair<std::string, std::string> one = {rows.text(row, 0).value_or(""),
                                                     rows.text(row, 1).value_or("")};
    if (ours.contains(one)) continue;
    return tl::unexpected(
        Error{.code = Errc::mismatch,
              .message = fmt::format("column {} of table {} is not known here, and has neither a "
                                     "default nor may it be NULL",
                                     one.second, one.first),
              .hint = "give it a default"});
  }
  return {};
}

Result<void> check_keys(PostgresConnection& connection, TimePoint deadline) {
  PostgresArray tables;
  PostgresArray columns;
  for (const WantedKey& key : wanted_keys()) {
    tables.add(key.table);
    columns.add(key.columns);
  }
  TRY_LET(const auto rows, answer(connection, ask_keys,
                                  {std::move(tables).take(), std::move(columns).take()}, deadline));
  for (int row = 0; row < rows.size(); ++row) {
    const std::string table = rows.text(row, 0).value_or("");
    if (!rows.truth(row, 1) || !rows.truth(row, 2)) {
      return tl::unexpected(
          Error{.code = Errc::exception_response,
                .message = fmt::format("this role may not {} table {}",
                                       rows.truth(row, 2) ? "insert into" : "read", table),
                .hint = "GRANT spindle_writer to it; --print-schema makes that role"});
    }
    if (!rows.truth(row, 3)) {
      return tl::unexpected(
          Error{.code = Errc::mismatch,
                .message = fmt::format("table {} has no primary or unique key of its rows: what is "
                                       "sent twice would be there twice",
                                       table),
                .hint = std::string(schema_hint)});
    }
  }
  return {};
}

/// COMMIT has to mean that it is kept: a server may be set to answer before that.
Result<void> make_durable(PostgresConnection& connection, TimePoint deadline) {
  TRY_LET(const auto rows, answer(connection, "SHOW synchronous_commit", {}, deadline));
  if (rows.size() == 1 && rows.text(0, 0) != "off") return {};
  TRY(answer(connection, "SET synchronous_commit = on", {}, deadline));
  return {};
}

}  // namespace

Result<void> prepare_session(PostgresConnection& connection, TimePoint deadline) {
  TRY(make_durable(connection, deadline));
  TRY(check_columns(connection, deadline));
  TRY(check_strangers(connection, deadline));
  return check_keys(connection, deadline);
}

}  // namespace spindle::forward
