#pragma once

#include <cstdint>
#include <vector>

#include "spindle/modbus/adu.hpp"
#include "spindle/modbus/pdu.hpp"

namespace spindle::link {

/// A frame that a server may send unasked: function code and byte count of a read response.
struct SpontaneousShape {
  std::uint8_t function = 0;
  std::uint8_t byte_count = 0;
};

/// How answers are told from everything else on one connection.
struct DemuxRules {
  /// TCP: the transaction id decides, the unit is ignored (tools answer with another one).
  /// RTU: the unit identifier decides, there is no id.
  modbus::Framing framing = modbus::Framing::tcp;
  std::vector<SpontaneousShape> spontaneous;
};

enum class Verdict : std::uint8_t {
  answer,              ///< id (or unit), function and shape fit the outstanding request
  exception_response,  ///< id (or unit) fits, function with bit 7, one byte
  spontaneous,         ///< a shape that the profile declares as sent unasked
  broken,  ///< carries the outstanding request's id (or unit and function), but is not its answer
  stray,   ///< anything else: counted, traced, never fatal
};

/// What one received frame means while `outstanding` (null: none) waits for its answer. Pure.
Verdict judge(const modbus::Adu* outstanding, const modbus::Adu& received, const DemuxRules& rules);

}  // namespace spindle::link
