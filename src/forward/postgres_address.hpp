#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "spindle/base/error.hpp"
#include "spindle/files/sink.hpp"

namespace spindle::forward {

/// What one URL of a database and its sink say about a connection.
struct PostgresAddress {
  std::vector<std::pair<std::string, std::string>> words = {};  ///< keywords of libpq and values
  std::string shown = {};                                       ///< "host:port/database"
  std::size_t hosts = 1;                                        ///< that libpq tries in turn
  std::string caution = {};  ///< what the user should know of it; empty: nothing
};

/// Reads a URL as libpq does, and adds to it: `sslmode=verify-full` for anything but this computer,
/// unless the URL says another one; limits that end a partition in which nothing is heard. Errors
/// (`usage`) never quote the URL: a password in it is refused, and must not be shown.
Result<PostgresAddress> postgres_address(const std::string& url, const files::Sink& settings,
                                         const std::optional<std::string>& password);

/// All of a sink, in its order. Error `usage` where one is none of PostgreSQL.
Result<std::vector<PostgresAddress>> postgres_addresses(const files::Sink& settings,
                                                        const std::optional<std::string>& password);

}  // namespace spindle::forward
