#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace spindle::posix {

/// The folder that all programs of this user have in common while the system runs, whatever their
/// environment: "spindle" below $XDG_RUNTIME_DIR or /run/user, else one in /tmp. It is made where
/// it is missing. Empty where no folder can be trusted to be this user's alone.
std::optional<std::string> own_runtime_folder();

/// A folder with the sockets of programs that have lines.
struct OwnerFolder {
  std::string path;
  uid_t owner = 0;  ///< whose sockets are believed beside those of root
  mode_t mode = 0;  ///< of a socket that is made there
};

/// Where sockets are looked for: the user's own folder, and that of the service, /run/spindle. Only
/// those that no other user can put a socket into.
std::vector<OwnerFolder> owner_folders();

/// Where this program makes its sockets: in the folder that the system made for the service that it
/// is ($RUNTIME_DIRECTORY), else in the user's own.
std::optional<OwnerFolder> served_folder();

/// The path of the socket of a line; empty where it cannot be one. A name that is too long for a
/// socket is replaced by a number that is made of it.
std::optional<std::string> socket_path(const std::string& folder, const std::string& line);

}  // namespace spindle::posix
