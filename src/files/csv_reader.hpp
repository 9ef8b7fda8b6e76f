#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/error.hpp"

namespace spindle::files {

/// One row of a table, and the line of the text on which it begins, from 1.
struct CsvRow {
  std::size_t line = 0;
  std::vector<std::string> fields = {};  ///< without blanks around them
};

/// The rows of a text, those without any word left out. The separator (comma, semicolon or tab) is
/// the one that the first row with any has most of; lines end with LF, CRLF or CR; a mark of byte
/// order is skipped. Error `bad_file`: a NUL, no UTF-8, a quote without an end, more than
/// `most_rows`, or a row of more than a hundred fields.
Result<std::vector<CsvRow>> read_csv(std::string_view text, const std::string& path,
                                     std::size_t most_rows);

}  // namespace spindle::files
