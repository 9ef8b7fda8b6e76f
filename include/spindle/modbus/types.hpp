#pragma once

#include <compare>
#include <cstdint>
#include <string_view>

#include "spindle/base/bytes.hpp"
#include "spindle/base/enum_table.hpp"

namespace spindle::modbus {

/// Function codes spoken here (Modbus Application Protocol 1.1b3, section 6).
enum class FunctionCode : std::uint8_t {
  read_coils = 0x01,
  read_discrete_inputs = 0x02,
  read_holding_registers = 0x03,
  read_input_registers = 0x04,
  write_single_coil = 0x05,
  write_single_register = 0x06,
  diagnostics = 0x08,
  write_multiple_coils = 0x0F,
  write_multiple_registers = 0x10,
  report_server_id = 0x11,
};

/// Whether a request of this function changes the server: sending it twice may do more than sending
/// it once.
constexpr bool is_write(std::uint8_t function) {
  switch (static_cast<FunctionCode>(function)) {
    case FunctionCode::write_single_coil:
    case FunctionCode::write_single_register:
    case FunctionCode::write_multiple_coils:
    case FunctionCode::write_multiple_registers:
      return true;
    default:
      return false;
  }
}

/// Whether a request of this function only asks.
constexpr bool is_read(std::uint8_t function) {
  switch (static_cast<FunctionCode>(function)) {
    case FunctionCode::read_coils:
    case FunctionCode::read_discrete_inputs:
    case FunctionCode::read_holding_registers:
    case FunctionCode::read_input_registers:
    case FunctionCode::diagnostics:
    case FunctionCode::report_server_id:
      return true;
    default:
      return false;
  }
}

/// Whether data of this function may begin with their own length in two bytes, big-endian, and be
/// longer than a PDU of the standard: one of the user-defined functions 100 to 110 (1.1b3, section
/// 5), as screwdrivers send curves.
constexpr bool is_counted_by_words(std::uint8_t function) {
  return function >= 100 && function <= 110;
}

/// Set in the function code of an exception response (1.1b3, section 7).
inline constexpr std::uint8_t exception_bit = 0x80;

/// Exception codes of 1.1b3, section 7. Devices send others too; texts are the profile's.
enum class ExceptionCode : std::uint8_t {
  illegal_function = 0x01,
  illegal_data_address = 0x02,
  illegal_data_value = 0x03,
  server_device_failure = 0x04,
  acknowledge = 0x05,
  server_device_busy = 0x06,
  gateway_path_unavailable = 0x0A,
  gateway_target_failed_to_respond = 0x0B,
};

/// Limits of 1.1b3: a PDU has at most 253 bytes, which gives these counts (6.1, 6.3, 6.11, 6.12).
inline constexpr std::size_t max_pdu_size = 253;
inline constexpr std::uint16_t max_read_count = 125;
inline constexpr std::uint16_t max_write_count = 123;
inline constexpr std::uint16_t max_read_bits = 2000;
inline constexpr std::uint16_t max_write_bits = 1968;

/// The four tables of a server (1.1b3, 4.3). Coils and discrete inputs are single bits, which stand
/// for registers that hold 0 or 1.
enum class RegisterTable : std::uint8_t { holding, input, coil, discrete };
inline constexpr auto table_words =
    enum_table<RegisterTable>({{"holding", RegisterTable::holding},
                               {"input", RegisterTable::input},
                               {"coil", RegisterTable::coil},
                               {"discrete", RegisterTable::discrete}});
constexpr bool holds_bits(RegisterTable table) {
  return table == RegisterTable::coil || table == RegisterTable::discrete;
}
constexpr bool is_writable(RegisterTable table) {
  return table == RegisterTable::coil || table == RegisterTable::holding;
}
constexpr std::uint16_t most_in_read(RegisterTable table) {
  return holds_bits(table) ? max_read_bits : max_read_count;
}
constexpr std::string_view to_text(RegisterTable table) { return table_words.text(table); }

struct UnitId {
  std::uint8_t value = 0;
  friend auto operator<=>(const UnitId&, const UnitId&) = default;
};

/// The address as sent, counted from 0 (not the 40001 style of older manuals).
struct RegisterAddress {
  std::uint16_t value = 0;
  friend auto operator<=>(const RegisterAddress&, const RegisterAddress&) = default;
};

struct TransactionId {
  std::uint16_t value = 0;
  friend auto operator<=>(const TransactionId&, const TransactionId&) = default;
};

/// Modbus TCP: what the transaction ids of answers say. Some gateways do not copy them.
enum class TransactionIds : std::uint8_t {
  echoed,   ///< an answer has that of its request
  ignored,  ///< nothing: an answer is told by unit, function and shape
};

/// As in profiles, tools files and URLs.
inline constexpr auto transaction_words = enum_table<TransactionIds>(
    {{"echoed", TransactionIds::echoed}, {"ignored", TransactionIds::ignored}});

/// Function code and data, without addressing and checksum (1.1b3, section 4.1).
struct Pdu {
  std::uint8_t function = 0;
  Bytes data;
  friend bool operator==(const Pdu&, const Pdu&) = default;
};

/// A PDU with its addressing. `transaction` is 0 on serial lines, which have none.
struct Adu {
  TransactionId transaction;
  UnitId unit;
  Pdu pdu;
  friend bool operator==(const Adu&, const Adu&) = default;
};

}  // namespace spindle::modbus
