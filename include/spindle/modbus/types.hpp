#pragma once

#include <compare>
#include <cstdint>
#include <string_view>

#include "spindle/base/bytes.hpp"
#include "spindle/base/enum_table.hpp"

namespace spindle::modbus {

/// Function codes spoken here (Modbus Application Protocol 1.1b3, section 6).
enum class FunctionCode : std::uint8_t {
  read_holding_registers = 0x03,
  read_input_registers = 0x04,
  write_single_register = 0x06,
  diagnostics = 0x08,
  write_multiple_registers = 0x10,
  report_server_id = 0x11,
};

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

/// Limits of 1.1b3: a PDU has at most 253 bytes, which gives these register counts (6.1, 6.12).
inline constexpr std::size_t max_pdu_size = 253;
inline constexpr std::uint16_t max_read_count = 125;
inline constexpr std::uint16_t max_write_count = 123;

enum class RegisterTable : std::uint8_t { holding, input };
inline constexpr auto table_words = enum_table<RegisterTable>(
    {{"holding", RegisterTable::holding}, {"input", RegisterTable::input}});
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
