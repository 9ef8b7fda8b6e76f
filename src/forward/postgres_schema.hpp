#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/error.hpp"

namespace spindle::forward {

/// The statements that make the tables and roles of a plant's database, for psql. The forwarder
/// itself never makes or changes a table.
std::string_view postgres_schema();

/// Where what is stored has to go to, so that nothing of it is rounded or cut.
struct WantedColumn {
  std::string_view table;
  std::string_view name;
  std::string_view type;  ///< as PostgreSQL's format_type() tells it
};
std::span<const WantedColumn> wanted_columns();

/// One table, and the columns that its unique key has to have, sorted; empty: any unique key.
struct WantedKey {
  std::string_view table;
  std::string_view columns;
};
std::span<const WantedKey> wanted_keys();

/// What a database has in place of one wanted column.
struct FoundColumn {
  bool has_table = false;
  std::optional<std::string> type = std::nullopt;  ///< empty: there is no such column
};

/// Why a column cannot take what is stored; empty where it can. Wider types are as good, narrower
/// ones are not: PostgreSQL would round or refuse values.
std::optional<Error> fault_of(const WantedColumn& wanted, const FoundColumn& found);

}  // namespace spindle::forward
