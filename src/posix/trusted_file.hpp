#pragma once

#include <string>

#include "spindle/base/trust.hpp"

namespace spindle::posix {

/// A whole text that decides what is written to tools. Error `bad_file` where check_trust() refuses
/// the file, or the link that names it; what is checked is what is read, also when the name leads
/// to another file meanwhile.
Result<std::string> read_trusted_file(const std::string& path, const Trust& trust);

}  // namespace spindle::posix
