#include "postgres_schema.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdint>

#include "spindle/base/text.hpp"

namespace spindle::forward {
namespace {

constexpr std::string_view schema = R"(-- Tables of a plant's database for what spindle records.
-- As a role that may create roles:  spindle forward SINK --print-schema | psql -d DATABASE
-- (PostgreSQL 12 or newer). spindle itself never makes or changes a table.
\set ON_ERROR_STOP on
BEGIN;

-- One row an event of a tool, named for ever by (maker, serial, epoch, number): by whichever
-- collector and however often it is sent, it is there once.
CREATE TABLE spindle_event (
  maker         text        NOT NULL,
  serial        text        NOT NULL,  -- '@NAME' of a tool that says none of its own
  epoch         integer     NOT NULL,  -- the tool began to count anew
  number        integer     NOT NULL CHECK (number BETWEEN 0 AND 65535),
  seq           bigint      GENERATED ALWAYS AS (epoch::bigint * 65536 + number) STORED,
  at            timestamptz NOT NULL,  -- when the collector heard of it
  tool_time     timestamptz,           -- by the tool's own clock, where it has one
  place         text        NOT NULL,  -- what the collector's tools file calls the tool
  kind          text        NOT NULL,  -- fastening-ok, fastening-ng, ...
  source        text        NOT NULL,  -- push, poll, catch-up
  remembered    boolean     NOT NULL,  -- it stood in the tool when it was found: its age is not known
  preset        bigint,
  target_torque numeric(19,4),         -- torques in torque_unit, exactly as the tool counts them
  torque        numeric(19,4),
  torque_unit   text,
  a1            bigint,                -- angles in degrees
  a2            bigint,
  a3            bigint,
  error         bigint,
  barcode       text,
  payload       jsonb       NOT NULL,  -- the whole event, as 'spindle results --json' tells it
  raw           bytea       NOT NULL,  -- the registers of the tool, two bytes each
  remark        text,                  -- what is not as it was told
  fence         bigint,                -- number of the lease under which it was recorded
  collector     text        NOT NULL,
  collector_id  bigint      NOT NULL,  -- row of the collector's own store
  stored_at     timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (maker, serial, epoch, number)
);
-- For very many rows: end this table with  ) PARTITION BY HASH (serial);  and add
--   CREATE TABLE spindle_event_0 PARTITION OF spindle_event FOR VALUES WITH (MODULUS 4, REMAINDER 0);
-- and so on. It cannot be partitioned by time: its key holds none.
CREATE INDEX spindle_event_at ON spindle_event USING brin (at);
CREATE INDEX spindle_event_barcode ON spindle_event (barcode) WHERE barcode IS NOT NULL;

-- Events that happened, or may have, and that no collector heard of.
CREATE TABLE spindle_gap (
  maker        text        NOT NULL,
  serial       text        NOT NULL,
  epoch        integer     NOT NULL,
  after        integer,                -- the numbers between which they are missing, where known
  before       integer,
  missed       bigint,                 -- NULL: not known how many
  at_least     boolean     NOT NULL,   -- there may be more
  began        timestamptz NOT NULL,
  ended        timestamptz NOT NULL,
  place        text        NOT NULL,
  reason       text        NOT NULL,
  payload      jsonb       NOT NULL,
  remark       text,
  collector    text        NOT NULL,
  collector_id bigint      NOT NULL,
  stored_at    timestamptz NOT NULL DEFAULT now()
);
CREATE UNIQUE INDEX spindle_gap_key ON spindle_gap
  (maker, serial, epoch, coalesce(after, -1), coalesce(before, -1), reason,
   (CASE WHEN after IS NULL OR before IS NULL THEN began ELSE timestamptz '-infinity' END));
CREATE INDEX spindle_gap_ended ON spindle_gap USING brin (ended);

-- What else happened: links, alarms, motors, the collectors' own starts and ends.
CREATE TABLE spindle_happening (
  maker        text,
  serial       text,
  place        text        NOT NULL,
  at           timestamptz NOT NULL,
  type         text        NOT NULL,
  payload      jsonb       NOT NULL,
  remark       text,
  collector    text        NOT NULL,
  collector_id bigint      NOT NULL,
  stored_at    timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (collector, collector_id, at)
);

-- What could not become a row above: an event whose key another event has, or what this database
-- refuses. Look here when spindle says so; nothing is lost, but nothing sorts it out by itself.
CREATE TABLE spindle_conflict (
  key          text        NOT NULL,  -- maker/serial/epoch/number
  what         text        NOT NULL,  -- event, gap, happening
  reason       text        NOT NULL,
  payload      text        NOT NULL,
  raw          bytea       NOT NULL,
  collector    text        NOT NULL,
  collector_id bigint      NOT NULL,
  stored_at    timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (key, raw)
);

-- Which of several collectors holds which tool ('spindle record --lease'). All times are of this
-- server's clock; fence grows by one whenever a tool gets another holder.
CREATE TABLE spindle_lease (
  tool    text        PRIMARY KEY,
  holder  text        NOT NULL,
  fence   bigint      NOT NULL,
  expires timestamptz NOT NULL
);

-- spindle forward needs spindle_writer, spindle record --lease needs spindle_collector.
DO $$
DECLARE
  wanted text;
BEGIN
  FOREACH wanted IN ARRAY ARRAY['spindle_writer', 'spindle_collector', 'spindle_reader'] LOOP
    IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = wanted) THEN
      EXECUTE format('CREATE ROLE %I NOLOGIN', wanted);
    END IF;
  END LOOP;
