#pragma once

#include <string>
#include <vector>

#include "files/value_reader.hpp"

namespace spindle::files {

/// The keys of one map of a file, as the manual lists them.
struct KeyList {
  std::string map;  ///< "profile", "link", "command-word"
  std::vector<Key> keys;
};

/// Every key of each kind of file.
std::vector<KeyList> profile_keys();
std::vector<KeyList> tools_keys();
std::vector<KeyList> backup_keys();
std::vector<KeyList> dump_keys();

}  // namespace spindle::files
