// A peer on a serial line: what is heard, when it is answered, and how it misbehaves.
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "hex.hpp"
#include "spindle/link/session.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/sim/peer.hpp"
#include "spindle/sim/sim_transport.hpp"
#include "support/fake_clock.hpp"
#include "support/fault_plan.hpp"
#include "support/serial_bank.hpp"

using namespace spindle;
using namespace spindle::sim;
using namespace std::chrono_literals;
using modbus::Framing;
using spindle::test::FakeClock;
using spindle::test::hex;
using spindle::test::plan_of;
using spindle::test::SerialBank;

namespace {

constexpr TimePoint start = TimePoint(1h);
constexpr Duration gap = 5500us;
constexpr Duration delay = 10ms;

// A bus with units 1 and 2 and one client.
struct Bus {
  explicit Bus(const std::vector<std::string>& faults = {}, const LineModel& line = {})
      : plan(plan_of(faults)), peer(bank, {1}, Framing::rtu, plan, counter, line) {}

  // All that is said, each with its time.
  std::string answers() {
    std::string text;
    while (const auto due = peer.next_due()) {
      const Bytes piece = peer.take(*due);
      if (peer.closed(*due)) return text + "closed; ";
      if (piece.empty()) continue;
      const auto us = std::chrono::duration_cast<std::chrono::microseconds>(*due - start).count();
      text += std::to_string(us) + ": " + to_hex(piece) + "; ";
    }
    return text;
  }

  SerialBank bank{{.units = {{1}, {2}}, .gap = gap, .delay = delay}};
  FaultPlan plan;
  AnswerCounter counter;
  Peer peer;
};

// "01 03 04 80 00 02" and what unit 1 answers, with their checksums (computed apart).
const Bytes read_two = hex("01 03 0480 0002 C4D3");
const std::string two_words = "01 03 04 04 80 04 81 38 4B";
const Bytes loopback_to_2 = hex("02 08 0000 1234 ED4F");

}  // namespace

TEST_CASE("serial peer: an answer comes behind the gap and the driver's own delay") {
  Bus bus;
  bus.peer.receive(read_two, start);
  CHECK(bus.answers() == "15500: " + two_words + "; ");
  bus.peer.receive(loopback_to_2, start + 30ms);
  CHECK(bus.answers() == "45500: " + to_hex(loopback_to_2) + "; ");
}

TEST_CASE("serial peer: what silence has parted stays apart, however late it is looked at") {
  Bus bus;
  bus.peer.receive(read_two, start);
  bus.peer.receive(loopback_to_2, start + 30ms);
  CHECK(bus.answers() == "15500: " + two_words + "; 45500: " + to_hex(loopback_to_2) + "; ");
  CHECK(bus.bank.bad_frames == 0);
}

TEST_CASE("serial peer: bytes take their time in both directions") {
  Bus bus({}, {.character_time = 1ms});
  bus.peer.receive(read_two, start);
  CHECK(bus.answers() == "32500: " + two_words + "; ");  // 8 + 5.5 + 10 + 9 ms

  Bus deaf_to_nothing({}, {.character_time = 1ms, .gaps = LineModel::Gaps::ignored});
  deaf_to_nothing.peer.receive(read_two, start);
  CHECK(deaf_to_nothing.answers() == "27000: " + two_words + "; ");
}

TEST_CASE("serial peer: a query within the gap is not heard, nor is it a bad frame") {
  for (const Duration after : {Duration(0us), Duration(1ms), gap - 1us}) {
    CAPTURE(after.count());
    Bus bus;
    bus.peer.receive(read_two, start);
    REQUIRE(bus.answers() == "15500: " + two_words + "; ");
    bus.peer.receive(read_two, start + 15500us + after);
    CHECK(bus.answers().empty());
    CHECK(bus.bank.queries == 1);
    CHECK(bus.bank.bad_frames == 0);
  }
  Bus bus;
  bus.peer.receive(read_two, start);
  REQUIRE_FALSE(bus.answers().empty());
  bus.peer.receive(read_two, start + 15500us + gap);
  CHECK(bus.answers() == "36500: " + two_words + "; ");

  Bus generic({}, {.gaps = LineModel::Gaps::ignored});
  generic.peer.receive(read_two, start);
  generic.peer.receive(read_two, start);
  CHECK(generic.answers() == "10000: " + two_words + "; 10000: " + two_words + "; ");
}