END
$$;
REVOKE ALL ON spindle_event, spindle_gap, spindle_happening, spindle_conflict, spindle_lease FROM PUBLIC;
GRANT SELECT, INSERT ON spindle_event, spindle_gap, spindle_happening, spindle_conflict TO spindle_writer;
GRANT SELECT ON spindle_event, spindle_gap TO spindle_collector;
GRANT SELECT, INSERT, UPDATE ON spindle_lease TO spindle_collector;
GRANT SELECT ON spindle_event, spindle_gap, spindle_happening, spindle_conflict, spindle_lease TO spindle_reader;

COMMIT;
-- A login for each collector:  CREATE ROLE line1 LOGIN PASSWORD '...' IN ROLE spindle_writer;
)";

constexpr std::string_view time_type = "timestamp with time zone";
constexpr std::string_view torque_type = "numeric(19,4)";

constexpr std::array columns = {
    WantedColumn{"spindle_event", "maker", "text"},
    WantedColumn{"spindle_event", "serial", "text"},
    WantedColumn{"spindle_event", "epoch", "integer"},
    WantedColumn{"spindle_event", "number", "integer"},
    WantedColumn{"spindle_event", "at", time_type},
    WantedColumn{"spindle_event", "tool_time", time_type},
    WantedColumn{"spindle_event", "place", "text"},
    WantedColumn{"spindle_event", "kind", "text"},
    WantedColumn{"spindle_event", "source", "text"},
    WantedColumn{"spindle_event", "remembered", "boolean"},
    WantedColumn{"spindle_event", "preset", "bigint"},
    WantedColumn{"spindle_event", "target_torque", torque_type},
    WantedColumn{"spindle_event", "torque", torque_type},
    WantedColumn{"spindle_event", "torque_unit", "text"},
    WantedColumn{"spindle_event", "a1", "bigint"},
    WantedColumn{"spindle_event", "a2", "bigint"},
    WantedColumn{"spindle_event", "a3", "bigint"},
    WantedColumn{"spindle_event", "error", "bigint"},
    WantedColumn{"spindle_event", "barcode", "text"},
    WantedColumn{"spindle_event", "payload", "jsonb"},
    WantedColumn{"spindle_event", "raw", "bytea"},
    WantedColumn{"spindle_event", "remark", "text"},
    WantedColumn{"spindle_event", "fence", "bigint"},
    WantedColumn{"spindle_event", "collector", "text"},
    WantedColumn{"spindle_event", "collector_id", "bigint"},
    WantedColumn{"spindle_gap", "maker", "text"},
    WantedColumn{"spindle_gap", "serial", "text"},
    WantedColumn{"spindle_gap", "epoch", "integer"},
    WantedColumn{"spindle_gap", "after", "integer"},
    WantedColumn{"spindle_gap", "before", "integer"},
    WantedColumn{"spindle_gap", "missed", "bigint"},
    WantedColumn{"spindle_gap", "at_least", "boolean"},
    WantedColumn{"spindle_gap", "began", time_type},
    WantedColumn{"spindle_gap", "ended", time_type},
    WantedColumn{"spindle_gap", "place", "text"},
    WantedColumn{"spindle_gap", "reason", "text"},
    WantedColumn{"spindle_gap", "payload", "jsonb"},
    WantedColumn{"spindle_gap", "remark", "text"},
    WantedColumn{"spindle_gap", "collector", "text"},
    WantedColumn{"spindle_gap", "collector_id", "bigint"},
    WantedColumn{"spindle_happening", "maker", "text"},
    WantedColumn{"spindle_happening", "serial", "text"},
    WantedColumn{"spindle_happening", "place", "text"},
    WantedColumn{"spindle_happening", "at", time_type},
    WantedColumn{"spindle_happening", "type", "text"},
    WantedColumn{"spindle_happening", "payload", "jsonb"},
    WantedColumn{"spindle_happening", "remark", "text"},
    WantedColumn{"spindle_happening", "collector", "text"},
    WantedColumn{"spindle_happening", "collector_id", "bigint"},
    WantedColumn{"spindle_conflict", "key", "text"},
    WantedColumn{"spindle_conflict", "what", "text"},
    WantedColumn{"spindle_conflict", "reason", "text"},
    WantedColumn{"spindle_conflict", "payload", "text"},
    WantedColumn{"spindle_conflict", "raw", "bytea"},
    WantedColumn{"spindle_conflict", "collector", "text"},
    WantedColumn{"spindle_conflict", "collector_id", "bigint"},
};

