#pragma once

#include "postgres_connection.hpp"

namespace spindle::forward {

/// Makes a new session keep what it acknowledges, and looks whether the database has the tables
/// that are needed and lets this role use them. Errors: `mismatch` names the table, column or key
/// that is missing or too narrow; `exception_response` what is not allowed.
Result<void> prepare_session(PostgresConnection& connection, TimePoint deadline);

}  // namespace spindle::forward
