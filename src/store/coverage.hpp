#pragma once

#include <vector>

#include "spindle/store/reader.hpp"
#include "store/connection.hpp"

namespace spindle::store {

/// Reader::coverage(), inside a transaction that is open.
std::vector<Coverage> coverage(Connection& connection);

}  // namespace spindle::store
