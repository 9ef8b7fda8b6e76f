#pragma once

#include <string>

namespace spindle::files {

/// Line and column of something in a file, from 1; line 0: it is not there.
struct Place {
  int line = 0;
  int column = 0;
};

/// One fault in a file.
struct Diagnostic {
  std::string file;
  int line = 0;    ///< from 1
  int column = 0;  ///< from 1
  std::string message;

  /// "file:line:column: message"
  [[nodiscard]] std::string to_string() const;
};

}  // namespace spindle::files
