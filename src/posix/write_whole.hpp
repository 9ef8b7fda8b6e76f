#pragma once

#include <cstdint>
#include <string_view>

namespace spindle::posix {

/// What to do while a pipe or terminal takes nothing: wait for its reader, or fail with EAGAIN.
enum class WhenFull : std::uint8_t { wait, fail };

/// Writes all of a text. Restarts after signals. A file takes it whole or not at all: where only
/// its beginning fits, that is taken back, unless another program wrote behind it meanwhile.
/// Returns 0, or the errno of the write that failed.
int write_whole(int descriptor, std::string_view text, WhenFull when_full);

/// Whether `descriptor` is an ordinary file in which the next text would be written behind a line
/// that has no end: a crash or a full disk cut it off. False where that cannot be seen.
bool ends_within_line(int descriptor);

}  // namespace spindle::posix
