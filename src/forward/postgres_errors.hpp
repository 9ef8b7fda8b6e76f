#pragma once

#include <string>

#include "spindle/base/error.hpp"

namespace spindle::forward {

/// What libpq says of a connection that it could not make, told apart. `text` is as it comes with
/// PQERRORS_VERBOSE. Pure.
Error connection_error(const std::string& text);

/// What a server says against a statement, by its SQLSTATE. Pure.
Error statement_error(const std::string& state, const std::string& message);

}  // namespace spindle::forward
