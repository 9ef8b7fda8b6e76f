#pragma once

#include <cstdint>
#include <string_view>

#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"

namespace spindle::sim {

/// An alarm or warning that a simulated tool raises by itself, once.
struct Raised {
  std::uint16_t code = 0;
  Duration after = {};  ///< counted from the tool's first moment
};

/// Reads "CODE[@TIME]": "30h", "0x30" and "48" are the same code, "30h@5s" comes after five
/// seconds. A code is 1 to `highest`. Error `bad_value`.
Result<Raised> parse_raised(std::string_view text, std::uint16_t highest);

}  // namespace spindle::sim
