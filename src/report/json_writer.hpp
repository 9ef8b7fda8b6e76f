#pragma once

#include <string>
#include <string_view>

#include "spindle/report/record.hpp"

namespace spindle::report {

/// Appends the record as one JSON object (RFC 8259) without a line end. It begins
/// {"schema":"spindle/1","type":…,"time":…,"target":…; numbers keep their decimals.
void append_json(std::string& out, const Record& record);
/// The same of one cell.
void append_json(std::string& out, const Cell& cell);

}  // namespace spindle::report
