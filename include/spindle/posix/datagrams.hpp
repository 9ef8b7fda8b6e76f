#pragma once

#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/link/datagrams.hpp"

namespace spindle::posix {

/// UDP over IPv4. Questions leave from a port between 50000 and 59999, as tools may expect, never
/// further than the network of their interface. `clock` and `interrupt` must outlive it.
link::Network network(const Clock& clock, const Interrupt& interrupt);

}  // namespace spindle::posix
