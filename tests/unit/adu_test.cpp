#include "spindle/modbus/adu.hpp"

#include <doctest/doctest.h>

#include <random>
#include <vector>

#include "spindle/modbus/pdu.hpp"
#include "unit/hex.hpp"

using namespace spindle;
using namespace spindle::modbus;
using spindle::test::hex;

namespace {

struct Vector {
  std::string_view source;
  Framing framing;
  Role role;  // who receives it
  std::string_view text;
  Adu adu;
};

Vector query(std::string_view source, std::string_view text, std::uint8_t unit, Pdu pdu) {
  return {source, Framing::rtu, Role::server, text, {{}, {unit}, std::move(pdu)}};
}

Vector reply(std::string_view source, std::string_view text, std::uint8_t unit, Pdu pdu) {
  return {source, Framing::rtu, Role::client, text, {{}, {unit}, std::move(pdu)}};
}

Vector tcp(std::string_view source, Role role, std::string_view text, std::uint16_t transaction,
           std::uint8_t unit, Pdu pdu) {
  return {source, Framing::tcp, role, text, {{transaction}, {unit}, std::move(pdu)}};
}

Pdu read(std::uint16_t first, std::uint16_t count) {
  return read_request(RegisterTable::holding, {first}, count);
}
Pdu values(const Registers& registers) { return read_response(RegisterTable::holding, registers); }
Pdu write(std::uint16_t address, std::uint16_t value) {
  return write_request(RegisterAddress{address}, value);
}
Pdu write_many(std::uint16_t first, const Registers& registers) {
  return write_request(RegisterAddress{first}, registers);
}
Pdu written(std::uint16_t first, std::uint16_t count) {
  return write_multiple_response({first}, count);
}

// BLV: Oriental Motor manual HM-5114-7E. AR: HM-60340, BLH and BLV-R: their RS-485 manuals, of the
// same frame format. "computed": fields of the BLV manual, CRC calculated independently.
std::vector<Vector> rtu_vectors() {
  constexpr std::string_view ar = "AR FLEX manual";
  constexpr std::string_view computed = "computed for BLV";
  return {
      query("BLV manual p.16", "01 03 04 80 00 04 44 D1", 1, read(0x0480, 4)),
      reply("BLV manual p.16", "01 03 08 00 00 00 64 00 00 0F A0 E1 97", 1,
            values({0, 100, 0, 4000})),
      query("BLV manual p.17", "02 06 10 AB 00 32 7D 0C", 2, write(0x10AB, 50)),
      reply("BLV manual p.17, echo", "02 06 10 AB 00 32 7D 0C", 2, write(0x10AB, 50)),

      query(ar, "01 03 04 02 00 04 E4 F9", 1, read(0x0402, 4)),
      reply(ar, "01 03 08 00 00 27 10 FF FF D8 F0 08 A3", 1, values({0, 10000, 0xFFFF, 0xD8F0})),
      query(ar, "02 06 02 4B 00 50 F8 6B", 2, write(0x024B, 80)),
      reply(ar, "02 06 02 4B 00 50 F8 6B", 2, write(0x024B, 80)),
      query(ar, "03 08 00 00 12 34 EC 9E", 3, loopback_request(0x1234)),
      reply(ar, "03 08 00 00 12 34 EC 9E", 3, loopback_request(0x1234)),
      query(ar, "04 10 06 04 00 06 0C 00 00 27 10 00 00 4E 20 00 07 A1 20 1D A9", 4,
            write_many(0x0604, {0, 10000, 0, 20000, 7, 0xA120})),
      reply(ar, "04 10 06 04 00 06 01 17", 4, written(0x0604, 6)),
      query(ar, "01 10 02 42 00 02 04 00 00 03 20 6E 0E", 1, write_many(0x0242, {0, 800})),
      reply(ar, "01 90 04 4D C3", 1, exception_response(0x10, 4)),
      query(ar, "01 10 04 00 00 02 04 00 00 03 E8 C1 D1", 1, write_many(0x0400, {0, 1000})),
      reply(ar, "01 10 04 00 00 02 40 F8", 1, written(0x0400, 2)),
      query(ar, "01 10 04 80 00 02 04 00 00 13 88 C4 59", 1, write_many(0x0480, {0, 5000})),
      reply(ar, "01 10 04 80 00 02 41 10", 1, written(0x0480, 2)),
      query(ar, "01 06 00 7D 00 08 18 14", 1, write(0x007D, 0x0008)),
      query(ar, "01 06 00 7D 00 00 19 D2", 1, write(0x007D, 0x0000)),
      query(ar, "01 06 00 7D 40 00 28 12", 1, write(0x007D, 0x4000)),
      query(ar, "01 06 00 7D 00 10 18 1E", 1, write(0x007D, 0x0010)),

      query("BLH manual",
            "04 10 07 00 00 08 10 00 00 00 C8 00 00 00 64 00 00 00 14 00 00 00 32 A5 48", 4,
            write_many(0x0700, {0, 200, 0, 100, 0, 20, 0, 50})),
      reply("BLH, computed", "04 10 07 00 00 08 C0 EE", 4, written(0x0700, 8)),
      query("BLV-R manual", "01 03 00 F8 00 04 C5 F8", 1, read(0x00F8, 4)),
      reply("BLV-R manual", "01 03 08 00 00 01 7F 00 00 01 AA 00 23", 1,
            values({0, 0x017F, 0, 0x01AA})),
      query("BLV-R manual", "02 06 02 55 00 50 98 6D", 2, write(0x0255, 80)),
      query("BLV-R manual", "04 10 00 5E 00 06 0C 00 00 03 E8 00 00 03 E8 00 00 07 D0 43 C0", 4,
            write_many(0x005E, {0, 1000, 0, 1000, 0, 2000})),
      reply("BLV-R manual", "04 10 00 5E 00 06 21 8C", 4, written(0x005E, 6)),
      query("BLV-R manual", "01 10 00 5E 00 02 04 00 00 01 F4 77 08", 1,
            write_many(0x005E, {0, 500})),

      query(computed, "01 03 00 7E 00 02 A4 13", 1, read(0x007E, 2)),
      query(computed, "01 03 00 CE 00 02 A5 F4", 1, read(0x00CE, 2)),
      reply(computed, "01 03 04 00 00 03 E8 FA 8D", 1, values({0, 1000})),
      reply(computed, "01 03 04 FF FF FC 18 BB 1D", 1, values({0xFFFF, 0xFC18})),
      query(computed, "01 03 00 C8 00 08 C5 F2", 1, read(0x00C8, 8)),
      query(computed, "01 03 00 80 00 10 45 EE", 1, read(0x0080, 16)),
      query(computed, "01 03 04 80 00 10 44 DE", 1, read(0x0480, 16)),
      query(computed, "01 03 04 80 00 11 85 1E", 1, read(0x0480, 17)),
      query(computed, "01 10 04 84 00 02 04 00 00 03 E8 C8 42", 1, write_many(0x0484, {0, 1000})),
      reply(computed, "01 10 04 84 00 02 00 D1", 1, written(0x0484, 2)),
      query(computed, "01 06 04 85 03 E8 99 AD", 1, write(0x0485, 1000)),
      query(computed, "01 10 10 40 00 02 04 00 00 00 01 FB 9F", 1, write_many(0x1040, {0, 1})),
      query(computed, "01 06 01 8D 00 01 D9 DD", 1, write(0x018D, 1)),
      query(computed, "01 06 01 8D 00 00 18 1D", 1, write(0x018D, 0)),
      query(computed, "01 06 01 81 00 01 19 DE", 1, write(0x0181, 1)),
      query(computed, "01 06 01 81 00 00 D8 1E", 1, write(0x0181, 0)),
      query(computed, "01 06 01 93 00 01 B9 DB", 1, write(0x0193, 1)),
      query(computed, "01 06 00 7D 00 2A 98 0D", 1, write(0x007D, 0x2A)),
      query(computed, "01 06 00 7D 00 32 98 07", 1, write(0x007D, 0x32)),
      query(computed, "01 06 00 7D 00 22 99 CB", 1, write(0x007D, 0x22)),
      query(computed, "01 06 00 7D 00 02 98 13", 1, write(0x007D, 0x02)),
      query(computed, "01 06 00 7D 00 28 19 CC", 1, write(0x007D, 0x28)),
      query(computed, "01 06 00 7D 00 30 19 C6", 1, write(0x007D, 0x30)),
      query(computed, "01 06 00 7D 00 20 18 0A", 1, write(0x007D, 0x20)),
      query(computed, "01 10 00 7C 00 02 04 00 00 00 1A 75 15", 1, write_many(0x007C, {0, 0x1A})),
      query(computed, "01 10 00 7C 00 02 04 00 00 00 3A 74 CD", 1, write_many(0x007C, {0, 0x3A})),
      query(computed, "01 10 00 7C 00 02 04 00 00 00 12 74 D3", 1, write_many(0x007C, {0, 0x12})),
      query(computed, "01 10 00 7C 00 02 04 00 00 00 0A 74 D9", 1, write_many(0x007C, {0, 0x0A})),
      reply(computed, "01 10 00 7C 00 02 80 10", 1, written(0x007C, 2)),
      query(computed, "01 10 12 00 00 02 04 00 00 03 E8 27 B1", 1, write_many(0x1200, {0, 1000})),
      query(computed, "01 06 10 E3 00 01 BD 3C", 1, write(0x10E3, 1)),
      query(computed, "02 10 00 30 00 02 04 00 00 00 01 3E 3F", 2, write_many(0x0030, {0, 1})),
      query(computed, "02 10 00 30 00 02 04 FF FF FF FF FE 6B", 2,
            write_many(0x0030, {0xFFFF, 0xFFFF})),
      query(computed, "00 06 00 7D 00 00 18 03", 0, write(0x007D, 0x00)),
      query(computed, "00 06 00 7D 00 20 19 DB", 0, write(0x007D, 0x20)),
      reply(computed, "01 83 01 80 F0", 1, exception_response(0x03, 1)),
      reply(computed, "01 83 02 C0 F1", 1, exception_response(0x03, 2)),
      reply(computed, "01 83 03 01 31", 1, exception_response(0x03, 3)),
      reply(computed, "01 86 03 02 61", 1, exception_response(0x06, 3)),
      reply(computed, "01 86 04 43 A3", 1, exception_response(0x06, 4)),
      reply(computed, "01 88 01 87 C0", 1, exception_response(0x08, 1)),
      reply(computed, "01 90 02 CD C1", 1, exception_response(0x10, 2)),
      reply(computed, "01 90 03 0C 01", 1, exception_response(0x10, 3)),
      reply(computed, "01 90 04 4D C3", 1, exception_response(0x10, 4)),
  };
}

// DOGA manual 60427-10/21, sections 2 and 3, with transaction ids as spindle uses them.
std::vector<Vector> tcp_vectors() {
  constexpr std::string_view doga = "DOGA manual 60427";
  const Registers event{1962, 1421, 1, 2100, 2127, 235, 1058, 399, 1457, 3, 0, 0, 1, 0};
  return {
      tcp(doga, Role::server, "8001 0000 0002 00 11", 0x8001, 0, report_server_id_request()),
      tcp(doga, Role::server, "8002 0000 0006 00 03 0002 0002", 0x8002, 0, read(2, 2)),
      tcp(doga, Role::client, "8002 0000 0007 00 03 04 010F 03E8", 0x8002, 0, values({271, 1000})),
      tcp(doga, Role::server, "8004 0000 0006 00 06 0FA2 0001", 0x8004, 0, write(4002, 1)),
      tcp(doga, Role::client, "8004 0000 0006 01 06 0FA2 0001", 0x8004, 1, write(4002, 1)),
      tcp(doga, Role::client, "8005 0000 0003 00 83 02", 0x8005, 0, exception_response(0x03, 2)),
      tcp(doga, Role::client,
          "0001 0000 001F 00 04 1C 07AA 058D 0001 0834 084F 00EB 0422 018F 05B1 0003 0000 0000 "
          "0001 0000",
          1, 0, read_response(RegisterTable::input, event)),
  };
}

std::vector<Vector> all_vectors() {
  std::vector<Vector> vectors = rtu_vectors();
  for (Vector& vector : tcp_vectors()) vectors.push_back(std::move(vector));
  return vectors;
}

Bytes operator+(Bytes left, ByteView right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

bool needs_more(const Deframing& result) { return std::holds_alternative<NeedMore>(result); }
bool is_junk(const Deframing& result) { return std::holds_alternative<Junk>(result); }

void check_frame(const Deframing& result, const Adu& adu, std::size_t skipped, std::size_t size) {
  const auto* found = std::get_if<Deframed>(&result);
  REQUIRE(found != nullptr);
  CHECK(found->adu == adu);
  CHECK(found->skipped == skipped);
  CHECK(found->consumed == skipped + size);
}

// The same numbers in every run.
class Dice {
 public:
  std::size_t up_to(std::size_t maximum) {
    return std::uniform_int_distribution<std::size_t>(0, maximum)(engine_);
  }
  std::uint8_t byte() { return static_cast<std::uint8_t>(up_to(0xFF)); }
  std::uint16_t word() { return static_cast<std::uint16_t>(up_to(0xFFFF)); }
  Bytes bytes(std::size_t count) {
    Bytes result(count);
    for (auto& item : result) item = byte();
    return result;
  }
  Registers registers(std::size_t count) {
    Registers result(count);
    for (auto& item : result) item = word();
    return result;
  }

 private:
  std::mt19937 engine_{20221122};
};

Pdu any_request(Dice& dice) {
  const auto count = static_cast<std::uint16_t>(1 + dice.up_to(max_read_count - 1));
  switch (dice.up_to(5)) {
    case 0:
      return read_request(RegisterTable::holding, {dice.word()}, count);
    case 1:
      return read_request(RegisterTable::input, {dice.word()}, count);
    case 2:
      return write_request(RegisterAddress{dice.word()}, dice.word());
    case 3:
      return loopback_request(dice.word());
    case 4:
      return write_request(RegisterAddress{dice.word()},
                           dice.registers(1 + dice.up_to(max_write_count - 1)));
    default:
      return report_server_id_request();
  }
}

Pdu any_response(Dice& dice) {
  const std::size_t count = 1 + dice.up_to(max_read_count - 1);
  switch (dice.up_to(6)) {
    case 0:
      return read_response(RegisterTable::holding, dice.registers(count));
    case 1:
      return read_response(RegisterTable::input, dice.registers(count));
    case 2:
      return write_request(RegisterAddress{dice.word()}, dice.word());
    case 3:
      return loopback_request(dice.word());
    case 4:
      return write_multiple_response({dice.word()}, static_cast<std::uint16_t>(count));
    case 5:
      return report_server_id_response(dice.bytes(1 + dice.up_to(max_pdu_size - 3)));
    default:
      return exception_response(0x03, dice.byte());
  }
}

Adu any_adu(Dice& dice, Framing framing, Role role) {
  const TransactionId transaction{framing == Framing::tcp ? dice.word() : std::uint16_t{0}};
  const UnitId unit{dice.byte()};
  return {transaction, unit, role == Role::server ? any_request(dice) : any_response(dice)};
}

}  // namespace

TEST_CASE("golden vectors are produced byte for byte") {
  for (const auto& row : all_vectors()) {
    const auto& [source, framing, role, text, adu] = row;
    CAPTURE(row.source);
    CAPTURE(row.text);
    CHECK(to_compact_hex(frame(framing, adu)) == to_compact_hex(hex(text)));
  }
}

TEST_CASE("golden vectors are understood, cut at every byte") {
  for (const auto& row : all_vectors()) {
    const auto& [source, framing, role, text, adu] = row;
    CAPTURE(row.source);
    CAPTURE(row.text);
    const Bytes bytes = hex(text);
    for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
      CAPTURE(cut);
      CHECK(needs_more(deframe(framing, role, ByteView(bytes).first(cut))));
    }
    check_frame(deframe(framing, role, bytes), adu, 0, bytes.size());
  }
}

