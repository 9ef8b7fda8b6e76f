#pragma once

#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/link/doors.hpp"

namespace spindle::posix {

/// Unix sockets, one for each line, in a folder that only this user can write (or the one that
/// systemd made for the service), and TCP ports. Programs of the same user and of root are let in,
/// and with the service those of its group. `clock` and `interrupt` must outlive all doors.
link::MakeDoors door_maker(Clock& clock, const Interrupt& interrupt);

}  // namespace spindle::posix
