#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <variant>

#include "spindle/modbus/types.hpp"

namespace spindle::modbus {

// ---- requests, as a client builds them (1.1b3, section 6) ----

/// FC 01, 02, 03 or 04. Requires 1 <= count <= most_in_read(table) and first + count <= 65536.
Pdu read_request(RegisterTable table, RegisterAddress first, std::uint16_t count);
/// FC 06.
Pdu write_request(RegisterAddress address, std::uint16_t value);
/// FC 10h. Requires 1 to 123 values.
Pdu write_request(RegisterAddress first, RegisterView values);
/// FC 05; a coil is on when `value` is not 0.
Pdu write_coil_request(RegisterAddress address, std::uint16_t value);
/// FC 0Fh. Requires 1 to 1968 values.
Pdu write_coils_request(RegisterAddress first, RegisterView values);
/// FC 08 sub-function 0000h, return query data.
Pdu loopback_request(std::uint16_t word);
/// FC 11h.
Pdu report_server_id_request();

// ---- requests, as a server reads them ----

struct ReadRequest {
  RegisterTable table;
  RegisterAddress first;
  std::uint16_t count;
};
/// Of a holding register, or of a coil, whose value is 0 or 1.
struct WriteSingleRequest {
  RegisterAddress address;
  std::uint16_t value;
  RegisterTable table = RegisterTable::holding;
};
/// Likewise.
struct WriteMultipleRequest {
  RegisterAddress first;
  Registers values;
  RegisterTable table = RegisterTable::holding;
};
struct LoopbackRequest {
  std::uint16_t word;
};
struct ReportServerIdRequest {};
using Request = std::variant<ReadRequest, WriteSingleRequest, WriteMultipleRequest, LoopbackRequest,
                             ReportServerIdRequest>;

/// Understands a request, or says with which exception code a server refuses it: 01 for a function
/// that is not spoken here (and FC 08 with another sub-function), 03 for a wrong length or
/// quantity. Addresses and device limits are the server's own business.
tl::expected<Request, ExceptionCode> parse_request(const Pdu& pdu);

// ---- responses, as a server builds them ----

/// Response to FC 01 to 04: byte count and registers, or coils packed into bytes.
Pdu read_response(RegisterTable table, RegisterView registers);
/// Response to FC 10h, or to FC 0Fh: address and quantity.
Pdu write_multiple_response(RegisterAddress first, std::uint16_t count,
                            RegisterTable table = RegisterTable::holding);
/// Response to FC 11h: byte count and device-specific data.
Pdu report_server_id_response(ByteView data);
Pdu exception_response(std::uint8_t function, std::uint8_t code);

// ---- responses, as a client judges them ----

enum class Fit : std::uint8_t {
  answer,              ///< function and shape are those of this request's answer
  exception_response,  ///< the request's function with bit 7 set, and one byte
  wrong_shape,  ///< the request's function, but not its answer: byte count, echo or length differs
  foreign,      ///< another function
};

/// Judges a response by the request alone: the byte count fits the quantity, the echo of a write
/// equals what was sent (address and value, address and quantity, loop-back word), FC 11h's byte
/// count fits. Of a function that is not spoken here every answer fits.
Fit fit(const Pdu& request, const Pdu& response);

/// The registers of a response to FC 03/04.
Registers registers_of(const Pdu& response);
/// The registers of a response to FC 01 to 04 that fits its request; each coil as 0 or 1.
Registers registers_of(const Pdu& request, const Pdu& response);
/// The device-specific data of a fitting response to FC 11h.
ByteView server_id_of(const Pdu& response);
/// The exception code when `response` is an exception response of one byte.
std::optional<std::uint8_t> exception_of(const Pdu& response);

/// "report server id", "read 2 holding registers from 2", "write register 4002": for messages.
std::string describe_request(const Pdu& request);

/// What a frame says with all that is in it, for traces: "write 1 to register 4002".
std::string explain_request(const Pdu& request);
/// "2 registers: 0 271", "exception 02 (illegal data address)"; bytes where it has no known shape.
std::string explain_response(const Pdu& response);

/// Name of a standard exception code ("illegal data address"); empty for others.
std::string_view exception_name(std::uint8_t code);

}  // namespace spindle::modbus
