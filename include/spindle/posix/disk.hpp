#pragma once

#include "spindle/base/disk.hpp"

namespace spindle::posix {

/// The machine's own disk. A text is written to a temporary file beside its place, brought to the
/// disk (fsync) and renamed, and so is the folder.
Disk local_disk();

}  // namespace spindle::posix