TEST_CASE("of glued frames the first is taken") {
  for (const auto& row : all_vectors()) {
    const auto& [source, framing, role, text, adu] = row;
    CAPTURE(row.text);
    const Bytes bytes = hex(text);
    const Bytes glued = bytes + bytes;
    for (std::size_t cut = bytes.size(); cut <= glued.size(); ++cut) {
      check_frame(deframe(framing, role, ByteView(glued).first(cut)), adu, 0, bytes.size());
    }
  }
}

TEST_CASE("what is framed is deframed, in both framings and roles") {
  Dice dice;
  for (const Framing framing : {Framing::tcp, Framing::rtu}) {
    for (const Role role : {Role::client, Role::server}) {
      for (int round = 0; round < 2000; ++round) {
        const Adu adu = any_adu(dice, framing, role);
        const Bytes bytes = frame(framing, adu);
        CAPTURE(to_hex(bytes));
        REQUIRE(bytes.size() <= max_adu_size);
        check_frame(deframe(framing, role, bytes + dice.bytes(dice.up_to(8))), adu, 0,
                    bytes.size());
      }
    }
  }
}

TEST_CASE("any bytes make progress") {
  Dice dice;
  for (int round = 0; round < 4000; ++round) {
    const Framing framing = dice.up_to(1) == 0 ? Framing::tcp : Framing::rtu;
    const Role role = dice.up_to(1) == 0 ? Role::client : Role::server;
    const Bytes bytes = dice.bytes(dice.up_to(400));
    CAPTURE(to_hex(bytes));
    const Deframing result = deframe(framing, role, bytes);
    if (const auto* found = std::get_if<Deframed>(&result)) {
      CHECK(found->skipped < found->consumed);
      CHECK(found->consumed <= bytes.size());
    } else if (const auto* junk = std::get_if<Junk>(&result)) {
      CHECK(junk->size > 0);
      CHECK(junk->size <= bytes.size());
      CHECK_FALSE(junk->reason.empty());
    } else {
      CHECK(bytes.size() <= max_adu_size);
    }
  }
}