TEST_CASE("serial peer: what is no frame is told to the server and gets no answer") {
  struct Row {
    std::string_view what;
    std::vector<Bytes> bursts;
    int bad;
  };
  Bytes flipped = read_two;
  flipped.back() ^= 1U;
  Bytes noisy = read_two;
  noisy.insert(noisy.begin(), 0xFF);
  Bytes glued = read_two;
  glued.insert(glued.end(), read_two.begin(), read_two.end());
  const Bytes head(read_two.begin(), read_two.begin() + 4);
  const Bytes tail(read_two.begin() + 4, read_two.end());
  for (const Row& row :
       {Row{"a wrong checksum", {flipped}, 1}, Row{"noise before it", {noisy}, 1},
        Row{"two frames without silence between", {glued}, 1}, Row{"a byte", {hex("01")}, 1},
        Row{"a torn frame", {head, tail}, 2}, Row{"more than a frame can be", {Bytes(300, 1)}, 1},
        Row{"three in a row", {flipped, noisy, head}, 3}}) {
    CAPTURE(row.what);
    Bus bus;
    TimePoint now = start;
    for (const Bytes& burst : row.bursts) {
      bus.peer.receive(burst, now);
      CHECK(bus.answers().empty());
      now += 20ms;
    }
    CHECK(bus.bank.bad_frames == row.bad);
    CHECK(bus.bank.queries == 0);
    bus.peer.receive(read_two, now);  // and then all is as before
    CHECK_FALSE(bus.answers().empty());
  }
  Bus generic({}, {.gaps = LineModel::Gaps::ignored});
  generic.peer.receive(head, start);
  generic.peer.receive(read_two, start + 51ms);
  CHECK(generic.bank.bad_frames == 1);
  CHECK(generic.bank.queries == 1);
}

TEST_CASE("serial peer: silence tells where a frame ends, so an unknown function is refused") {
  Bus bus;
  bus.peer.receive(hex("01 11 C02C"), start);
  CHECK(bus.answers() == "15500: 01 91 01 8C 50; ");
  bus.peer.receive(hex("01 65 00 0B50"), start + 30ms);
  CHECK(bus.answers() == "45500: 01 E5 01 AB 50; ");
  CHECK(bus.bank.bad_frames == 0);
}

TEST_CASE(
    "serial peer: other units and broadcasts are not answered, and broadcasts are carried out") {
  Bus bus;
  bus.peer.receive(hex("03 03 0480 0002 C531"), start);
  CHECK(bus.answers().empty());
  bus.peer.receive(hex("00 06 007D 0020 19DB"), start + 20ms);  // BLV, computed: decelerating stop
  CHECK(bus.answers().empty());
  CHECK(bus.bank.word({1}, 0x7D) == 0x20);
  CHECK(bus.bank.word({2}, 0x7D) == 0x20);
  CHECK(bus.bank.bad_frames == 0);
  CHECK(bus.counter.value == 0);
}

TEST_CASE("serial peer: the faults of a bus") {
  struct Row {
    std::vector<std::string> faults;
    std::string answers;
  };
  const std::string query = to_hex(read_two);
  for (const Row& row : std::vector<Row>{
           {{"echo"}, "0: " + query + "; 15500: " + two_words + "; "},
           {{"echo", "lost"}, "0: " + query + "; "},
           {{"foreign"}, "15500: 4E 03 04 04 80 04 80 47 4F " + two_words + "; "},
           {{"foreign=2"}, "15500: 02 03 04 04 80 04 80 CA 8B " + two_words + "; "},
           {{"latency=5ms"}, "20500: " + two_words + "; "},
           {{"half"}, "15500: 01 03 04 04; "},
           {{"split=5"}, "15500: 01 03 04 04 80; 16500: 04 81 38 4B; "},
           {{"close"}, "closed; "},
       }) {
    CAPTURE(row.answers);
    Bus bus(row.faults);
    bus.peer.receive(read_two, start);
    CHECK(bus.answers() == row.answers);
  }
}

