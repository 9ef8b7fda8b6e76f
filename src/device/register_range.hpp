#pragma once

#include "spindle/catalogue/parameter.hpp"
#include "spindle/link/client.hpp"

namespace spindle::device {

/// The registers that a parameter is read from.
inline link::RegisterRange range_of(const catalogue::Parameter& parameter) {
  return {parameter.table, parameter.address.value, catalogue::register_count(parameter.encoding)};
}

}  // namespace spindle::device
