#include "spindle/modbus/pdu.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include "unit/hex.hpp"

using namespace spindle;
using namespace spindle::modbus;
using spindle::test::hex;

namespace {

Pdu pdu(std::string_view text) {
  const Bytes bytes = hex(text);
  return Pdu{.function = bytes.front(), .data = Bytes(bytes.begin() + 1, bytes.end())};
}

const Registers two_values{0x0000, 0x03E8};

}  // namespace

TEST_CASE("requests have the bytes of the standard") {
  // 1.1b3, sections 6.3, 6.4, 6.6, 6.8, 6.12 and 6.13
  CHECK(read_request(RegisterTable::holding, {0x006B}, 3) == pdu("03 006B 0003"));
  CHECK(read_request(RegisterTable::input, {0x0008}, 1) == pdu("04 0008 0001"));
  CHECK(write_request(RegisterAddress{0x0001}, std::uint16_t{3}) == pdu("06 0001 0003"));
  CHECK(loopback_request(0xA537) == pdu("08 0000 A537"));
  CHECK(write_request(RegisterAddress{0x0001}, Registers{0x000A, 0x0102}) ==
        pdu("10 0001 0002 04 000A 0102"));
  CHECK(report_server_id_request() == pdu("11"));
}

TEST_CASE("responses have the bytes of the standard") {
  CHECK(read_response(RegisterTable::holding, Registers{0x022B, 0x0000, 0x0064}) ==
        pdu("03 06 022B 0000 0064"));
  CHECK(read_response(RegisterTable::input, Registers{0x000A}) == pdu("04 02 000A"));
  CHECK(write_multiple_response({0x0001}, 2) == pdu("10 0001 0002"));
  CHECK(report_server_id_response(hex("0102 FF")) == pdu("11 03 0102FF"));
  CHECK(exception_response(0x03, 0x02) == pdu("83 02"));
}

TEST_CASE("a server understands what a client builds") {
  const auto read = parse_request(read_request(RegisterTable::input, {3200}, 125));
  REQUIRE(read);
  REQUIRE(std::holds_alternative<ReadRequest>(*read));
  CHECK(std::get<ReadRequest>(*read).table == RegisterTable::input);
  CHECK(std::get<ReadRequest>(*read).first.value == 3200);
  CHECK(std::get<ReadRequest>(*read).count == 125);

  const auto holding = parse_request(read_request(RegisterTable::holding, {65535}, 1));
  REQUIRE(holding);
  CHECK(std::get<ReadRequest>(*holding).table == RegisterTable::holding);

  const auto single = parse_request(write_request(RegisterAddress{4002}, std::uint16_t{0xFFFE}));
  REQUIRE(single);
  REQUIRE(std::holds_alternative<WriteSingleRequest>(*single));
  CHECK(std::get<WriteSingleRequest>(*single).address.value == 4002);
  CHECK(std::get<WriteSingleRequest>(*single).value == 0xFFFE);

  const auto multiple = parse_request(write_request(RegisterAddress{0x0484}, two_values));
  REQUIRE(multiple);
  REQUIRE(std::holds_alternative<WriteMultipleRequest>(*multiple));
  CHECK(std::get<WriteMultipleRequest>(*multiple).first.value == 0x0484);
  CHECK(std::get<WriteMultipleRequest>(*multiple).values == two_values);

  const auto most = parse_request(write_request(RegisterAddress{0}, Registers(123, 7)));
  REQUIRE(most);
  CHECK(std::get<WriteMultipleRequest>(*most).values == Registers(123, 7));

  const auto loopback = parse_request(loopback_request(0x1234));
  REQUIRE(loopback);
  REQUIRE(std::holds_alternative<LoopbackRequest>(*loopback));
  CHECK(std::get<LoopbackRequest>(*loopback).word == 0x1234);

  const auto report = parse_request(report_server_id_request());
  REQUIRE(report);
  CHECK(std::holds_alternative<ReportServerIdRequest>(*report));
}

