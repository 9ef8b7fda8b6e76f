#include "spindle/link/demux.hpp"

#include <doctest/doctest.h>

#include <optional>
#include <string>
#include <vector>

#include "spindle/modbus/pdu.hpp"
#include "unit/hex.hpp"

using namespace spindle;
using namespace spindle::link;
using modbus::Adu;
using modbus::Framing;
using modbus::Pdu;
using modbus::RegisterTable;
using spindle::test::hex;

namespace {

constexpr std::uint16_t pending = 0x8005;
constexpr std::uint8_t unit = 3;

// bm-bmt.md, section 9: the block 3200-3213 as a tool sends it unasked.
Pdu push() {
  return {0x04, hex("1C 07AA 058D 0001 0834 084F 00EB 0422 018F 05B1 0003 0000 0000 0001 0000")};
}

// The requests that may be outstanding.
const Pdu read_two = modbus::read_request(RegisterTable::holding, {2}, 2);
const Pdu read_thirteen = modbus::read_request(RegisterTable::input, {3200}, 13);
const Pdu read_one = modbus::read_request(RegisterTable::input, {3213}, 1);
const Pdu read_fourteen_holding = modbus::read_request(RegisterTable::holding, {2}, 14);
const Pdu arm = modbus::write_request(modbus::RegisterAddress{4002}, 1);
const Pdu write_many = modbus::write_request(modbus::RegisterAddress{0x0480}, Registers{0, 100});
const Pdu identify = modbus::report_server_id_request();
const Pdu loop = modbus::loopback_request(0x1234);

struct Row {
  std::string_view what;
  std::optional<Pdu> request;
  std::uint16_t transaction;
  std::uint8_t from;
  Pdu received;
  Verdict tcp;
  Verdict rtu;
};

std::vector<Row> rows() {
  using V = Verdict;
  const Pdu two{0x03, hex("04 010F 03E8")};
  return {
      {"the answer", read_two, pending, unit, two, V::answer, V::answer},
      {"the answer to 13", read_thirteen, pending, unit,
       modbus::read_response(RegisterTable::input, Registers(13)), V::answer, V::answer},
      {"the answer of 28 bytes to another function", read_fourteen_holding, pending, unit,
       modbus::read_response(RegisterTable::holding, Registers(14)), V::answer, V::answer},
      {"the echo of a write", arm, pending, unit, arm, V::answer, V::answer},
      {"address and quantity",
       write_many,
       pending,
       unit,
       {0x10, hex("0480 0002")},
       V::answer,
       V::answer},
      {"identity", identify, pending, unit,
       modbus::report_server_id_response(hex("0001 0002 0003 0837 3CDD BF6A")), V::answer,
       V::answer},
      {"the loop-back word", loop, pending, unit, loop, V::answer, V::answer},

      // bm-bmt.md, section 1: answers may carry unit 1 although 0 was asked.
      {"the answer of another unit", read_two, pending, 1, two, V::other_unit, V::stray},
      {"another unit's exception", read_two, pending, 77, {0x83, {2}}, V::other_unit, V::stray},
      {"an answer with an older id", read_two, 0x8004, unit, two, V::stray, V::answer},
      {"an answer with the next id", read_two, 0x8006, unit, two, V::stray, V::answer},
      {"an answer with id 1", read_two, 1, unit, two, V::stray, V::answer},

      {"exception 02",
       read_two,
       pending,
       unit,
       {0x83, {2}},
       V::exception_response,
       V::exception_response},
      {"exception 0C",
       read_two,
       pending,
       unit,
       {0x83, {0x0C}},
       V::exception_response,
       V::exception_response},
      {"exception 0E to a write",
       arm,
       pending,
       unit,
       {0x86, {0x0E}},
       V::exception_response,
       V::exception_response},
      {"an exception with an older id",
       read_two,
       0x8004,
       unit,
       {0x83, {2}},
       V::stray,
       V::exception_response},
      {"an exception to another function",
       read_two,
       pending,
       unit,
       {0x86, {2}},
       V::broken,
       V::stray},
      {"an exception without its code", read_two, pending, unit, {0x83, {}}, V::broken, V::broken},
      {"an exception with two codes",
       read_two,
       pending,
       unit,
       {0x83, {2, 2}},
       V::broken,
       V::broken},

      {"a push while nothing is outstanding", std::nullopt, 1, 0, push(), V::spontaneous,
       V::spontaneous},
      {"a push with id 1", read_two, 1, 0, push(), V::spontaneous, V::spontaneous},
      {"a push with id 0", arm, 0, 0, push(), V::spontaneous, V::spontaneous},
      {"a push with an id of its own", identify, 0x00C7, 0, push(), V::spontaneous, V::spontaneous},
      {"a push with the pending id, FC 03", read_two, pending, unit, push(), V::spontaneous,
       V::spontaneous},
      {"a push with the pending id, FC 03 x 14", read_fourteen_holding, pending, unit, push(),
       V::spontaneous, V::spontaneous},
      {"a push with the pending id, FC 06", arm, pending, unit, push(), V::spontaneous,
       V::spontaneous},
      {"a push with the pending id, FC 11h", identify, pending, unit, push(), V::spontaneous,
       V::spontaneous},
      {"a push with the pending id, FC 04 x 13", read_thirteen, pending, unit, push(),
       V::spontaneous, V::spontaneous},
      {"a push with the pending id, FC 04 x 1", read_one, pending, unit, push(), V::spontaneous,
       V::spontaneous},

      {"another byte count",
       read_two,
       pending,
       unit,
       {0x03, hex("06 010F 03E8 0000")},
       V::broken,
       V::broken},
      {"a smaller byte count",
       read_two,
       pending,
       unit,
       {0x03, hex("02 010F")},
       V::broken,
       V::broken},
      {"a byte count that the data do not have",
       read_two,
       pending,
       unit,
       {0x03, hex("04 010F")},
       V::broken,
       V::broken},
      {"data behind the byte count",
       read_two,
       pending,
       unit,
       {0x03, hex("04 010F 03E8 00")},
       V::broken,
       V::broken},
      {"a byte count of 28 without 28 bytes",
       read_thirteen,
       pending,
       unit,
       {0x04, hex("1C 07AA")},
       V::broken,
       V::broken},
      {"no data at all", read_two, pending, unit, {0x03, {}}, V::broken, V::broken},
      {"the echo of another register",
       arm,
       pending,
       unit,
       {0x06, hex("0FA3 0001")},
       V::broken,
       V::broken},
      {"the echo of another value",
       arm,
       pending,
       unit,
       {0x06, hex("0FA2 0000")},
       V::broken,
       V::broken},
      {"half an echo", arm, pending, unit, {0x06, hex("0FA2")}, V::broken, V::broken},
      {"another quantity",
       write_many,
       pending,
       unit,
       {0x10, hex("0480 0001")},
       V::broken,
       V::broken},
      {"another loop-back word",
       loop,
       pending,
       unit,
       {0x08, hex("0000 1235")},
       V::broken,
       V::broken},
      {"an identity that is shorter than it says",
       identify,
       pending,
       unit,
       {0x11, hex("0C 0001")},
       V::broken,
       V::broken},
      {"the answer to another function",
       read_two,
       pending,
       unit,
       {0x04, hex("04 010F 03E8")},
       V::broken,
       V::stray},

      // bm-bmt.md, section 3: curves.
      {"a foreign function", read_two, 7, unit, {0x65, hex("0102 0304")}, V::stray, V::stray},
      {"a foreign function with the pending id",
       read_two,
       pending,
       unit,
       {0x65, hex("0102 0304")},
       V::broken,
       V::stray},

      {"an answer while nothing is outstanding", std::nullopt, pending, unit, two, V::stray,
       V::stray},
      {"an exception while nothing is outstanding",
       std::nullopt,
       pending,
       unit,
       {0x83, {2}},
       V::stray,
       V::stray},
  };
}

DemuxRules rules(Framing framing) {
  return {.framing = framing, .spontaneous = {{.function = 0x04, .byte_count = 28}}};
}

}  // namespace

