#pragma once

#include <cstdint>

namespace spindle::link {

/// Whether a serial adapter receives what it sends itself.
enum class LocalEcho : std::uint8_t {
  automatic,  ///< found out from the first answers
  present,
  absent,
};

}  // namespace spindle::link
