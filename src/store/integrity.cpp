#include "store/integrity.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>

namespace spindle::store {
namespace {

/// What is wrong, said of rows that a query finds by their id.
struct Rule {
  std::string_view fault;
  std::string_view query;
};

constexpr auto rules = std::to_array<Rule>({
    {"event {}: its bytes are no whole registers", "SELECT id FROM event WHERE length(raw) % 2"},
    {"event {}: it has no bytes", "SELECT id FROM event WHERE length(raw) = 0"},
    {"event {}: it has no kind", "SELECT id FROM event WHERE kind = ''"},
    {"event {}: it has no source", "SELECT id FROM event WHERE source = ''"},
    {"event {}: its place is that of another tool",
     "SELECT event.id FROM event JOIN place ON place.id = event.place "
     "WHERE place.tool <> event.tool"},
    {"event {}: its id was never given",
     "SELECT id FROM event WHERE id > (SELECT seq FROM sqlite_sequence WHERE name = 'event')"},
    {"gap {}: its numbers are none",
     "SELECT id FROM gap WHERE after NOT BETWEEN 0 AND 65535 OR before NOT BETWEEN 0 AND 65535"},
    {"gap {}: it misses nothing", "SELECT id FROM gap WHERE missed <= 0"},
    {"gap {}: the event that ends it is missing",
     "SELECT id FROM gap WHERE before IS NOT NULL AND reason <> 'recorded by another collector' "
     "AND EXISTS (SELECT 1 FROM event WHERE tool = gap.tool AND epoch = gap.epoch "
     "AND number < gap.before) "
     "AND EXISTS (SELECT 1 FROM event WHERE tool = gap.tool AND epoch = gap.epoch "
     "AND number > gap.before) "
     "AND NOT EXISTS (SELECT 1 FROM event WHERE tool = gap.tool AND epoch = gap.epoch "
     "AND number = gap.before)"},
    {"epoch {}: the one before it is missing",
     "SELECT ordinal FROM epoch WHERE ordinal > 0 AND NOT EXISTS (SELECT 1 FROM epoch AS previous "
     "WHERE previous.tool = epoch.tool AND previous.ordinal = epoch.ordinal - 1)"},
    {"epoch {}: it is the first one and does not say so, or says so and is not",
     "SELECT ordinal FROM epoch WHERE (ordinal = 0) <> (reason = 'first')"},
    {"curve of event {}: its bytes are no whole samples",
     "SELECT event FROM curve WHERE length(samples) % 4"},
    {"curve of event {}: what its channels are is no JSON",
     "SELECT event FROM curve WHERE NOT json_valid(channels)"},
    {"place {}: it has no url", "SELECT id FROM place WHERE url = ''"},
});

constexpr int most_findings = 100;  ///< of one rule, as SQLite's own check has it

void check_pages(Connection& connection, std::vector<std::string>& findings) {
  Statement check(connection, "PRAGMA integrity_check");
  Rows rows = check.query();
  while (rows.next()) {
    if (rows.text(0) != "ok") findings.emplace_back(rows.text(0));
  }
}

void check_references(Connection& connection, std::vector<std::string>& findings) {
  Statement check(connection, "PRAGMA foreign_key_check");
  Rows rows = check.query();
  while (rows.next()) {
    findings.push_back(fmt::format("{} {}: what it refers to in {} is missing", rows.text(0),
                                   rows.integer(1), rows.text(2)));
  }
}

void check_rule(Connection& connection, const Rule& rule, std::vector<std::string>& findings) {
  Statement check(connection, fmt::format("{} LIMIT {}", rule.query, most_findings));
  Rows rows = check.query();
  while (rows.next()) findings.push_back(fmt::format(fmt::runtime(rule.fault), rows.integer(0)));
}

}  // namespace

std::vector<std::string> integrity(Connection& connection) {
  std::vector<std::string> findings;
  check_pages(connection, findings);
  check_references(connection, findings);
  for (const Rule& rule : rules) check_rule(connection, rule, findings);
  return findings;
}

}  // namespace spindle::store
