#pragma once

#include "spindle/report/streams.hpp"

namespace spindle::posix {

/// The process's standard streams, unbuffered beyond one call. Colour is left off; the command line
/// decides.
report::Streams standard_streams();

}  // namespace spindle::posix
