#pragma once

#include "posix/descriptor.hpp"
#include "posix/wait.hpp"
#include "spindle/link/doors.hpp"

namespace spindle::posix {

/// What an asker came in by.
struct AskedAt {
  enum class Wire : std::uint8_t { packets, stream } wire = Wire::packets;
  link::SharedLine* line = nullptr;
  link::Rights rights = link::Rights::read;
};

/// Answers what one program asks, until it hangs up, `ended` becomes readable, or it is of no use
/// to go on. `socket` does not block.
void serve_asker(const Descriptor& socket, const AskedAt& at, int ended, Clock& clock);

}  // namespace spindle::posix
