#pragma once

#include <string>

namespace spindle {

/// What the running program was built and started with.
struct Installation {
  std::string folder;          ///< where the executable is; its profiles are found from here
  std::string modbus_library;  ///< version of libmodbus as it is loaded, such as "3.1.6"
};

}  // namespace spindle