TEST_CASE("an MBAP header that cannot be is junk as soon as it shows") {
  struct Case {
    std::string_view bytes;
    bool junk;
  };
  for (const auto& row : {
           Case{"8001 01", true},  // protocol 0100h
           Case{"8001 0100 0002 00 11", true},
           Case{"8001 FF", true},
           Case{"8001 0000 0000", true},  // length 0, 1, 255, 65535
           Case{"8001 0000 0001 00", true},
           Case{"8001 0000 00FF",
                false},  // a function whose data begin with their length may follow
           Case{"8001 0000 00FF 00 03", true},
           Case{"8001 0000 00FF 00 64 00", false},
           Case{"8001 0000 00FF 00 64 00FA", true},
           Case{"8001 0000 FFFF", true},
           Case{"8001 0000 0002", false},
           Case{"8001 0000 00FE", false},
           Case{"8001 0000 00", false},
           Case{"8001 0012", false},
           Case{"", false},
       }) {
    const auto& [bytes, junk] = row;
    CAPTURE(row.bytes);
    const Deframing result = deframe(Framing::tcp, Role::client, hex(bytes));
    CHECK(is_junk(result) == junk);
    CHECK(needs_more(result) == !junk);
  }
}

TEST_CASE("a protocol identifier with a low byte is accepted and reported") {
  const Deframing result =
      deframe(Framing::tcp, Role::client, hex("8002 0012 0007 00 03 04 010F 03E8"));
  check_frame(result, Adu{{0x8002}, {0}, values({271, 1000})}, 0, 13);
  CHECK(std::get<Deframed>(result).protocol == 0x0012);

  const Deframing plain = deframe(Framing::tcp, Role::client, hex("8005 0000 0003 00 83 02"));
  CHECK(std::get<Deframed>(plain).protocol == 0);
}