TEST_CASE("a server refuses what it does not understand") {
  struct Case {
    std::string_view request;
    ExceptionCode code;
  };
  const auto function = ExceptionCode::illegal_function;
  const auto value = ExceptionCode::illegal_data_value;
  for (const auto& row : {
           Case{"07 0000 0001", function},
           Case{"17 0000 0001 0000 0001 02 0000", function},
           Case{"83 02", function},
           Case{"00", function},
           Case{"03", value},
           Case{"03 0000 00", value},
           Case{"03 0000 0001 00", value},
           Case{"03 0000 0000", value},
           Case{"03 0000 007E", value},
           Case{"04 0000 FFFF", value},
           Case{"06 0000", value},
           Case{"06 0000 0001 00", value},
           Case{"08", value},
           Case{"08 0000", value},
           Case{"08 0000 1234 56", value},
           Case{"08 0001 0000", function},
           Case{"08 000A", function},
           Case{"10 0000 0001", value},
           Case{"10 0000 0000 00", value},
           Case{"10 0000 0001 02 00", value},
           Case{"10 0000 0001 02 0000 00", value},
           Case{"10 0000 0002 02 0000", value},
           Case{"10 0000 0001 04 0000 0000", value},
           Case{"10 0000 0101 02 0000", value},  // 257 registers: the byte count fits modulo 256
           Case{"11 00", value},
       }) {
    const auto& [request, code] = row;
    CAPTURE(row.request);
    const auto parsed = parse_request(pdu(request));
    REQUIRE_FALSE(parsed);
    CHECK(parsed.error() == code);
  }
  Pdu too_many = pdu("10 0000 007C F8");
  too_many.data.resize(5 + 0xF8);
  CHECK(parse_request(too_many).error() == value);
}

TEST_CASE("a response is judged by the request") {
  struct Case {
    std::string_view request;
    std::string_view response;
    Fit expected;
  };
  for (const auto& row : {
           // reads: byte count is twice the quantity, and so many bytes are there
           Case{"03 0002 0002", "03 04 010F 03E8", Fit::answer},
           Case{"04 0C80 0001", "04 02 0001", Fit::answer},
           Case{"03 0002 0002", "03 02 010F", Fit::wrong_shape},
           Case{"03 0002 0002", "03 04 010F 03", Fit::wrong_shape},
           Case{"03 0002 0002", "03 04 010F 03E8 00", Fit::wrong_shape},
           Case{"03 0002 0002", "03 05 010F 03E8", Fit::wrong_shape},
           Case{"03 0002 0002", "03", Fit::wrong_shape},
           Case{"03 0002 0002", "04 04 010F 03E8", Fit::foreign},
           // a pushed event is no answer to a shorter read
           Case{"04 0C80 0002",
                "04 1C 07AA 058D 0001 0834 084F 00EB 0422 018F 05B1 0003 0000 0000 0001 0000",
                Fit::wrong_shape},
           // writes: the echo equals what was sent
           Case{"06 0FA2 0001", "06 0FA2 0001", Fit::answer},
           Case{"06 0FA2 0001", "06 0FA2 0000", Fit::wrong_shape},
           Case{"06 0FA2 0001", "06 0FA3 0001", Fit::wrong_shape},
           Case{"06 0FA2 0001", "06 0FA2 00", Fit::wrong_shape},
           Case{"06 0FA2 0001", "06 0FA2 0001 00", Fit::wrong_shape},
           Case{"10 0484 0002 04 0000 03E8", "10 0484 0002", Fit::answer},
           Case{"10 0484 0002 04 0000 03E8", "10 0484 0001", Fit::wrong_shape},
           Case{"10 0484 0002 04 0000 03E8", "10 0485 0002", Fit::wrong_shape},
           Case{"10 0484 0002 04 0000 03E8", "10 0484 0002 04 0000 03E8", Fit::wrong_shape},
           Case{"10 0484 0002 04 0000 03E8", "06 0484 0002", Fit::foreign},
           // loop-back: the same word
           Case{"08 0000 1234", "08 0000 1234", Fit::answer},
           Case{"08 0000 1234", "08 0000 1235", Fit::wrong_shape},
           // identity: any count that fits
           Case{"11", "11 0C 0001 0002 0003 0835 3CDE 0F2A", Fit::answer},
           Case{"11", "11 01 FF", Fit::answer}, Case{"11", "11 00", Fit::wrong_shape},
           Case{"11", "11", Fit::wrong_shape}, Case{"11", "11 03 FF FF", Fit::wrong_shape},
           Case{"11", "11 01 FF FF", Fit::wrong_shape},
           // exceptions: the request's function and exactly one byte
           Case{"03 0002 0002", "83 02", Fit::exception_response},
           Case{"06 0FA2 0001", "86 0E", Fit::exception_response},
           Case{"11", "91 01", Fit::exception_response},
           Case{"03 0002 0002", "84 02", Fit::foreign},
           Case{"03 0002 0002", "83", Fit::wrong_shape},
           Case{"03 0002 0002", "83 02 00", Fit::wrong_shape},
           // other functions
           Case{"03 0002 0002", "64 04 010F 03E8", Fit::foreign},
           Case{"2B 0E", "2B 0E", Fit::answer},  // not spoken here, so any shape
       }) {
    const auto& [request, response, expected] = row;
    CAPTURE(row.request);
    CAPTURE(row.response);
    CHECK(fit(pdu(request), pdu(response)) == expected);
  }
}

