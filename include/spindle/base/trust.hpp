#pragma once

#include <string>
#include <vector>

#include "spindle/base/error.hpp"

namespace spindle {

/// A user or a group: its number, and its name where the system knows one.
struct Account {
  unsigned number = 0;
  std::string name = {};  ///< empty: unknown
};

/// To whom a file belongs, and who may change what is in it.
struct Ownership {
  Account owner = {};
  Account group = {};
  std::vector<std::string> members = {};  ///< of the group, beside those who have it as their own
  bool group_writes = false;
  bool others_write = false;
};

/// Whose files are believed beside those of root.
struct Trust {
  unsigned self = 0;                     ///< the program's user
  std::vector<std::string> others = {};  ///< names or numbers of users, as `SPINDLE_TRUST` has them
  bool everyone = false;                 ///< nothing is asked, as of the files of a source tree
};

/// Whether a file may decide what is written to a tool: it belongs to root, to the program's user
/// or to a user who is trusted, and no other user can write it. A group may write where it is its
/// owner's alone: it has the owner's name and no other member. Error `bad_file` says why not, and
/// how to allow it.
Result<void> check_trust(const std::string& path, const Ownership& ownership, const Trust& trust);

/// The words of a list "anna,1001", empty ones left out.
std::vector<std::string> trusted_users(std::string_view text);

}  // namespace spindle