TEST_CASE("on TCP the length field alone ends a frame, whatever the function") {
  const Adu curve{{7}, {0}, {.function = 0x64, .data = Bytes(252, 0x5A)}};
  const Bytes bytes = frame(Framing::tcp, curve);
  CHECK(bytes.size() == max_adu_size);
  check_frame(deframe(Framing::tcp, Role::client, bytes), curve, 0, bytes.size());
}

TEST_CASE("noise before an RTU frame is skipped") {
  for (const std::string_view noise : {
           "00",
           "FF",
           "00 00 00",
           "FF FF FF FF",
           "01",                    // might be the unit
           "01 03",                 // might be a reply without its count yet
           "01 03 FA",              // looks like the start of 255 bytes
           "01 10 00 00 00 7B F6",  // looks like a request of 255 bytes
           "01 11 20 55",           // looks like an identity of 37 bytes
           "01 03 08 00 00 00 64",  // a reply that broke off
           "01 83 02 C0 F0",        // an exception with a bad CRC
           "01 06 00 7D 00 00 19 D3",
       }) {
    const Bytes before = hex(noise);
    for (const auto& row : rtu_vectors()) {
      const auto& [source, framing, role, text, adu] = row;
      CAPTURE(noise);
      CAPTURE(row.text);
      const Bytes bytes = hex(text);
      const Bytes noisy = before + bytes;
      for (std::size_t cut = 0; cut < noisy.size(); ++cut) {
        CHECK(needs_more(deframe(framing, role, ByteView(noisy).first(cut))));
      }
      check_frame(deframe(framing, role, noisy), adu, before.size(), bytes.size());
    }
  }
}

