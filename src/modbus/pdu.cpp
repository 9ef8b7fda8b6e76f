#include "spindle/modbus/pdu.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <utility>
#include <vector>

namespace spindle::modbus {
namespace {

constexpr std::uint16_t return_query_data = 0x0000;  // FC 08 sub-function, 1.1b3, 6.8.1

constexpr std::uint8_t code_of(FunctionCode function) {
  return static_cast<std::uint8_t>(function);
}

// What FC 05 sends for a coil that is on (1.1b3, 6.5).
constexpr std::uint16_t coil_on = 0xFF00;

constexpr unsigned bits_per_byte = 8;

constexpr FunctionCode reader_of(RegisterTable table) {
  switch (table) {
    case RegisterTable::coil:
      return FunctionCode::read_coils;
    case RegisterTable::discrete:
      return FunctionCode::read_discrete_inputs;
    case RegisterTable::input:
      return FunctionCode::read_input_registers;
    case RegisterTable::holding:
      break;
  }
  return FunctionCode::read_holding_registers;
}

constexpr bool reads_bits(std::uint8_t function) {
  return function == code_of(FunctionCode::read_coils) ||
         function == code_of(FunctionCode::read_discrete_inputs);
}

constexpr std::size_t bytes_of_bits(std::size_t count) {
  return (count + bits_per_byte - 1) / bits_per_byte;
}

Pdu words_pdu(FunctionCode function, std::initializer_list<std::uint16_t> words) {
  Pdu pdu{.function = code_of(function), .data = {}};
  for (const std::uint16_t word : words) put_u16(pdu.data, word);
  return pdu;
}

// Byte count and registers, as in a response to FC 03/04 and at the end of a request of FC 10h.
void put_counted(Bytes& bytes, RegisterView registers) {
  bytes.push_back(static_cast<std::uint8_t>(registers.size() * 2));
  for (const std::uint16_t value : registers) put_u16(bytes, value);
}

// The same with bits, the first one in the lowest bit of the first byte.
void put_counted_bits(Bytes& bytes, RegisterView bits) {
  const std::size_t size = bytes_of_bits(bits.size());
  bytes.push_back(static_cast<std::uint8_t>(size));
  const std::size_t begin = bytes.size();
  bytes.resize(begin + size);
  for (std::size_t i = 0; i < bits.size(); ++i) {
    if (bits[i] == 0) continue;
    bytes[begin + i / bits_per_byte] |= static_cast<std::uint8_t>(1U << (i % bits_per_byte));
  }
}

// Requires as many bytes as the bits need.
Registers get_bits(ByteView bytes, std::size_t count) {
  Registers bits(count);
  for (std::size_t i = 0; i < count; ++i) {
    const unsigned byte = bytes[i / bits_per_byte];
    bits[i] = static_cast<std::uint16_t>((byte >> (i % bits_per_byte)) & 1U);
  }
  return bits;
}

Registers get_registers(ByteView bytes) {
  Registers registers;
  registers.reserve(bytes.size() / 2);
  for (std::size_t at = 0; at + 2 <= bytes.size(); at += 2) registers.push_back(get_u16(bytes, at));
  return registers;
}

using Parsed = tl::expected<Request, ExceptionCode>;

Parsed refuse(ExceptionCode code) { return tl::unexpected(code); }

Parsed parse_read(RegisterTable table, ByteView data) {
  if (data.size() != 4) return refuse(ExceptionCode::illegal_data_value);
  const std::uint16_t count = get_u16(data, 2);
  if (count == 0 || count > most_in_read(table)) return refuse(ExceptionCode::illegal_data_value);
  return ReadRequest{.table = table, .first = {get_u16(data, 0)}, .count = count};
}

Parsed parse_write_single(ByteView data) {
  if (data.size() != 4) return refuse(ExceptionCode::illegal_data_value);
  return WriteSingleRequest{.address = {get_u16(data, 0)}, .value = get_u16(data, 2)};
}

Parsed parse_write_coil(ByteView data) {
  if (data.size() != 4) return refuse(ExceptionCode::illegal_data_value);
  const std::uint16_t value = get_u16(data, 2);
  if (value != 0 && value != coil_on) return refuse(ExceptionCode::illegal_data_value);
  return WriteSingleRequest{.address = {get_u16(data, 0)},
                            .value = static_cast<std::uint16_t>(value == 0 ? 0 : 1),
                            .table = RegisterTable::coil};
}

Parsed parse_write_coils(ByteView data) {
  constexpr std::size_t head = 5;  // address, quantity, byte count
  if (data.size() < head) return refuse(ExceptionCode::illegal_data_value);
  const std::uint16_t count = get_u16(data, 2);
  const bool count_allowed = count > 0 && count <= max_write_bits;
  const bool lengths_agree = data[4] == bytes_of_bits(count) && data.size() == head + data[4];
  if (!count_allowed || !lengths_agree) return refuse(ExceptionCode::illegal_data_value);
  return WriteMultipleRequest{.first = {get_u16(data, 0)},
                              .values = get_bits(data.subspan(head), count),
                              .table = RegisterTable::coil};
}

Parsed parse_write_multiple(ByteView data) {
  constexpr std::size_t head = 5;  // address, quantity, byte count
  if (data.size() < head) return refuse(ExceptionCode::illegal_data_value);
  const std::uint16_t count = get_u16(data, 2);
  const bool count_allowed = count > 0 && count <= max_write_count;
  const bool lengths_agree = data[4] == count * 2 && data.size() == head + data[4];
  if (!count_allowed || !lengths_agree) return refuse(ExceptionCode::illegal_data_value);
  return WriteMultipleRequest{.first = {get_u16(data, 0)},
                              .values = get_registers(data.subspan(head))};
}

Parsed parse_diagnostics(ByteView data) {
  if (data.size() < 2) return refuse(ExceptionCode::illegal_data_value);
  if (get_u16(data, 0) != return_query_data) return refuse(ExceptionCode::illegal_function);
  if (data.size() != 4) return refuse(ExceptionCode::illegal_data_value);
  return LoopbackRequest{.word = get_u16(data, 2)};
}

Parsed parse_report_server_id(ByteView data) {
  if (!data.empty()) return refuse(ExceptionCode::illegal_data_value);
  return ReportServerIdRequest{};
}

bool answers_read(ByteView request, ByteView response) {
  if (request.size() != 4 || response.empty()) return false;
  const std::size_t bytes = std::size_t{get_u16(request, 2)} * 2;
  return response[0] == bytes && response.size() == 1 + bytes;
}

bool answers_read_bits(ByteView request, ByteView response) {
  if (request.size() != 4 || response.empty()) return false;
  const std::size_t bytes = bytes_of_bits(get_u16(request, 2));
  return response[0] == bytes && response.size() == 1 + bytes;
}

bool answers_write_multiple(ByteView request, ByteView response) {
  return request.size() >= 4 && std::ranges::equal(request.first(4), response);
}

bool answers_report_server_id(ByteView response) {
  return response.size() >= 2 && response[0] == response.size() - 1;
}

// Both have the same function.
bool answers(const Pdu& request, const Pdu& response) {
  switch (static_cast<FunctionCode>(request.function)) {
    case FunctionCode::read_holding_registers:
    case FunctionCode::read_input_registers:
      return answers_read(request.data, response.data);
    case FunctionCode::read_coils:
    case FunctionCode::read_discrete_inputs:
      return answers_read_bits(request.data, response.data);
    case FunctionCode::write_single_coil:
    case FunctionCode::write_single_register:
    case FunctionCode::diagnostics:
      return request.data == response.data;
    case FunctionCode::write_multiple_coils:
    case FunctionCode::write_multiple_registers:
      return answers_write_multiple(request.data, response.data);
    case FunctionCode::report_server_id:
      return answers_report_server_id(response.data);
  }
  return true;  // its shape is not known here
}

std::string_view plural(std::size_t count) { return count == 1 ? "" : "s"; }

/// "register", "coil".
std::string_view word_of(RegisterTable table) {
  return table == RegisterTable::coil ? "coil" : "register";
}

/// "3 holding registers", "1 coil", "2 discrete inputs".
std::string counted_in(RegisterTable table, std::size_t count) {
  switch (table) {
    case RegisterTable::coil:
      return fmt::format("{} coil{}", count, plural(count));
    case RegisterTable::discrete:
      return fmt::format("{} discrete input{}", count, plural(count));
    case RegisterTable::holding:
    case RegisterTable::input:
      break;
  }
  return fmt::format("{} {} register{}", count, to_text(table), plural(count));
}

struct Describe {
  std::string operator()(const ReadRequest& read) const {
    return fmt::format("read {} from {}", counted_in(read.table, read.count), read.first.value);
  }
  std::string operator()(const WriteSingleRequest& write) const {
    return fmt::format("write {} {}", word_of(write.table), write.address.value);
  }
  std::string operator()(const WriteMultipleRequest& write) const {
    return fmt::format("write {} {}{} from {}", write.values.size(), word_of(write.table),
                       plural(write.values.size()), write.first.value);
  }
  std::string operator()(const LoopbackRequest& /*loopback*/) const { return "loop-back"; }
  std::string operator()(const ReportServerIdRequest& /*report*/) const {
    return "report server id";
  }
};

/// The same with the values.
struct Explain : Describe {
  using Describe::operator();
  std::string operator()(const WriteSingleRequest& write) const {
    return fmt::format("write {} to {} {}", write.value, word_of(write.table), write.address.value);
  }
  std::string operator()(const WriteMultipleRequest& write) const {
    return fmt::format("write {} to {} {}{} from {}", fmt::join(write.values, " "),
                       write.values.size(), word_of(write.table), plural(write.values.size()),
                       write.first.value);
  }
  std::string operator()(const LoopbackRequest& loopback) const {
    return fmt::format("loop-back of {:04X}", loopback.word);
  }
};

std::string explain_bytes(const Pdu& pdu) {
  return fmt::format("function {:02X}, data {}", pdu.function, to_hex(pdu.data));
}

/// Counted bytes, as answers to reads and to FC 11h have them.
bool is_counted(const Pdu& pdu) {
  return !pdu.data.empty() && pdu.data.size() == std::size_t{1} + pdu.data.front();
}

std::string explain_read(const Pdu& response) {
  const Registers registers = registers_of(response);
  if (!is_counted(response) || response.data.front() % 2 != 0) return explain_bytes(response);
  return fmt::format("{} register{}: {}", registers.size(), plural(registers.size()),
                     fmt::join(registers, " "));
}

/// "00000101 00000001": the last byte comes first, as the bits of a number do.
std::string bits_in_words(ByteView bytes) {
  std::vector<std::string> words;
  for (auto byte = bytes.rbegin(); byte != bytes.rend(); ++byte) {
    words.push_back(fmt::format("{:08b}", *byte));
  }
  return fmt::format("{}", fmt::join(words, " "));
}

/// Responses that are the echo of their request, or of its beginning.
std::string explain_echo(const Pdu& response) {
  if (response.data.size() != 4) return explain_bytes(response);
  const std::uint16_t first = get_u16(response.data, 0);
  const std::uint16_t second = get_u16(response.data, 2);
  switch (static_cast<FunctionCode>(response.function)) {
    case FunctionCode::write_single_coil:
      return fmt::format("wrote {} to coil {}", second == 0 ? 0 : 1, first);
    case FunctionCode::write_single_register:
      return fmt::format("wrote {} to register {}", second, first);
    case FunctionCode::write_multiple_coils:
      return fmt::format("wrote {} coil{} from {}", second, plural(second), first);
    case FunctionCode::write_multiple_registers:
      return fmt::format("wrote {} register{} from {}", second, plural(second), first);
    default:
      return fmt::format("loop-back of {:04X}", second);
  }
}

}  // namespace

Pdu read_request(RegisterTable table, RegisterAddress first, std::uint16_t count) {
  return words_pdu(reader_of(table), {first.value, count});
}

Pdu write_request(RegisterAddress address, std::uint16_t value) {
  return words_pdu(FunctionCode::write_single_register, {address.value, value});
}

Pdu write_request(RegisterAddress first, RegisterView values) {
  Pdu pdu = write_multiple_response(first, static_cast<std::uint16_t>(values.size()));
  put_counted(pdu.data, values);
  return pdu;
}

Pdu write_coil_request(RegisterAddress address, std::uint16_t value) {
  return words_pdu(FunctionCode::write_single_coil,
                   {address.value, value == 0 ? std::uint16_t{0} : coil_on});
}

Pdu write_coils_request(RegisterAddress first, RegisterView values) {
  Pdu pdu = write_multiple_response(first, static_cast<std::uint16_t>(values.size()),
                                    RegisterTable::coil);
  put_counted_bits(pdu.data, values);
  return pdu;
}

Pdu loopback_request(std::uint16_t word) {
  return words_pdu(FunctionCode::diagnostics, {return_query_data, word});
}

Pdu report_server_id_request() { return words_pdu(FunctionCode::report_server_id, {}); }

tl::expected<Request, ExceptionCode> parse_request(const Pdu& pdu) {
  switch (static_cast<FunctionCode>(pdu.function)) {
    case FunctionCode::read_coils:
      return parse_read(RegisterTable::coil, pdu.data);
    case FunctionCode::read_discrete_inputs:
      return parse_read(RegisterTable::discrete, pdu.data);
    case FunctionCode::write_single_coil:
      return parse_write_coil(pdu.data);
    case FunctionCode::write_multiple_coils:
      return parse_write_coils(pdu.data);
    case FunctionCode::read_holding_registers:
      return parse_read(RegisterTable::holding, pdu.data);
    case FunctionCode::read_input_registers:
      return parse_read(RegisterTable::input, pdu.data);
    case FunctionCode::write_single_register:
      return parse_write_single(pdu.data);
    case FunctionCode::diagnostics:
      return parse_diagnostics(pdu.data);
    case FunctionCode::write_multiple_registers:
      return parse_write_multiple(pdu.data);
    case FunctionCode::report_server_id:
      return parse_report_server_id(pdu.data);
  }
  return refuse(ExceptionCode::illegal_function);
}

Pdu read_response(RegisterTable table, RegisterView registers) {
  Pdu pdu = words_pdu(reader_of(table), {});
  holds_bits(table) ? put_counted_bits(pdu.data, registers) : put_counted(pdu.data, registers);
  return pdu;
}

Pdu write_multiple_response(RegisterAddress first, std::uint16_t count, RegisterTable table) {
  const bool is_coils = table == RegisterTable::coil;
  return words_pdu(
      is_coils ? FunctionCode::write_multiple_coils : FunctionCode::write_multiple_registers,
      {first.value, count});
}

Pdu report_server_id_response(ByteView data) {
  Pdu pdu = words_pdu(FunctionCode::report_server_id, {});
  pdu.data.reserve(1 + data.size());
  pdu.data.push_back(static_cast<std::uint8_t>(data.size()));
  pdu.data.insert(pdu.data.end(), data.begin(), data.end());
  return pdu;
}

Pdu exception_response(std::uint8_t function, std::uint8_t code) {
  return Pdu{.function = static_cast<std::uint8_t>(function | exception_bit), .data = {code}};
}

Fit fit(const Pdu& request, const Pdu& response) {
  if (response.function == (request.function | exception_bit)) {
    return exception_of(response) ? Fit::exception_response : Fit::wrong_shape;
  }
  if (response.function != request.function) return Fit::foreign;
  return answers(request, response) ? Fit::answer : Fit::wrong_shape;
}

Registers registers_of(const Pdu& response) {
  if (response.data.empty()) return {};
  return get_registers(ByteView(response.data).subspan(1));
}

Registers registers_of(const Pdu& request, const Pdu& response) {
  if (!reads_bits(request.function)) return registers_of(response);
  return get_bits(ByteView(response.data).subspan(1), get_u16(request.data, 2));
}

ByteView server_id_of(const Pdu& response) {
  if (response.data.empty()) return {};
  return ByteView(response.data).subspan(1);
}

std::optional<std::uint8_t> exception_of(const Pdu& response) {
  if ((response.function & exception_bit) == 0 || response.data.size() != 1) return std::nullopt;
  return response.data.front();
}

std::string describe_request(const Pdu& request) {
  const auto parsed = parse_request(request);
  if (!parsed) return fmt::format("function 0x{:02X}", request.function);
  return std::visit(Describe{}, *parsed);
}

std::string explain_request(const Pdu& request) {
  const auto parsed = parse_request(request);
  return parsed ? std::visit(Explain(), *parsed) : explain_bytes(request);
}

std::string explain_response(const Pdu& response) {
  if (const auto code = exception_of(response)) {
    const std::string_view name = exception_name(*code);
    return name.empty() ? fmt::format("exception {:02X}", *code)
                        : fmt::format("exception {:02X} ({})", *code, name);
  }
  switch (static_cast<FunctionCode>(response.function)) {
    case FunctionCode::read_holding_registers:
    case FunctionCode::read_input_registers:
      return explain_read(response);
    case FunctionCode::read_coils:
    case FunctionCode::read_discrete_inputs:
      if (is_counted(response)) {
        return fmt::format("bits, the first one on the right: {}",
                           bits_in_words(ByteView(response.data).subspan(1)));
      }
      break;
    case FunctionCode::write_single_coil:
    case FunctionCode::write_multiple_coils:
    case FunctionCode::write_single_register:
    case FunctionCode::write_multiple_registers:
    case FunctionCode::diagnostics:
      return explain_echo(response);
    case FunctionCode::report_server_id:
      if (is_counted(response)) return fmt::format("server id {}", to_hex(server_id_of(response)));
      break;
  }
  return explain_bytes(response);
}

std::string_view exception_name(std::uint8_t code) {
  static constexpr std::array<std::pair<std::uint8_t, std::string_view>, 9> names = {{
      {0x01, "illegal function"},
      {0x02, "illegal data address"},
      {0x03, "illegal data value"},
      {0x04, "server device failure"},
      {0x05, "acknowledge"},
      {0x06, "server device busy"},
      {0x08, "memory parity error"},
      {0x0A, "gateway path unavailable"},
      {0x0B, "gateway target device failed to respond"},
  }};
  for (const auto& [known, name] : names) {
    if (known == code) return name;
  }
  return {};
}

}  // namespace spindle::modbus
