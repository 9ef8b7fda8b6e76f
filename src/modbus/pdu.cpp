#include "spindle/modbus/pdu.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <utility>

namespace spindle::modbus {
namespace {

constexpr std::uint16_t return_query_data = 0x0000;  // FC 08 sub-function, 1.1b3, 6.8.1

constexpr std::uint8_t code_of(FunctionCode function) {
  return static_cast<std::uint8_t>(function);
}

constexpr FunctionCode reader_of(RegisterTable table) {
  return table == RegisterTable::holding ? FunctionCode::read_holding_registers
                                         : FunctionCode::read_input_registers;
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
  if (count == 0 || count > max_read_count) return refuse(ExceptionCode::illegal_data_value);
  return ReadRequest{.table = table, .first = {get_u16(data, 0)}, .count = count};
}

Parsed parse_write_single(ByteView data) {
  if (data.size() != 4) return refuse(ExceptionCode::illegal_data_value);
  return WriteSingleRequest{.address = {get_u16(data, 0)}, .value = get_u16(data, 2)};
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
    case FunctionCode::write_single_register:
    case FunctionCode::diagnostics:
      return request.data == response.data;
    case FunctionCode::write_multiple_registers:
      return answers_write_multiple(request.data, response.data);
    case FunctionCode::report_server_id:
      return answers_report_server_id(response.data);
  }
  return false;
}

std::string_view plural(std::size_t count) { return count == 1 ? "" : "s"; }

struct Describe {
  std::string operator()(const ReadRequest& read) const {
    return fmt::format("read {} {} register{} from {}", read.count, to_text(read.table),
                       plural(read.count), read.first.value);
  }
  std::string operator()(const WriteSingleRequest& write) const {
    return fmt::format("write register {}", write.address.value);
  }
  std::string operator()(const WriteMultipleRequest& write) const {
    return fmt::format("write {} register{} from {}", write.values.size(),
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
    return fmt::format("write {} to register {}", write.value, write.address.value);
  }
  std::string operator()(const WriteMultipleRequest& write) const {
    return fmt::format("write {} to {} register{} from {}", fmt::join(write.values, " "),
                       write.values.size(), plural(write.values.size()), write.first.value);
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

/// Responses that are the echo of their request, or of its beginning.
std::string explain_echo(const Pdu& response) {
  if (response.data.size() != 4) return explain_bytes(response);
  const std::uint16_t first = get_u16(response.data, 0);
  const std::uint16_t second = get_u16(response.data, 2);
  switch (static_cast<FunctionCode>(response.function)) {
    case FunctionCode::write_single_register:
      return fmt::format("wrote {} to register {}", second, first);
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

Pdu loopback_request(std::uint16_t word) {
  return words_pdu(FunctionCode::diagnostics, {return_query_data, word});
}

Pdu report_server_id_request() { return words_pdu(FunctionCode::report_server_id, {}); }

tl::expected<Request, ExceptionCode> parse_request(const Pdu& pdu) {
  switch (static_cast<FunctionCode>(pdu.function)) {
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
  put_counted(pdu.data, registers);
  return pdu;
}

Pdu write_multiple_response(RegisterAddress first, std::uint16_t count) {
  return words_pdu(FunctionCode::write_multiple_registers, {first.value, count});
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
