#pragma once

#include <termios.h>

#include <optional>

namespace spindle::posix {

/// The name that termios has for a rate; empty for one without a name.
std::optional<speed_t> speed_of(unsigned baud);

}  // namespace spindle::posix