constexpr std::array keys = {
    WantedKey{"spindle_event", "epoch,maker,number,serial"},
    WantedKey{"spindle_gap", ""},
    WantedKey{"spindle_happening", "at,collector,collector_id"},
    WantedKey{"spindle_conflict", "key,raw"},
};

/// "numeric(10,4)": digits in all, and behind the point.
bool holds_torque(std::string_view type) {
  if (type == "numeric") return true;
  constexpr std::string_view head = "numeric(";
  if (!type.starts_with(head) || !type.ends_with(')')) return false;
  const auto parts = split(type.substr(head.size(), type.size() - head.size() - 1), ',');
  constexpr std::uint64_t most_digits = 1000;
  const auto digits = parse_unsigned(parts.front(), most_digits);
  const auto decimals = parts.size() == 2 ? parse_unsigned(parts[1], most_digits) : std::nullopt;
  return decimals.value_or(0) >= 4 && digits.value_or(0) >= decimals.value_or(0) + 6;
}

bool holds_milliseconds(std::string_view type) {
  for (const std::string_view good :
       {"timestamp with time zone", "timestamp(3) with time zone", "timestamp(4) with time zone",
        "timestamp(5) with time zone", "timestamp(6) with time zone"}) {
    if (type == good) return true;
  }
  return false;
}

bool holds(std::string_view wanted, std::string_view found) {
  if (wanted == torque_type) return holds_torque(found);
  if (wanted == time_type) return holds_milliseconds(found);
  if (wanted == "integer") return found == "integer" || found == "bigint";
  if (wanted == "text") return found == "text" || found == "character varying";
  return wanted == found;
}

}  // namespace

std::string_view postgres_schema() { return schema; }
std::span<const WantedColumn> wanted_columns() { return columns; }
std::span<const WantedKey> wanted_keys() { return keys; }

std::optional<Error> fault_of(const WantedColumn& wanted, const FoundColumn& found) {
  Error error{.code = Errc::mismatch,
              .hint = "'spindle forward SINK --print-schema' prints the tables as they have to be"};
  if (!found.has_table) {
    error.message = fmt::format("the database has no table {}", wanted.table);
  } else if (!found.type) {
    error.message = fmt::format("table {} has no column {}", wanted.table, wanted.name);
  } else if (!holds(wanted.type, *found.type)) {
    error.message = fmt::format("column {} of table {} is {}, and {} is needed", wanted.name,
                                wanted.table, *found.type, wanted.type);
  } else {
    return std::nullopt;
  }
  return error;
}

}  // namespace spindle::forward
