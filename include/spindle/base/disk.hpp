#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/error.hpp"

namespace spindle {

/// Whether a file that is there may be replaced.
enum class Overwrite : std::uint8_t { refuse, allow };

/// Who may look into a folder or file that is made: those whom the user usually allows it, or none
/// else.
enum class Privacy : std::uint8_t { usual, own };

/// The file system as functions, so that tests can bring one in memory. All errors name the path:
/// what cannot be read is `bad_file`, what cannot be written `storage`, but for a file that must
/// not be replaced: that is `usage`.
struct Disk {
  std::function<bool(const std::string& path)> exists;
  /// Whether there is surely nothing of this name. Where one may not look there may be something,
  /// and reading it says why not.
  std::function<bool(const std::string& path)> absent;
  /// Whether two names are those of one file.
  std::function<bool(const std::string& a, const std::string& b)> same_file;
  /// The names of what is in a folder, in no order; none where it cannot be listed.
  std::function<std::vector<std::string>(const std::string& folder)> list;
  /// A whole text. Refuses folders, and what is larger than any file of ours.
  std::function<Result<std::string>(const std::string& path)> read;
  /// All of the text or nothing: what was there stays whole until the new text is safely stored,
  /// and nothing is left beside it when that fails. A file that is replaced keeps its rights,
  /// unless the new text is for no other user.
  std::function<Result<void>(const std::string& path, std::string_view text, Overwrite overwrite,
                             Privacy privacy)>
      write;
  /// Adds a line (with its end), whole or not at all, in one piece, so that lines of several
  /// programs never mix, and behind a line that a crash cut off on a line of its own. Creates the
  /// file.
  std::function<Result<void>(const std::string& path, std::string_view line)> append_line;
  /// Adds bytes to a file that is no text, whole or not at all, in one piece. Creates the file.
  std::function<Result<void>(const std::string& path, std::string_view bytes)> append;
  /// Makes a folder and those above it. Existing ones are left as they are.
  std::function<Result<void>(const std::string& folder, Privacy privacy)> make_folders;
  /// Who writes: the name of the program's user.
  std::function<std::string()> user;
  /// The number by which the system tells this program from all others that run.
  std::function<std::uint64_t()> process;
  /// A whole text that decides what is written to tools: refuses, beside what read() refuses, a
  /// file of another user and one that other users can write (see check_trust()).
  std::function<Result<std::string>(const std::string& path)> read_trusted;
  /// A whole text that is a secret: refuses, beside what read() refuses, a file that all other
  /// users can read or write.
  std::function<Result<std::string>(const std::string& path)> read_secret = {};
  /// Writes a text in place of another one: false, and nothing is written, where the file does not
  /// hold `expected` (any more). Of programs that replace a file so at the same time, one comes
  /// after the other. As write(), it stores all of the text or nothing, and keeps the file's
  /// rights.
  std::function<Result<bool>(const std::string& path, std::string_view expected,
                             std::string_view text)>
      replace = {};
};

}  // namespace spindle