TEST_CASE("a damaged RTU frame is never taken") {
  for (const auto& row : rtu_vectors()) {
    const auto& [source, framing, role, text, adu] = row;
    CAPTURE(row.text);
    const Bytes good = hex(text);
    for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
      Bytes bad = good;
      bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
      CAPTURE(bit);
      CHECK(needs_more(deframe(framing, role, bad)));
    }
  }
}

TEST_CASE("RTU functions of unknown length and impossible counts start no frame") {
  const auto sealed = [](std::uint8_t function, Bytes data) {
    return frame(Framing::rtu, {{}, {0xFE}, {.function = function, .data = std::move(data)}});
  };
  struct Case {
    Role role;
    Bytes bytes;
  };
  const Case cases[] = {
      {Role::client, sealed(0x2B, hex("0E 01 00 00"))},
      {Role::client, sealed(0xAB, hex("01"))},           // exception to 2Bh, never asked
      {Role::client, sealed(0x03, hex("03 AA BB CC"))},  // odd byte count
      {Role::client, sealed(0x03, hex("FC") + Bytes(252, 0xAA))},
      {Role::client, sealed(0x11, hex("FC") + Bytes(252, 0xAA))},
      {Role::server, sealed(0x83, hex("02"))},
      {Role::server, sealed(0x17, hex("00 00 00 00"))},
      {Role::server, sealed(0x10, hex("00 00 00 01 03 AA BB CC"))},
  };
  for (const auto& row : cases) {
    const auto& [role, bytes] = row;
    CAPTURE(to_hex(row.bytes));
    CHECK_FALSE(std::holds_alternative<Deframed>(deframe(Framing::rtu, role, bytes)));
  }
}

