#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/base/line_channel.hpp"

namespace spindle::posix {

/// Starts another program of this installation with these arguments; what it reads and writes is
/// the channel, what it says on standard error is ours. It ends with the channel, and when this
/// program ends, however that ends. Errors: `bad_file` as of go_on_as(); `internal`.
Result<std::unique_ptr<LineChannel>> start_helper(std::string_view program,
                                                  const std::vector<std::string>& arguments,
                                                  Clock& clock, const Interrupt& interrupt);

}  // namespace spindle::posix
