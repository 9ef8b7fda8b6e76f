#pragma once

#include <compare>
#include <cstdint>

#include "spindle/modbus/types.hpp"

namespace spindle::link {

/// A run of registers of one table. `count` >= 1.
struct RegisterRange {
  modbus::RegisterTable table = modbus::RegisterTable::holding;
  std::uint16_t first = 0;
  std::uint16_t count = 1;
  friend auto operator<=>(const RegisterRange&, const RegisterRange&) = default;
};

}  // namespace spindle::link