TEST_CASE("serial peer: with the session of a client, in process") {
  for (const unsigned baud : {9600U, 115200U}) {
    CAPTURE(baud);
    const Duration quiet = baud > 19200 ? Duration(3500us) : gap;
    const Duration character = Duration(11s) / baud;
    FakeClock clock;
    const Interrupt never;
    link::Session session(
        make_sim_transport(std::make_unique<SerialBank>(SerialBank::Options{.gap = quiet}),
                           Framing::rtu, {}, clock, never, {.character_time = character}),
        clock,
        {.rules = {.framing = Framing::rtu, .spontaneous = {}},
         .unit = {1},
         .answer_timeout = 500ms,
         .gap = quiet,
         .broadcast_gap = quiet + 5ms,
         .character_time = character,
         .echo = link::LocalEcho::absent});
    using modbus::RegisterTable;
    const TimePoint began = clock.now();
    for (std::uint16_t turn = 0; turn < 250; ++turn) {
      const auto read = session.transact(modbus::read_request(RegisterTable::holding, {turn}, 16));
      REQUIRE(read);
      CHECK(modbus::registers_of(*read).front() == turn);
      REQUIRE(session.transact(modbus::write_request(modbus::RegisterAddress{0x1000}, turn)));
      REQUIRE(session.transact(modbus::loopback_request(turn)));
      const Registers two = {turn, 7};
      REQUIRE(session.transact(modbus::write_request(modbus::RegisterAddress{0x1002}, two)));
      REQUIRE(session.broadcast(modbus::write_request(modbus::RegisterAddress{0x1004}, turn)));
    }
    CHECK(session.counters().strays == 0);
    // Nothing but wire time, gaps, delays and the tenth of a millisecond of a simulated answer.
    const Duration wire = character * (8 + 37 + 8 + 8 + 8 + 8 + 13 + 8 + 8);
    const Duration silences = 4 * (2 * quiet + 10ms + 100us) + quiet + 5ms;
    CHECK(clock.now() - began <= 250 * (wire + silences));
  }
}

TEST_CASE("serial peer: a client that keeps too short a gap hears nothing") {
  FakeClock clock;
  const Interrupt never;
  link::Session session(make_sim_transport(std::make_unique<SerialBank>(SerialBank::Options{}),
                                           Framing::rtu, {}, clock, never),
                        clock,
                        {.rules = {.framing = Framing::rtu, .spontaneous = {}},
                         .unit = {1},
                         .answer_timeout = 100ms,
                         .gap = 4ms,
                         .echo = link::LocalEcho::absent});
  const auto read = modbus::read_request(modbus::RegisterTable::holding, {7}, 1);
  CHECK(session.transact(read));
  CHECK(session.transact(read).error().code == Errc::no_answer);
}

TEST_CASE("serial peer: what is not answered is told, with the reason") {
  Bus bus;
  std::vector<std::string> told;
  bus.peer.set_ignored([&](ByteView bytes, std::string_view reason) {
    told.push_back(to_hex(bytes) + ": " + std::string(reason));
  });
  const auto ask = [&](const Bytes& bytes, Duration at) {
    told.clear();
    bus.peer.receive(bytes, start + at);
    bus.answers();
    return told.empty() ? std::string() : told.front();
  };
  CHECK(ask(read_two, 0ms).empty());
  CHECK(ask(read_two, 15500us + 2100us) == to_hex(read_two) + ": 2.1 ms of silence, 5.5 ms needed");
  Bytes spoilt = read_two;
  spoilt.back() ^= 1U;
  CHECK(ask(spoilt, 100ms) == to_hex(spoilt) + ": its checksum is wrong, or it is no frame");
  CHECK(ask(hex("01 03"), 200ms) == "01 03: it is too short to be a frame");
  const Bytes to_nobody = modbus::frame(Framing::rtu, {{}, {7}, modbus::loopback_request(1)});
  CHECK(ask(to_nobody, 300ms) == to_hex(to_nobody) + ": there is no unit 7");
  const Bytes to_all = modbus::frame(Framing::rtu, {{}, {0}, modbus::write_request({2}, 5)});
  CHECK(ask(to_all, 400ms).empty());
}

TEST_CASE("serial peer: what is under way when the power goes is lost") {
  Bus bus;
  bus.peer.receive(read_two, start);
  bus.peer.forget();
  CHECK(bus.answers().empty());
  bus.peer.receive(loopback_to_2, start + 30ms);
  bus.peer.take(start + 36ms);
  bus.peer.forget();
  CHECK(bus.answers().empty());
  bus.peer.receive(read_two, start + 60ms);
  CHECK(bus.answers() == "75500: " + two_words + "; ");
}
