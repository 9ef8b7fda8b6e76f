#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "spindle/base/error.hpp"

namespace spindle::store {

/// The name of the network file system whose magic number this is; empty: it is none.
std::string_view network_file_system(std::int64_t magic);

/// The folder of a file, made where it is missing. Error `storage`, also where it is on another
/// computer.
Result<void> prepare_folder(const std::string& path);

/// An empty file that only its user may read and write; SQLite gives the same rights to those that
/// it puts beside it. `there` is the error where there is one of this name.
Result<void> make_own_file(const std::string& path, Errc there);

}  // namespace spindle::store
