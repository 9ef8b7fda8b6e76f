#pragma once

#include <string>

#include "spindle/base/trust.hpp"

namespace spindle::posix {

/// A whole text that decides what is written to tools. Error `bad_file` where check_trust() refuses
/// the file, or the link that names it; what is checked is what is read, also when the name leads
/// to another file meanwhile.
Result<std::string> read_trusted_file(const std::string& path, const Trust& trust);

/// A whole text that is a secret. Error `bad_file` where all other users can read or write it. What
/// a group may read is its owner's choice.
Result<std::string> read_secret_file(const std::string& path);

}  // namespace spindle::posix
