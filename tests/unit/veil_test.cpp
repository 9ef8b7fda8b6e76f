#include "spindle/link/veil.hpp"

#include <doctest/doctest.h>

#include "unit/hex.hpp"

using namespace spindle;
using link::Veil;
using modbus::Framing;
using modbus::RegisterTable;
using spindle::test::hex;

namespace {

modbus::Adu adu_of(const modbus::Pdu& pdu) { return {{0x8001}, {0}, pdu}; }

/// A password in 3705, of which nothing was asked yet.
Veil veil() {
  Veil made;
  made.hide({{RegisterTable::holding, 3705, 1}});
  return made;
}

const modbus::Pdu read_around = modbus::read_request(RegisterTable::holding, {3704}, 3);
const Bytes around = hex("8001 0000 0009 01 03 06 0001 1267 0003");
const Bytes around_veiled = hex("8001 0000 0009 01 03 06 0001 0000 0003");

}  // namespace

TEST_CASE("what has nothing to do with a secret is shown as it came") {
  Veil made = veil();
  const Bytes half = hex("8001 0000 00");
  made.request(Framing::tcp, adu_of(modbus::read_request(RegisterTable::holding, {3706}, 2)));
  CHECK(made.received(Framing::tcp, half) == half);
  made.request(Framing::tcp, adu_of(modbus::read_request(RegisterTable::input, {3705}, 1)));
  CHECK(made.received(Framing::tcp, half) == half);
  CHECK_FALSE(made.is_drawn());
  CHECK(made.rest().empty());
}

TEST_CASE("a secret among other registers is shown as 0") {
  Veil made = veil();
  made.request(Framing::tcp, adu_of(read_around));
  CHECK(made.is_drawn());
  CHECK(made.received(Framing::tcp, around) == around_veiled);
}

TEST_CASE("an answer in pieces is shown when it is whole, and never the piece with the secret") {
  for (std::size_t cut = 1; cut < around.size(); ++cut) {
    CAPTURE(cut);
    Veil made = veil();
    made.request(Framing::tcp, adu_of(read_around));
    CHECK(made.received(Framing::tcp, ByteView(around).first(cut)).empty());
    CHECK(made.received(Framing::tcp, ByteView(around).subspan(cut)) == around_veiled);
  }
  Veil torn = veil();
  torn.request(Framing::tcp, adu_of(read_around));
  CHECK(torn.received(Framing::tcp, ByteView(around).first(13)).empty());
  CHECK(torn.rest() == Bytes(13, 0));
}

TEST_CASE("an answer that comes late or twice is known") {
  Veil made = veil();
  made.request(Framing::tcp, adu_of(read_around));
  made.request(Framing::tcp, adu_of(modbus::read_request(RegisterTable::holding, {1}, 1)));
  CHECK(made.received(Framing::tcp, around) == around_veiled);
  CHECK(made.received(Framing::tcp, around) == around_veiled);
}

TEST_CASE("an answer of another length than was asked for shows no register") {
  Veil made = veil();
  made.request(Framing::tcp, adu_of(read_around));
  CHECK(made.received(Framing::tcp, hex("8001 0000 000B 01 03 08 0001 1267 0003 0004")) ==
        hex("8001 0000 000B 01 03 08 0000 0000 0000 0000"));
}

TEST_CASE("a frame that nothing asked for stays as it is") {
  Veil made = veil();
  made.request(Framing::tcp, adu_of(read_around));
  const Bytes event = hex("0001 0000 0007 00 04 04 0001 0002");
  Bytes both = event;
  both.insert(both.end(), around.begin(), around.end());
  Bytes shown = event;
  shown.insert(shown.end(), around_veiled.begin(), around_veiled.end());
  CHECK(made.received(Framing::tcp, both) == shown);
}

TEST_CASE("a secret that is written is shown neither in the request nor in its echo") {
  Veil made = veil();
  const modbus::Pdu one = modbus::write_request({3705}, std::uint16_t{1234});
  CHECK(made.request(Framing::tcp, adu_of(one)) == hex("8001 0000 0006 00 06 0E79 0000"));
  CHECK(made.received(Framing::tcp, hex("8001 0000 0006 01 06 0E79 04D2")) ==
        hex("8001 0000 0006 01 06 0E79 0000"));
  const Registers words = {7, 1234, 9};
  const modbus::Pdu many = modbus::write_request({3704}, RegisterView(words));
  CHECK(made.request(Framing::tcp, adu_of(many)) ==
        hex("8001 0000 000D 00 10 0E78 0003 06 0007 0000 0009"));
}

TEST_CASE("on a serial line the checksum does not tell the secret") {
  Veil made = veil();
  made.request(Framing::rtu, adu_of(read_around));
  const modbus::Adu answer{
      {}, {1}, modbus::read_response(RegisterTable::holding, Registers{1, 4711, 3})};
  const modbus::Adu shown{
      {}, {1}, modbus::read_response(RegisterTable::holding, Registers{1, 0, 3})};
  CHECK(made.received(Framing::rtu, modbus::frame(Framing::rtu, answer)) ==
        modbus::frame(Framing::rtu, shown));
}
