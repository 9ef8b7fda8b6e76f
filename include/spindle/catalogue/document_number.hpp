#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "spindle/modbus/types.hpp"

namespace spindle::catalogue {

/// Documents number registers from 1 and put the table in front: 40001 (or 400001) is the first
/// holding register, 30001 the first input register. "registers count from 0: 40001 in a document
/// is @holding:0"; empty for other numbers.
std::string hint_for_document_number(std::uint64_t number);

/// The same for what a user typed: "40001", "@40001", "@holding:40001/i16".
std::string hint_for_document_number(std::string_view typed);

/// A place in one of the four tables.
struct NumberedPlace {
  modbus::RegisterTable table;
  modbus::RegisterAddress address;
};

/// What "40001", "400001", "30001", "10001" or "00001" (the first coil) means in such a document;
/// empty where it is no such number.
std::optional<NumberedPlace> parse_document_number(std::string_view text);

}  // namespace spindle::catalogue
