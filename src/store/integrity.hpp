#pragma once

#include <string>
#include <vector>

#include "store/connection.hpp"

namespace spindle::store {

/// Reader::integrity(), inside a transaction that is open.
std::vector<std::string> integrity(Connection& connection);

}  // namespace spindle::store
