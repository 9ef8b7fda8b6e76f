#pragma once

#include <string>

#include "spindle/base/error.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/link/endpoint.hpp"

namespace spindle::device {

/// Who was asked, and what is known of it.
struct Asked {
  const link::Endpoint& endpoint;
  const catalogue::Profile& profile;
  modbus::UnitId unit;
  bool answered_before;  ///< an answer has come on this connection
};

/// What helps when a tool answers nothing, or ends the connection, as far as the target and the
/// profile say it: the unit, the framing, the line. Empty: nothing beyond what the error itself
/// says. Pure.
std::string hint_for_silence(const Error& error, const Asked& asked);

/// "registers count from 0: 40001 in a document is @holding:0", for a register that the tool does
/// not have and that is numbered as documents do. Empty: it is not. Pure.
std::string hint_for_absent_register(const Error& error);

}  // namespace spindle::device
