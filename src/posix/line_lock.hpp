#pragma once

#include <string>

#include "posix/descriptor.hpp"

namespace spindle::posix {

/// A lock that the programs of one user keep among themselves, for lines that the system does not
/// lock: a device server that any number of connections reach. It is a file in a folder of the
/// user's own, and is free again when its holder ends, however that ends.
struct LineLock {
  Descriptor file = Descriptor(-1);  ///< invalid: another program holds it, or no folder is there
  std::string holder = {};           ///< who holds it; empty: nobody else, as far as is known
};

/// Takes the lock of this name (letters, digits, '.', ':', '-', '_', '%', '[' and ']'), or says who
/// has it. Without a folder to keep it in there is no lock, and none is asked for.
LineLock lock_line(const std::string& name);

}  // namespace spindle::posix
