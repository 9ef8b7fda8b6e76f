#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "spindle/base/clock.hpp"
#include "spindle/link/local_echo.hpp"
#include "spindle/modbus/serial_settings.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::link {

enum class Medium : std::uint8_t { tcp, serial, rtu_over_tcp, simulated };

/// Who switches an RS-485 line between sending and receiving: an adapter that does it by itself, or
/// the kernel with the port's RTS signal.
enum class LineSwitching : std::uint8_t { adapter, kernel };

/// Whether a line behind a device server may be used while another program of the user has it.
enum class Claim : std::uint8_t {
  alone,
  beside,  ///< to stop a motor, which waits for no other program
};

/// Where a tool is, as the user wrote it (contract, section 2.1). What a URL leaves out is empty
/// here and filled from the profile later.
struct Endpoint {
  std::string text = {};  ///< the URL as given, for messages and records
  Medium medium = Medium::tcp;
  std::string host = {};  ///< name or address without brackets (tcp, rtu+tcp)
  std::optional<std::uint16_t> port = std::nullopt;
  std::string device = {};   ///< path of the serial line (rtu)
  std::string profile = {};  ///< profile of a simulated tool (sim)
  std::optional<modbus::UnitId> unit = std::nullopt;
  bool reserved_units = false;  ///< rtu, rtu+tcp: units from 248 to 255 may be asked, too
  std::optional<unsigned> baud = std::nullopt;
  std::optional<modbus::Parity> parity = std::nullopt;
  std::optional<unsigned> stop_bits = std::nullopt;
  std::optional<Duration> gap = std::nullopt;      ///< silence before a request; else the profile's
  std::optional<Duration> timeout = std::nullopt;  ///< for one answer; else the profile's
  std::optional<unsigned> retries = std::nullopt;  ///< of reads; else the profile's
  LineSwitching switching = LineSwitching::adapter;
  LocalEcho echo = LocalEcho::automatic;
  std::optional<modbus::TransactionIds> transactions = std::nullopt;  ///< tcp; else the profile's
  /// tcp: names the connection that it shares with other units of one command; empty: its own.
  std::string gateway = {};
  Claim claim = Claim::alone;

  friend bool operator==(const Endpoint&, const Endpoint&) = default;
};

/// Whether the text can only be meant as a URL, or as an address or serial port without a scheme
/// (see parse_endpoint()).
bool looks_like_url(std::string_view text);

/// Longest time for one answer, most repetitions of a read, and longest silence, which a URL, a
/// tools file or an option may ask for.
inline constexpr Duration longest_timeout = std::chrono::minutes(10);
inline constexpr unsigned most_retries = 100;
inline constexpr Duration longest_gap = std::chrono::seconds(1);

/// Parses tcp://HOST[:PORT][?unit=N&transaction=],
/// rtu:///PATH[?unit=&reserved=&baud=&parity=&stop=&gap=&rs485=&echo=],
/// rtu+tcp://HOST:PORT[?unit=&reserved=&baud=&gap=&echo=] and sim:PROFILE[?unit=&baud=], each also
/// with timeout= and retries=. IPv6 addresses stand in brackets. Without a scheme, an IPv4 address,
/// an IPv6 address in brackets and HOST:PORT are tcp, and /dev/PATH, ttyUSB0, ttyACM0, ttyS0,
/// ttyAMA0 and COM1 (the first port of the board: ttyS0) are rtu. Error `bad_target` names the part
/// that is wrong: unknown scheme (with a suggestion), empty host, port outside 1…65535, unit
/// outside 0…255 (0…247 on rtu and rtu+tcp, where the others are reserved: Modbus over Serial
/// Line 1.02, section 2.2), unknown or repeated option. The `baud` of rtu+tcp is that of the line
/// behind the device server; it only says how long bytes and gaps take there.
Result<Endpoint> parse_endpoint(std::string_view url);

/// How the line of the endpoint is set: as its URL says, and where that says nothing as `usual`.
modbus::SerialSettings serial_settings(const Endpoint& endpoint,
                                       const modbus::SerialSettings& usual);

/// "tcp://HOST:PORT" or "rtu+tcp://HOST:PORT", with brackets around an IPv6 address: a network
/// endpoint whose port has been filled in, for messages.
std::string to_url(const Endpoint& endpoint);

}  // namespace spindle::link
