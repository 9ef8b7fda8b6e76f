#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "page/words.hpp"

namespace spindle::page {

/// A file as the system's list of locks names it.
struct LockedFile {
  std::uint64_t inode = 0;
  std::string device = {};                              ///< "08:01"
  std::optional<std::uint64_t> process = std::nullopt;  ///< that wrote its number into it
};

/// Whether the text of /proc/locks says that the file is held. Pure.
bool is_listed(std::string_view locks, const LockedFile& file);

/// Whether a recorder has the store of this path. Its lock is not touched: a look that took it, for
/// however short a time, could keep a recorder from starting.
Recorder recorder_of(const std::string& store);

/// Size of the store and its log; empty: there is none.
std::optional<std::uint64_t> size_of(const std::string& store);

/// What tells one file from another of the same name; empty: there is none.
std::optional<std::string> identity_of(const std::string& store);

}  // namespace spindle::page
