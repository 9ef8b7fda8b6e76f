#pragma once

#include "spindle/store/writer.hpp"
#include "store/connection.hpp"

namespace spindle::store {

/// Writer::trim(), inside a transaction that is open.
Result<Trimmed> trim(Connection& connection, WallTime before, WallTime now);

}  // namespace spindle::store
