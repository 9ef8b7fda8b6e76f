#pragma once

#include <string_view>

#include "spindle/base/disk.hpp"

namespace spindle::posix {

/// The machine's own disk. A text is written to a temporary file beside its place, brought to the
/// disk (fsync) and renamed, and so is the folder. `trusted` names the users, beside root and the
/// program's own, whose profiles and tools files are read: "anna,1001".
Disk local_disk(std::string_view trusted = {});

/// The same for what reads a source tree, and no more: its files are trusted whichever user can
/// change them.
Disk source_disk();

}  // namespace spindle::posix
