#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"
#include "spindle/store/reader.hpp"

namespace spindle::commands {

// What every command says of a choice of stored rows.

/// An option, or several together, that cannot be meant so.
Error bad_option(std::string_view option, std::string message, std::string hint);

/// Times as people write them; empty: not given. Error `usage` where the second is not behind the
/// first.
Result<void> add_times(const std::string& since, const std::string& until, const Clock& clock,
                       store::Filter& filter);

/// The error of a name that no row has. `known` are those that could be meant, in order.
Error unknown_in_store(const std::string& text, std::vector<std::string> known);

}  // namespace spindle::commands
