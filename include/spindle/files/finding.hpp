#pragma once

#include <string>

namespace spindle::files {

/// One fault in a file.
struct Finding {
  std::string file;
  int line = 0;    ///< from 1
  int column = 0;  ///< from 1
  std::string message;

  /// "file:line:column: message"
  [[nodiscard]] std::string to_string() const;
};

}  // namespace spindle::files
