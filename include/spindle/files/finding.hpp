#pragma once

#include <compare>
#include <cstddef>
#include <string>

namespace spindle::files {

/// Where something stands in one of the files that are read together. Line and column count from 1,
/// columns in bytes as compilers do; line 0: it is not there.
struct SourceLocation {
  std::size_t file = 0;  ///< as given by Diagnostics::add_file()
  int line = 0;
  int column = 0;
  friend auto operator<=>(const SourceLocation&, const SourceLocation&) = default;
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