TEST_CASE("the values of a fitting response") {
  CHECK(registers_of(pdu("03 04 010F 03E8")) == Registers{271, 1000});
  CHECK(registers_of(read_response(RegisterTable::input, Registers(125, 0xABCD))) ==
        Registers(125, 0xABCD));

  const Pdu identity = report_server_id_response(hex("0001 0203"));
  const ByteView id = server_id_of(identity);
  CHECK(Bytes(id.begin(), id.end()) == hex("0001 0203"));

  CHECK(exception_of(pdu("83 0E")) == 0x0E);
  CHECK(exception_of(exception_response(0x10, 0x02)) == 0x02);
  CHECK_FALSE(exception_of(pdu("03 02")));
  CHECK_FALSE(exception_of(pdu("83")));
  CHECK_FALSE(exception_of(pdu("83 02 00")));
}

TEST_CASE("requests have names for messages") {
  struct Case {
    Pdu request;
    std::string_view text;
  };
  const Case cases[] = {
      {report_server_id_request(), "report server id"},
      {read_request(RegisterTable::holding, {2}, 2), "read 2 holding registers from 2"},
      {read_request(RegisterTable::input, {3200}, 1), "read 1 input register from 3200"},
      {write_request(RegisterAddress{4002}, std::uint16_t{1}), "write register 4002"},
      {write_request(RegisterAddress{1152}, two_values), "write 2 registers from 1152"},
      {write_request(RegisterAddress{1152}, Registers{1}), "write 1 register from 1152"},
      {loopback_request(0x1234), "loop-back"},
      {pdu("2B 0E 01"), "function 0x2B"},
      {pdu("03 00"), "function 0x03"},
  };
  for (const auto& [request, text] : cases) CHECK(describe_request(request) == text);
}

TEST_CASE("standard exception codes have names, others have none") {
  CHECK(exception_name(0x01) == "illegal function");
  CHECK(exception_name(0x02) == "illegal data address");
  CHECK(exception_name(0x0B) == "gateway target device failed to respond");
  for (const std::uint8_t code : hex("00 07 09 0C 0E FF")) {
    CAPTURE(code);
    CHECK(exception_name(code).empty());
  }
}

TEST_CASE("a frame is explained with all that is in it") {
  const RegisterAddress two{2};
  CHECK(explain_request(read_request(RegisterTable::input, two, 1)) ==
        "read 1 input register from 2");
  CHECK(explain_request(write_request({4002}, 1)) == "write 1 to register 4002");
  CHECK(explain_request(write_request({1156}, Registers{0, 1000})) ==
        "write 0 1000 to 2 registers from 1156");
  CHECK(explain_request(loopback_request(0x7E28)) == "loop-back of 7E28");
  CHECK(explain_request(report_server_id_request()) == "report server id");
  CHECK(explain_request({0x2B, {0x0E, 0x01}}) == "function 2B, data 0E 01");

  CHECK(explain_response(read_response(RegisterTable::holding, Registers{271})) ==
        "1 register: 271");
  CHECK(explain_response(read_response(RegisterTable::input, Registers{0, 65535})) ==
        "2 registers: 0 65535");
  CHECK(explain_response(write_request({4002}, 1)) == "wrote 1 to register 4002");
  CHECK(explain_response(write_multiple_response({1156}, 2)) == "wrote 2 registers from 1156");
  CHECK(explain_response(loopback_request(0x7E28)) == "loop-back of 7E28");
  CHECK(explain_response(report_server_id_response(Bytes{0, 1})) == "server id 00 01");
  CHECK(explain_response(exception_response(3, 2)) == "exception 02 (illegal data address)");
  CHECK(explain_response(exception_response(3, 0x0E)) == "exception 0E");
  // Whatever has no shape of these stands there as it came.
  const Pdu shapeless[] = {{3, {}},         {3, {4, 1, 15}}, {4, {3, 1, 2, 3}}, {6, {0, 1}},
                           {16, {0, 1, 0}}, {8, {}},         {17, {9, 1}},      {0x83, {}},
                           {0x83, {1, 2}},  {0x64, {1}}};
  for (const Pdu& pdu : shapeless) {
    CHECK(explain_response(pdu) ==
          fmt::format("function {:02X}, data {}", pdu.function, to_hex(pdu.data)));
  }
}