TEST_CASE("the largest RTU frames are 255 and 256 bytes") {
  const Adu read_all{{}, {1}, values(Registers(125, 0xA5A5))};
  const Bytes bytes = frame(Framing::rtu, read_all);
  CHECK(bytes.size() == 255);
  check_frame(deframe(Framing::rtu, Role::client, bytes), read_all, 0, 255);

  const Adu identity{{}, {1}, report_server_id_response(Bytes(251, 0xA5))};
  const Bytes longest = frame(Framing::rtu, identity);
  CHECK(longest.size() == 256);
  check_frame(deframe(Framing::rtu, Role::client, longest), identity, 0, 256);
}

TEST_CASE("more than 256 bytes without a frame are junk, but not a frame's beginning") {
  const Adu adu{{}, {1}, values({0, 1000})};
  const Bytes good = frame(Framing::rtu, adu);
  // The second looks like the start of a 255 byte frame at every third byte.
  for (const std::string_view pattern : {"55 55 55", "01 03 FA"}) {
    CAPTURE(pattern);
    Bytes noise;
    while (noise.size() < 256) noise = noise + hex(pattern);
    noise.resize(256);
    CHECK(needs_more(deframe(Framing::rtu, Role::client, noise)));

    for (std::size_t part = 1; part < good.size(); ++part) {
      CAPTURE(part);
      Bytes buffered = noise + ByteView(good).first(part);
      const Deframing result = deframe(Framing::rtu, Role::client, buffered);
      REQUIRE(is_junk(result));
      const std::size_t dropped = std::get<Junk>(result).size;
      REQUIRE(dropped > 0);
      REQUIRE(dropped <= noise.size());
      buffered.erase(buffered.begin(), buffered.begin() + static_cast<std::ptrdiff_t>(dropped));
      CHECK(buffered.size() <= 256);
      check_frame(deframe(Framing::rtu, Role::client, buffered + ByteView(good).subspan(part)), adu,
                  noise.size() - dropped, good.size());
    }
  }
}
