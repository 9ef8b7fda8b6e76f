#pragma once

#include <cstdint>
#include <string>

#include "spindle/base/error.hpp"
#include "store/connection.hpp"

namespace spindle::store {

/// "SPND", in the header of the file.
inline constexpr std::int64_t application_id = 0x53504E44;

/// What is at a path.
enum class Found : std::uint8_t {
  nothing,  ///< no file, or one in which nothing was stored yet
  store,
};

/// Whether there is a file of this name with something in it.
bool is_there(const std::string& path);

/// The URI by which SQLite reads a file alone, neither looking at nor making any other one beside
/// it.
std::string unchanging(const std::string& path);

/// Looks without changing anything, be it a store or not, and without regard to what is still in
/// its write-ahead log. Error `bad_file`: it is something else, or of a newer version.
Result<Found> examine(const std::string& path);

/// What is open, with regard to all that belongs to it. Error `bad_file`: it is something else, or
/// of a version that this program does not know.
Result<Found> check_open(Connection& connection);

/// Which version is open. Error `bad_file`: it is no store, or of a version that this program does
/// not know.
Result<std::int64_t> version_of(Connection& connection);

/// The version that migrate() makes.
std::int64_t known_version();

/// Makes the tables of a store, or brings older ones to what this program knows.
Result<void> migrate(Connection& connection);

/// Sets how a writer of it works: write-ahead log, everything durable that is committed.
Result<void> set_durable(Connection& connection);

}  // namespace spindle::store