TEST_CASE("coils and discrete inputs have the bytes of the standard") {
  // 1.1b3, sections 6.1, 6.2, 6.5 and 6.11
  CHECK(read_request(RegisterTable::coil, {0x0013}, 0x13) == pdu("01 0013 0013"));
  CHECK(read_request(RegisterTable::discrete, {0x00C4}, 0x16) == pdu("02 00C4 0016"));
  CHECK(write_coil_request({0x00AC}, 1) == pdu("05 00AC FF00"));
  CHECK(write_coil_request({0x00AC}, 0) == pdu("05 00AC 0000"));
  CHECK(write_coils_request({0x0013}, Registers{1, 0, 1, 1, 0, 0, 1, 1, 1, 0}) ==
        pdu("0F 0013 000A 02 CD01"));
  CHECK(write_multiple_response({0x0013}, 10, RegisterTable::coil) == pdu("0F 0013 000A"));

  const Pdu request = read_request(RegisterTable::coil, {0x0013}, 0x13);
  const Pdu response = pdu("01 03 CD6B05");
  CHECK(fit(request, response) == Fit::answer);
  const Registers coils = registers_of(request, response);
  CHECK(coils == Registers{1, 0, 1, 1, 0, 0, 1, 1, 1, 1, 0, 1, 0, 1, 1, 0, 1, 0, 1});
  CHECK(read_response(RegisterTable::coil, coils) == response);
  for (const char* other : {"01 02 CD6B", "01 04 CD6B0500", "01 03 CD6B", "01", "02 03 CD6B05"}) {
    CAPTURE(std::string(other));
    CHECK(fit(request, pdu(other)) != Fit::answer);
  }
  CHECK(describe_request(request) == "read 19 coils from 19");
  CHECK(describe_request(read_request(RegisterTable::discrete, {7}, 1)) ==
        "read 1 discrete input from 7");
  CHECK(explain_request(write_coil_request({5}, 1)) == "write 1 to coil 5");
  CHECK(explain_request(write_coils_request({5}, Registers{1, 0})) ==
        "write 1 0 to 2 coils from 5");
  CHECK(explain_response(pdu("05 0005 FF00")) == "wrote 1 to coil 5");
  CHECK(explain_response(response) ==
        "bits, the first one on the right: 00000101 01101011 11001101");
}

TEST_CASE("a server refuses requests for coils that the standard does not have") {
  struct Case {
    const char* request;
    ExceptionCode code;
  };
  for (const Case& row : {Case{"01 0000 0000", ExceptionCode::illegal_data_value},
                          Case{"01 0000 07D1", ExceptionCode::illegal_data_value},
                          Case{"01 0000", ExceptionCode::illegal_data_value},
                          Case{"05 0000 0001", ExceptionCode::illegal_data_value},
                          Case{"05 0000 FF", ExceptionCode::illegal_data_value},
                          Case{"0F 0000 000A 01 FF", ExceptionCode::illegal_data_value},
                          Case{"0F 0000 000A 02 FF", ExceptionCode::illegal_data_value},
                          Case{"0F 0000 0000 00", ExceptionCode::illegal_data_value},
                          Case{"0F 0000 07B1 00", ExceptionCode::illegal_data_value}}) {
    CAPTURE(std::string(row.request));
    const auto parsed = parse_request(pdu(row.request));
    REQUIRE_FALSE(parsed);
    CHECK(parsed.error() == row.code);
  }
  const auto most = parse_request(read_request(RegisterTable::discrete, {0}, 2000));
  REQUIRE(most);
  CHECK(std::get<ReadRequest>(*most).table == RegisterTable::discrete);
  const auto coil = parse_request(write_coil_request({9}, 1));
  REQUIRE(coil);
  CHECK(std::get<WriteSingleRequest>(*coil).table == RegisterTable::coil);
  CHECK(std::get<WriteSingleRequest>(*coil).value == 1);
}