TEST_CASE("what a received frame means") {
  for (const Row& row : rows()) {
    CAPTURE(row.what);
    Adu request{{pending}, {unit}, row.request.value_or(Pdu())};
    const Adu* outstanding = row.request ? &request : nullptr;
    const Adu received{{row.transaction}, {row.from}, row.received};
    CHECK(judge(outstanding, received, rules(Framing::tcp)) == row.tcp);
    CHECK(judge(outstanding, received, rules(Framing::rtu)) == row.rtu);
  }
}

TEST_CASE("nothing is spontaneous unless the profile says so") {
  const Adu request{{pending}, {unit}, read_two};
  const DemuxRules none{.framing = Framing::tcp, .spontaneous = {}};
  CHECK(judge(&request, {{1}, {0}, push()}, none) == Verdict::stray);
  CHECK(judge(&request, {{pending}, {0}, push()}, none) == Verdict::broken);
  CHECK(judge(nullptr, {{1}, {0}, push()}, none) == Verdict::stray);
}

TEST_CASE("no frame with a wrong id or of a wrong shape is ever an answer") {
  const Adu request{{pending}, {unit}, read_two};
  for (unsigned function = 0; function < 256; ++function) {
    for (std::size_t size = 0; size <= 40; ++size) {
      Bytes data(size, 0);
      if (size > 0) data[0] = static_cast<std::uint8_t>(size - 1);
      const Pdu pdu{static_cast<std::uint8_t>(function), data};
      const bool fits = function == 0x03 && size == 5;
      const bool refuses = function == 0x83 && size == 1;
      const Verdict same = judge(&request, {{pending}, {unit}, pdu}, rules(Framing::tcp));
      CHECK((same == Verdict::answer) == fits);
      CHECK((same == Verdict::exception_response) == refuses);
      const Verdict other = judge(&request, {{0x8004}, {unit}, pdu}, rules(Framing::tcp));
      CHECK((other == Verdict::stray || other == Verdict::spontaneous));
    }
  }
}

TEST_CASE("tcp: whose answers are taken") {
  struct Row {
    Units units;
    Pdu request;
    Pdu response;
    Verdict verdict;
  };
  const Pdu two = modbus::read_response(RegisterTable::holding, Registers{271, 1000});
  const Pdu identity = modbus::report_server_id_response(hex("0001 0002"));
  const std::vector<Row> rows = {
      {Units::asked, read_two, two, Verdict::other_unit},
      {Units::identified, read_two, two, Verdict::other_unit},
      {Units::any, read_two, two, Verdict::answer},
      {Units::asked, identify, identity, Verdict::other_unit},
      {Units::identified, identify, identity, Verdict::answer},
      {Units::identified, identify, {0x91, {1}}, Verdict::exception_response},
      {Units::any, identify, identity, Verdict::answer},
      {Units::any, read_two, {0x83, {2}}, Verdict::exception_response},
  };
  for (const Row& row : rows) {
    DemuxRules demux = rules(Framing::tcp);
    demux.units = row.units;
    const Adu request{{pending}, {unit}, row.request};
    CHECK(judge(&request, {{pending}, {9}, row.response}, demux) == row.verdict);
  }
}
