#include "store/last_events.hpp"

#include <algorithm>

namespace spindle::store {
namespace {

Registers registers_of(ByteView bytes) {
  Registers registers;
  for (std::size_t at = 0; at + 1 < bytes.size(); at += 2) registers.push_back(get_u16(bytes, at));
  return registers;
}

}  // namespace

LastEvents::LastEvents(Connection& connection)
    : last_seen_(connection,
                 "SELECT seen FROM place WHERE tool = ?1 AND seen IS NOT NULL "
                 "ORDER BY id DESC LIMIT 1"),
      newest_epoch_(connection,
                    "SELECT ordinal FROM epoch WHERE tool = ?1 ORDER BY ordinal DESC LIMIT 1"),
      last_event_(connection,
                  "SELECT number, at, raw FROM event WHERE tool = ?1 AND epoch = ?2 "
                  "ORDER BY number DESC LIMIT 1"),
      last_gap_(connection, "SELECT max(before) FROM gap WHERE tool = ?1 AND epoch = ?2") {}

std::optional<Last> LastEvents::find(RowId tool) {
  const auto epoch = newest_epoch(tool);
  if (!epoch) return std::nullopt;
  Last last = {.epoch = *epoch};
  bool is_known = false;
  {
    Rows rows = last_event_.query(tool, *epoch);
    if (rows.next()) {
      is_known = true;
      last.number = static_cast<std::uint16_t>(rows.integer(0));
      last.seen = rows.time(1);
      last.block = registers_of(rows.bytes(2));
    }
  }
  {
    Rows rows = last_gap_.query(tool, *epoch);
    const auto before = rows.next() ? rows.maybe(0) : std::nullopt;
    if (before && *before > 0 && (!is_known || *before - 1 > last.number)) {
      is_known = true;
      last.number = static_cast<std::uint16_t>(*before - 1);
      last.block = std::nullopt;
    }
  }
  Rows rows = last_seen_.query(tool);
  if (rows.next()) last.seen = std::max(last.seen, rows.time(0));
  if (!is_known) return std::nullopt;
  return last;
}

std::optional<std::int64_t> LastEvents::newest_epoch(RowId tool) {
  Rows rows = newest_epoch_.query(tool);
  if (!rows.next()) return std::nullopt;
  return rows.integer(0);
}

}  // namespace spindle::store
