#pragma once

#include <cstdint>
#include <vector>

#include "spindle/modbus/adu.hpp"
#include "spindle/modbus/pdu.hpp"

namespace spindle::link {

/// A frame that a server may send unasked: function code and byte count of a read response. Byte
/// count 0: a function that no request has, whose data begin with their own length in two bytes.
/// Where that is not their length, it is still not to be passed over.
struct SpontaneousShape {
  std::uint8_t function = 0;
  std::uint8_t byte_count = 0;
  [[nodiscard]] bool is_long() const { return byte_count == 0; }
};

/// Whether the PDU has the shape.
bool has_shape(const modbus::Pdu& pdu, const SpontaneousShape& shape);

/// TCP: whose answers are taken.
enum class Units : std::uint8_t {
  asked,       ///< only those of the unit that was asked
  identified,  ///< also another unit's answer to FC 11h: the product is not known yet
  any,         ///< the product answers with any unit identifier
};

/// How answers are told from everything else on one connection.
struct DemuxRules {
  /// TCP: the transaction id decides, and the unit as `units` says.
  /// RTU, and where ids are ignored: the unit identifier decides.
  modbus::Framing framing = modbus::Framing::tcp;
  std::vector<SpontaneousShape> spontaneous = {};
  Units units = Units::asked;
  modbus::TransactionIds transactions = modbus::TransactionIds::echoed;
};

/// Whether an answer carries an id that proves whose answer it is. Else it may be a late one of the
/// same shape.
bool has_ids(const DemuxRules& rules);

enum class Verdict : std::uint8_t {
  answer,              ///< id (or unit), function and shape fit the outstanding request
  exception_response,  ///< id (or unit) fits, function with bit 7, one byte
  spontaneous,         ///< a shape that the profile declares as sent unasked
  broken,  ///< carries the outstanding request's id (or unit and function), but is not its answer
  other_unit,  ///< TCP: would be the answer, but another unit gave it
  stray,       ///< anything else: counted, traced, never fatal
};

/// What one received frame means while `outstanding` (null: none) waits for its answer. Pure.
Verdict judge(const modbus::Adu* outstanding, const modbus::Adu& received, const DemuxRules& rules);

}  // namespace spindle::link
