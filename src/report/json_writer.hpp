#pragma once

#include <string>
#include <string_view>

#include "spindle/report/record.hpp"

namespace spindle::report {

/// Appends the record as one JSON object (RFC 8259) without a line end. It begins
/// {"schema":"spindle/1","type":…,"time":…,"target":…; numbers keep their decimals.
void append_json(std::string& out, const Record& record);

/// Appends a JSON string. Ill-formed UTF-8 becomes U+FFFD; every control character, C1 included, is
/// escaped, so that a line shown on a terminal cannot steer it.
void append_json_string(std::string& out, std::string_view text);

}  // namespace spindle::report
