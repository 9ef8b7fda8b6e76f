#pragma once

#include <string>
#include <vector>

namespace spindle::posix {

/// Far above any file of ours: a backup has a hundred kilobytes. Keeps a wrong path from filling
/// memory.
inline constexpr std::size_t largest_file = std::size_t{1} << 20;

/// Adds to the text what can be read. 0 at the end of the file, else the errno: EFBIG for one that
/// is larger than `largest_file`. May be called again after EINTR.
int read_whole(int descriptor, std::string& text);

/// What can be read of a file of the system's, such as one in /proc.
std::string text_of(const std::string& path);

/// The names in a folder, in no order; none where it cannot be listed.
std::vector<std::string> names_in(const std::string& folder);

}  // namespace spindle::posix
