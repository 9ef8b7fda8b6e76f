#pragma once

#include <cstdint>
#include <string>

#include "posix/descriptor.hpp"
#include "spindle/base/clock.hpp"

namespace spindle::posix {

/// A lock that the programs of one user keep among themselves, for lines that the system does not
/// lock: a device server that any number of connections reach. It is a file in a folder of the
/// user's own, and is free again when its holder ends, however that ends.
struct LineLock {
  Descriptor file = Descriptor(-1);  ///< invalid: another program holds it, or no folder is there
  std::string holder = {};           ///< who holds it; empty: no other program, as far as is known
};

/// Takes the lock of this name (letters, digits, '.', ':', '-', '_', '%', '[' and ']'), or says who
/// has it. Without a folder to keep it in there is no lock, and none is asked for.
LineLock lock_line(const std::string& name);

/// A line that programs have one after another.
struct LineName {
  std::string text = {};   ///< as for lock_line()
  std::int64_t since = 0;  ///< differs when another device has got the name: a port plugged in anew
};

/// Until when an answer may come on this line that an earlier program of the user gave up; not
/// after `now` when there is none. Times are those of one run of the system.
TimePoint late_answers_until(const LineName& line, TimePoint now);

/// Leaves that to the programs that have the line later. Without a folder to keep it in they do
/// not learn it.
void leave_late_answers(const LineName& line, TimePoint until);

}  // namespace spindle::posix
