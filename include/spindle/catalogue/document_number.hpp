#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace spindle::catalogue {

/// Documents number registers from 1 and put the table in front: 40001 (or 400001) is the first
/// holding register, 30001 the first input register. "registers count from 0: 40001 in a document
/// is @holding:0"; empty for other numbers.
std::string hint_for_document_number(std::uint64_t number);

/// The same for what a user typed: "40001", "@40001", "@holding:40001/i16".
std::string hint_for_document_number(std::string_view typed);

}  // namespace spindle::catalogue
