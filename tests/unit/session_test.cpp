#include "spindle/link/session.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "spindle/modbus/crc16.hpp"
#include "spindle/modbus/pdu.hpp"
#include "support/scripted_transport.hpp"
#include "unit/hex.hpp"

using namespace spindle;
using namespace spindle::link;
using namespace std::chrono_literals;
using modbus::Framing;
using modbus::Pdu;
using modbus::RegisterTable;
using spindle::test::answer;
using spindle::test::Arrival;
using spindle::test::FakeClock;
using spindle::test::hex;
using spindle::test::Reaction;
using spindle::test::say;
using spindle::test::Script;
using spindle::test::silence;

namespace {

constexpr Duration timeout = 1s;
constexpr Duration gap = 5500us;  // BLV manual: silence up to 19200 baud

// bm-bmt.md, section 9.
const Bytes pushed_event =
    hex("0001 0000 001F 00 04 1C 07AA 058D 0001 0834 084F 00EB 0422 018F 05B1 0003 0000 0000 0001 "
        "0000");

/// The same event with another transaction id and event number.
Bytes event_frame(std::uint16_t transaction, std::uint16_t number) {
  Bytes bytes = pushed_event;
  for (const auto& [at, value] : {std::pair{0U, transaction}, std::pair{9U, number}}) {
    bytes[at] = static_cast<std::uint8_t>(value >> 8U);
    bytes[at + 1] = static_cast<std::uint8_t>(value & 0xFFU);
  }
  return bytes;
}

std::uint16_t number_of(const Spontaneous& event) { return get_u16(event.pdu.data, 1); }

Pdu holding(const Registers& values) {
  return modbus::read_response(RegisterTable::holding, values);
}

const Pdu read_two = modbus::read_request(RegisterTable::holding, {2}, 2);
const Pdu two_values = holding({271, 1000});
const Pdu arm = modbus::write_request(modbus::RegisterAddress{4002}, 1);

Bytes operator+(Bytes head, const Bytes& tail) {
  head.insert(head.end(), tail.begin(), tail.end());
  return head;
}

Bytes part(const Bytes& bytes, std::size_t from, std::size_t to) {
  return {bytes.begin() + static_cast<std::ptrdiff_t>(from),
          bytes.begin() + static_cast<std::ptrdiff_t>(to)};
}

/// A session, its peer and their clock.
struct Line : test::ScriptedPeer {
  /// `late_for`: how long late answers to an earlier program may still come.
  explicit Line(SessionOptions options, Duration late_for = {})
      : session(with_late(late_for), clock, std::move(options), trace()) {}

  std::unique_ptr<link::Transport> with_late(Duration late_for) {
    if (late_for > Duration::zero()) script.late_until = clock.now() + late_for;
    return transport_to(script);
  }

  Trace trace() {
    return {
        .decision = [this](Decision decision, std::string_view) { decisions.push_back(decision); },
        .notice = [this](std::string_view sentence) { notices.emplace_back(sentence); }};
  }
  [[nodiscard]] Duration elapsed() const { return clock.now() - FakeClock::start; }
  [[nodiscard]] Duration sent_at(std::size_t index) const {
    return script.sent.at(index).at - FakeClock::start;
  }
  [[nodiscard]] std::size_t count(Decision decision) const {
    return static_cast<std::size_t>(std::count(decisions.begin(), decisions.end(), decision));
  }
  /// What is in the queue or has arrived.
  std::vector<std::uint16_t> events() {
    std::vector<std::uint16_t> numbers;
    while (true) {
      auto next = session.next_spontaneous(clock.now() + 1ms);
      if (!next || !*next) return numbers;
      numbers.push_back(number_of(**next));
    }
  }

  std::vector<Decision> decisions = {};
  std::vector<std::string> notices = {};
  Session session;
};

SessionOptions tcp() {
  return {.rules = {.framing = Framing::tcp, .spontaneous = {{0x04, 28}}, .units = Units::any},
          .unit = {0},
          .answer_timeout = timeout};
}

SessionOptions rtu(SessionOptions::Proof proof = SessionOptions::Proof::none) {
  return {.rules = {.framing = Framing::rtu, .spontaneous = {}},
          .unit = {1},
          .answer_timeout = timeout,
          .gap = gap,
          .broadcast_gap = 10ms,
          .proof = proof,
          .echo = proof == SessionOptions::Proof::none ? LocalEcho::automatic : LocalEcho::absent};
}

Reaction tcp_answer(Duration after, Pdu pdu) { return answer(Framing::tcp, after, std::move(pdu)); }
Reaction rtu_answer(Duration after, Pdu pdu) { return answer(Framing::rtu, after, std::move(pdu)); }

/// FC 08 repeats its request.
std::vector<Arrival> repeat(ByteView request) {
  return {{15ms, Bytes(request.begin(), request.end())}};
}

Bytes tcp_response(ByteView request, Pdu pdu) {
  return test::response_to(Framing::tcp, request, std::move(pdu));
}

Bytes rtu_frame(std::uint8_t unit, Pdu pdu) {
  return modbus::frame(Framing::rtu, {{}, {unit}, std::move(pdu)});
}

std::uint16_t transaction_of(const test::Sent& sent) { return get_u16(sent.bytes, 0); }

}  // namespace

// ---- Modbus TCP ----

TEST_CASE("tcp: a request goes out as in the vectors and its answer comes back") {
  Line line(tcp());
  // bm-bmt.md, section 9, with the ids that a fresh session uses.
  line.script.on_request(say(20ms, hex("8000 0000 0007 00 03 04 010F 03E8")));
  line.script.on_request(say(20ms, hex("8001 0000 0006 01 06 0FA2 0001")));
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.session.last_round_trip() == 20ms);
  CHECK(line.session.transact(arm) == arm);
  CHECK(line.script.sent[0].bytes == hex("8000 0000 0006 00 03 0002 0002"));
  CHECK(line.script.sent[1].bytes == hex("8001 0000 0006 00 06 0FA2 0001"));
  CHECK(line.elapsed() == 40ms);
  CHECK(line.session.counters().requests == 2);
}

TEST_CASE("tcp: an exception response is an answer with its code as received") {
  for (const std::uint8_t code : hex("01 02 07 0C 0E FF")) {
    Line line(tcp());
    line.script.on_request(tcp_answer(5ms, modbus::exception_response(0x03, code)));
    const auto response = line.session.transact(read_two);
    REQUIRE(response);
    CHECK(modbus::exception_of(*response) == code);
  }
}

TEST_CASE("tcp: ids begin at 8000h, count up, and wrap without ever being small") {
  Line line(tcp());
  line.script.otherwise = tcp_answer(0ms, two_values);
  for (unsigned request = 0; request < 0x8002; ++request) {
    REQUIRE(line.session.transact(read_two));
    REQUIRE(transaction_of(line.script.sent.back()) == 0x8000 + request % 0x8000);
  }
}

TEST_CASE("tcp: a push around the answer is queued and the answer found, however both are cut") {
  enum class Order { push_first, answer_first };
  for (const std::uint16_t push_id : Registers{0x0000, 0x0001, 0x00C7, 0x8000}) {
    for (const Order order : {Order::push_first, Order::answer_first}) {
      const Bytes push = event_frame(push_id, 1962);
      const Bytes response = modbus::frame(Framing::tcp, {{0x8000}, {1}, two_values});
      const Bytes glued = order == Order::push_first ? push + response : response + push;
      for (std::size_t cut = 0; cut <= glued.size(); ++cut) {
        CAPTURE(push_id);
        CAPTURE(cut);
        Line line(tcp());
        line.script.on_request([&](ByteView) {
          return std::vector<Arrival>{{10ms, part(glued, 0, cut)},
                                      {11ms, part(glued, cut, glued.size())}};
        });
        REQUIRE(line.session.transact(read_two) == two_values);
        const auto event = line.session.next_spontaneous(line.clock.now() + timeout);
        REQUIRE(event.value());
        CHECK(number_of(**event) == 1962);
        CHECK(line.elapsed() <= 11ms);
        CHECK(line.session.counters().strays == 0);
      }
    }
  }
}

TEST_CASE("tcp: pushes and answer byte by byte") {
  Line line(tcp());
  line.script.chunk = 1;
  line.script.on_request([](ByteView request) {
    return std::vector<Arrival>{{10ms, event_frame(1, 7) + event_frame(0x8000, 8) +
                                           tcp_response(request, two_values) + event_frame(2, 9)}};
  });
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.events() == std::vector<std::uint16_t>{7, 8, 9});
}

TEST_CASE("tcp: events keep their order and the time of their own arrival") {
  Line line(tcp());
  line.script.on_request([](ByteView request) {
    const Bytes push = event_frame(1, 2);
    return std::vector<Arrival>{{10ms, event_frame(1, 1)},
                                {20ms, part(push, 0, 5)},
                                {30ms, part(push, 5, push.size())},
                                {40ms, tcp_response(request, two_values) + event_frame(1, 3)}};
  });
  REQUIRE(line.session.transact(read_two) == two_values);
  line.clock.advance(5s);  // no question for a while
  std::vector<std::pair<std::uint16_t, Duration>> got;
  while (const auto event = line.session.next_spontaneous(line.clock.now()).value()) {
    got.emplace_back(number_of(*event), event->arrival - FakeClock::start);
    CHECK(event->wall - FakeClock::wall_start == event->arrival - FakeClock::start);
  }
  CHECK(got == std::vector<std::pair<std::uint16_t, Duration>>{{1, 10ms}, {2, 30ms}, {3, 40ms}});
  CHECK(line.session.counters().spontaneous == 3);
}

TEST_CASE("tcp: a queue that is not emptied loses its oldest and counts them") {
  constexpr std::uint16_t pushed = 5000;
  Line line(tcp());
  line.script.on_request([](ByteView request) {
    Bytes bytes;
    for (std::uint16_t number = 1; number <= pushed; ++number) {
      bytes = std::move(bytes) + event_frame(1, number);
    }
    return std::vector<Arrival>{{1ms, bytes + tcp_response(request, two_values)}};
  });
  REQUIRE(line.session.transact(read_two) == two_values);
  const auto kept = line.events();
  const auto& counters = line.session.counters();
  CHECK(counters.spontaneous == pushed);
  CHECK(counters.overflowed > 0);
  CHECK(kept.size() + counters.overflowed == pushed);
  CHECK(kept.front() == counters.overflowed + 1);
  CHECK(kept.back() == pushed);
}

TEST_CASE("tcp: the late answer to an abandoned request is never the next value") {
  struct Row {
    std::string_view what;
    Duration late;  // after the abandoned request
  };
  for (const Row& row : {Row{"before the next request", 1100ms}, Row{"while it waits", 1520ms}}) {
    CAPTURE(row.what);
    Line line(tcp());
    line.script.on_request(tcp_answer(row.late, holding({1, 1})));
    line.script.on_request(tcp_answer(50ms, two_values));
    const auto abandoned = line.session.transact(read_two);
    REQUIRE_FALSE(abandoned);
    CHECK(abandoned.error().code == Errc::no_answer);
    CHECK(line.elapsed() == timeout);
    line.clock.advance(500ms);
    CHECK(line.session.transact(read_two) == two_values);
    CHECK(line.elapsed() == 1550ms);
    CHECK(line.session.counters().strays == 1);
    CHECK(line.count(Decision::late) == 1);
  }
}

TEST_CASE("tcp: answers to abandoned requests in a row never shift the later ones") {
  Line line(tcp());
  for (std::uint16_t request = 0; request < 20; ++request) {
    // Every third answer comes after its time, in the midst of the next exchanges.
    const Duration after = request % 3 == 0 ? timeout + 30ms * (request + 1) : 40ms;
    line.script.on_request(tcp_answer(after, holding({request, request})));
  }
  for (std::uint16_t request = 0; request < 20; ++request) {
    CAPTURE(request);
    const auto response = line.session.transact(read_two);
    REQUIRE(response.has_value() == (request % 3 != 0));
    if (response) CHECK(*response == holding({request, request}));
  }
}

TEST_CASE("tcp: what cannot be the answer") {
  struct Row {
    std::string_view what;
    Bytes bytes;
    Errc code;
    Duration elapsed;
    std::uint64_t strays = 0;
  };
  const std::vector<Row> rows = {
      {"nothing", {}, Errc::no_answer, timeout},
      {"a push only", event_frame(1, 1), Errc::no_answer, timeout},
      {"another id", hex("0001 0000 0007 00 03 04 010F 03E8"), Errc::no_answer, timeout, 1},
      {"a foreign function", hex("0005 0000 0006 00 65 0102 0304"), Errc::no_answer, timeout, 1},
      {"another byte count", hex("8000 0000 0005 00 03 02 010F"), Errc::malformed_answer, timeout,
       1},
      {"a byte count that lies", hex("8000 0000 0007 00 03 02 010F 03E8"), Errc::malformed_answer,
       timeout, 1},
      {"MBAP length too large by two", hex("8000 0000 0009 00 03 04 010F 03E8 0000"),
       Errc::malformed_answer, timeout, 1},
      {"another function with our id", hex("8000 0000 0007 00 04 04 010F 03E8"),
       Errc::malformed_answer, timeout, 1},
      {"an exception to another function", hex("8000 0000 0003 00 84 02"), Errc::malformed_answer,
       timeout, 1},
      {"half a frame", hex("8000 0000 0007 00 03 04"), Errc::incomplete_answer, timeout},
      {"one byte", hex("80"), Errc::incomplete_answer, timeout},
      {"half a push", part(pushed_event, 0, 20), Errc::no_answer, timeout},
      {"another protocol", hex("8000 0100 0007 00 03 04 010F 03E8"), Errc::malformed_answer, 10ms},
      {"an impossible length", hex("8000 0000 0000 00 03"), Errc::malformed_answer, 10ms},
      {"a length beyond every frame", hex("8000 0000 00FF 00 03"), Errc::malformed_answer, 10ms},
      {"HTTP", hex("48 54 54 50 2F 31 2E 31 20 34 30 30"), Errc::malformed_answer, 10ms},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    Line line(tcp());
    line.script.on_request(say(10ms, row.bytes));
    const auto response = line.session.transact(read_two);
    REQUIRE_FALSE(response);
    CHECK(response.error().code == row.code);
    CHECK(response.error().tried == "read 2 holding registers from 2");
    CHECK(line.elapsed() == row.elapsed);
    CHECK(line.session.counters().strays == row.strays);
  }
}

TEST_CASE("tcp: a protocol id in the low byte and a wrong unit do not spoil an answer") {
  Line line(tcp());
  line.script.on_request(say(1ms, hex("8000 0007 0007 4D 03 04 010F 03E8")));
  CHECK(line.session.transact(read_two) == two_values);
}

TEST_CASE("tcp: a broken frame does not end the wait for the right one") {
  Line line(tcp());
  line.script.on_request(
      say(10ms, hex("8000 0000 0005 00 03 02 FFFF") + hex("8000 0000 0007 00 03 04 010F 03E8")));
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.count(Decision::broken) == 1);
}

TEST_CASE("tcp: a write is acknowledged only by its own echo") {
  for (const std::string_view echo : {"8000 0000 0006 00 06 0FA3 0001",     // another register
                                      "8000 0000 0006 00 06 0FA2 0000"}) {  // another value
    Line line(tcp());
    line.script.on_request(say(10ms, hex(echo)));
    const auto response = line.session.transact(arm);
    REQUIRE_FALSE(response);
    CHECK(response.error().code == Errc::malformed_answer);
    CHECK(message_of(response.error()).find("write register 4002") != std::string::npos);
  }
}

TEST_CASE("tcp: the rest of half a frame that comes late is a stray, not the next value") {
  Line line(tcp());
  const Bytes late = hex("8000 0000 0007 00 03 04 0001 0001");
  line.script.on_request([&](ByteView) {
    return std::vector<Arrival>{{10ms, part(late, 0, 9)},
                                {timeout + 10ms, part(late, 9, late.size())}};
  });
  line.script.on_request(tcp_answer(50ms, two_values));
  CHECK(line.session.transact(read_two).error().code == Errc::incomplete_answer);
  CHECK(line.session.transact(read_two) == two_values);
}

TEST_CASE("tcp: junk behind the answer is no matter of this answer, but of the next") {
  Line line(tcp());
  line.script.on_request(say(1ms, hex("8000 0000 0007 00 03 04 010F 03E8") + hex("FFFF FFFF")));
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.session.transact(read_two).error().code == Errc::malformed_answer);
  CHECK(line.session.transact(read_two).error().code == Errc::malformed_answer);
  CHECK(line.session.next_spontaneous(line.clock.now() + 1s).error().code ==
        Errc::malformed_answer);
  CHECK(line.elapsed() == 1ms);
}

TEST_CASE("tcp: a stream without end keeps no caller beyond the deadline") {
  struct Row {
    std::string_view what;
    Bytes flood;
    std::size_t chunk;
  };
  const std::vector<Row> rows = {
      {"whole strays", hex("0005 0000 0006 00 65 0102 0304"), 4096},
      {"strays byte by byte", hex("0005 0000 0006 00 65 0102 0304"), 1},
      {"broken frames", hex("8000 0000 0005 00 03 02 010F"), 11},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    Line line(tcp());
    line.script.flood = row.flood;
    line.script.chunk = row.chunk;
    REQUIRE_FALSE(line.session.transact(read_two));
    CHECK(line.elapsed() >= timeout);
    CHECK(line.elapsed() <= timeout + line.script.flood_every);
    const auto begun = line.clock.now();
    CHECK(line.session.next_spontaneous(begun + 300ms).value() == std::nullopt);
    CHECK(line.clock.now() - begun <= 300ms + line.script.flood_every);
  }
}

TEST_CASE("tcp: pushes without end do not keep a request beyond its deadline either") {
  Line line(tcp());
  line.script.flood = pushed_event;
  CHECK(line.session.transact(read_two).error().code == Errc::no_answer);
  CHECK(line.elapsed() <= timeout + line.script.flood_every);
  CHECK(line.session.next_spontaneous(line.clock.now()).value());
}

TEST_CASE("tcp: an answer that is already there when the deadline has passed still counts") {
  Line line(tcp());
  // The process did not run between 0.9 s and 1.2 s; push and answer were there at 0.95 s.
  line.script.on_request([&](ByteView request) {
    line.clock.at(FakeClock::start + 900ms, [&] { line.clock.advance(300ms); });
    return std::vector<Arrival>{{900ms, event_frame(1, 1) + tcp_response(request, two_values)}};
  });
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.elapsed() == 1200ms);
}

TEST_CASE("tcp: the end of the connection is told as it is") {
  for (const Errc end : {Errc::closed, Errc::reset}) {
    Line line(tcp());
    line.script.on_request([&](ByteView) {
      return std::vector<Arrival>{{10ms, hex("8000 0000 00")}, {20ms, end}};
    });
    const auto response = line.session.transact(read_two);
    REQUIRE_FALSE(response);
    CHECK(response.error().code == end);
    CHECK(response.error().tried == "read 2 holding registers from 2");
    CHECK(line.elapsed() == 20ms);
    CHECK(line.session.next_spontaneous(line.clock.now() + 1s).error().code == end);
  }
}

TEST_CASE("tcp: an answer in front of the end of the connection counts, and so does an event") {
  Line line(tcp());
  line.script.on_request([&](ByteView request) {
    return std::vector<Arrival>{{10ms, tcp_response(request, two_values) + event_frame(1, 5)},
                                {10ms, Errc::closed}};
  });
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(number_of(*line.session.next_spontaneous(line.clock.now()).value()) == 5);
  CHECK(line.session.next_spontaneous(line.clock.now()).error().code == Errc::closed);
}

TEST_CASE("tcp: an interrupt ends the wait at once, and a shield lets the last words out") {
  Line line(tcp());
  line.clock.at(FakeClock::start + 300ms, [&] { line.interrupt.raise(15); });
  line.script.on_request(tcp_answer(500ms, two_values));
  line.script.on_request(tcp_answer(20ms, arm));
  CHECK(line.session.transact(read_two).error().code == Errc::terminated);
  CHECK(line.elapsed() == 300ms);
  CHECK(line.session.transact(arm).error().code == Errc::terminated);
  line.session.set_uninterruptible();
  CHECK(line.session.transact(arm) == arm);
}

TEST_CASE("tcp: next_spontaneous() waits for an event until the deadline and not longer") {
  Line line(tcp());
  line.script.arrive(FakeClock::start + 700ms, event_frame(1, 1));
  line.script.arrive(FakeClock::start + 800ms, event_frame(1, 2));
  line.script.arrive(FakeClock::start + 2s, hex("8005 0000 0003 00 83 02"));

  CHECK(line.session.next_spontaneous(FakeClock::start + 600ms).value() == std::nullopt);
  CHECK(line.elapsed() == 600ms);
  CHECK(number_of(*line.session.next_spontaneous(FakeClock::start + 900ms).value()) == 1);
  CHECK(line.elapsed() == 700ms);
  line.clock.advance(500ms);
  // Already there, though the deadline has passed.
  CHECK(number_of(*line.session.next_spontaneous(FakeClock::start).value()) == 2);
  CHECK(line.session.next_spontaneous(FakeClock::start + 3s).value() == std::nullopt);
  CHECK(line.elapsed() == 3s);
  CHECK(line.session.counters().strays == 1);
}

TEST_CASE("tcp: rules that become known later hold from then on") {
  SessionOptions options = tcp();
  options.rules.spontaneous.clear();
  Line line(options);
  line.script.arrive(FakeClock::start + 1ms, event_frame(1, 1));
  line.script.arrive(FakeClock::start + 3ms, event_frame(1, 2));
  CHECK(line.session.next_spontaneous(FakeClock::start + 2ms).value() == std::nullopt);
  line.session.set_rules(tcp().rules);
  CHECK(number_of(*line.session.next_spontaneous(FakeClock::start + 4ms).value()) == 2);
}

TEST_CASE("tcp: nothing is thrown away before a request") {
  Line line(tcp());
  line.script.arrive(FakeClock::start, event_frame(1, 1));
  line.clock.advance(10ms);
  line.script.on_request(tcp_answer(10ms, two_values));
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.events() == std::vector<std::uint16_t>{1});
}

// ---- Modbus RTU ----

TEST_CASE("rtu: a request goes out as in the manual, and its answer ends with its last byte") {
  Line line(rtu());
  line.clock.advance(1s);
  line.script.on_request(say(20ms, hex("01 03 08 00 00 00 64 00 00 0F A0 E1 97")));  // BLV p.16
  line.script.on_request(say(20ms, hex("01 83 02 C0 F1")));
  const auto read_four = modbus::read_request(RegisterTable::holding, {0x0480}, 4);
  CHECK(line.session.transact(read_four) == holding({0, 100, 0, 4000}));
  CHECK(line.script.sent[0].bytes == hex("01 03 04 80 00 04 44 D1"));
  CHECK(line.session.last_round_trip() == 20ms);
  CHECK(line.session.transact(read_four) == modbus::exception_response(0x03, 2));
}

TEST_CASE("rtu: the gap is kept from the last byte in either direction, no longer") {
  Line line(rtu());
  line.script.sending_takes = 9ms;
  line.script.on_request(rtu_answer(20ms, two_values));
  line.script.on_request(rtu_answer(20ms, two_values));
  line.script.on_request(rtu_answer(20ms, two_values));
  REQUIRE(line.session.transact(read_two));
  CHECK(line.sent_at(0) == 0ms);  // the line was silent before
  CHECK(line.elapsed() == 29ms);  // complete without waiting for silence
  REQUIRE(line.session.transact(read_two));
  CHECK(line.sent_at(1) == 29ms + gap);
  line.clock.advance(1s);
  const Duration later = line.elapsed();
  REQUIRE(line.session.transact(read_two));
  CHECK(line.sent_at(2) == later);  // silent for long enough already

  Line broadcasting(rtu());
  broadcasting.script.sending_takes = 9ms;
  REQUIRE(broadcasting.session.broadcast(arm));
  CHECK(broadcasting.elapsed() == 19ms);  // no wait but the pause from the last byte
  CHECK(broadcasting.script.sent[0].bytes == rtu_frame(0, arm));
  broadcasting.script.on_request(rtu_answer(20ms, two_values));
  REQUIRE(broadcasting.session.transact(read_two));
  CHECK(broadcasting.sent_at(1) == 19ms);
}

TEST_CASE("rtu: other units' traffic between two questions moves the gap") {
  Line line(rtu());
  line.script.arrive(FakeClock::start + 100ms, rtu_frame(7, two_values));
  line.script.arrive(FakeClock::start + 104ms, rtu_frame(7, two_values) + hex("FF FF"));
  line.clock.advance(103ms);
  line.script.otherwise = rtu_answer(20ms, two_values);
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.sent_at(0) == 104ms + gap);
  CHECK(line.session.counters().strays == 2);
  CHECK(line.session.counters().noise_bytes == 2);
}

TEST_CASE("rtu: the answer time begins when the last byte has left") {
  struct Row {
    std::string_view what;
    Duration sending_takes;
    Duration character_time;
    Duration deadline;
  };
  // 8 characters of 1.146 ms: 9600 baud, 11 bits.
  for (const Row& row : {Row{"the port waits until all is sent", 9168us, 0us, timeout + 9168us},
                         Row{"the port returns at once", 0us, 1146us, timeout + 9168us},
                         Row{"both", 9168us, 1146us, timeout + 9168us},
                         Row{"the port takes longer", 20ms, 1146us, timeout + 20ms}}) {
    CAPTURE(row.what);
    SessionOptions options = rtu();
    options.character_time = row.character_time;
    Line line(options);
    line.script.sending_takes = row.sending_takes;
    CHECK(line.session.transact(read_two).error().code == Errc::no_answer);
    CHECK(line.elapsed() == row.deadline);
  }
}

TEST_CASE("rtu: noise and other units are skipped while the timer runs") {
  struct Row {
    std::string_view what;
    Bytes before;
    std::uint64_t strays;
    std::uint64_t noise;
  };
  const std::vector<Row> rows = {
      {"a noise byte", hex("FF"), 0, 1},
      {"noise that begins like the answer", hex("01 03"), 0, 2},
      {"zeros", Bytes(40, 0), 0, 40},
      {"more noise than a frame can have", Bytes(700, 0xFF), 0, 700},
      {"another unit's answer", rtu_frame(2, holding({1, 1})), 1, 0},
      {"another unit's answer behind noise", hex("00") + rtu_frame(2, holding({1, 1})), 1, 1},
      {"our unit's answer to another function", rtu_frame(1, arm), 1, 0},
      {"a frame with a wrong checksum", hex("01 03 04 0001 0001 0000"), 0, 9},
  };
  for (const Row& row : rows) {
    for (const std::size_t chunk : {std::size_t{4096}, std::size_t{1}}) {
      CAPTURE(row.what);
      CAPTURE(chunk);
      Line line(rtu());
      line.script.chunk = chunk;
      line.script.on_request(say(20ms, row.before + rtu_frame(1, two_values)));
      line.script.otherwise = rtu_answer(20ms, two_values);
      CHECK(line.session.transact(read_two) == two_values);
      CHECK(line.script.sent.size() == 2);  // the second proves
      CHECK(line.session.counters().strays == row.strays);
      CHECK(line.session.counters().noise_bytes == row.noise);
    }
  }
}

TEST_CASE("rtu: what cannot be the answer") {
  struct Row {
    std::string_view what;
    Bytes bytes;
    Errc code;
  };
  const Bytes good = rtu_frame(1, two_values);
  Bytes flipped = good;
  flipped.back() ^= 0x01U;
  Bytes bad_exception = rtu_frame(1, modbus::exception_response(0x03, 2));
  bad_exception[2] = 3;
  const std::vector<Row> rows = {
      {"nothing", {}, Errc::no_answer},
      {"one bit of the checksum", flipped, Errc::bad_checksum},
      {"an exception with a wrong checksum", bad_exception, Errc::bad_checksum},
      {"half an answer", part(good, 0, 6), Errc::incomplete_answer},
      {"all but the last byte", part(good, 0, good.size() - 1), Errc::incomplete_answer},
      {"a byte", hex("01"), Errc::incomplete_answer},
      {"another unit only", rtu_frame(2, two_values), Errc::no_answer},
      {"another count", rtu_frame(1, holding({1})), Errc::malformed_answer},
      {"the echo of the request only", hex("01 03 0002 0002 65CB"), Errc::local_echo},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    Line line(rtu());
    line.script.on_request(say(20ms, row.bytes));
    const auto response = line.session.transact(read_two);
    REQUIRE_FALSE(response);
    CHECK(response.error().code == row.code);
    CHECK(response.error().tried == "read 2 holding registers from 2");
    CHECK(line.elapsed() == timeout);
  }
}

TEST_CASE("rtu: after a failure the line is silent for one more answer time and proved by FC 08") {
  struct Row {
    std::string_view what;
    Reaction reaction;
    Errc code;
  };
  Bytes flipped = rtu_frame(1, two_values);
  flipped.back() ^= 0x01U;
  const std::vector<Row> rows = {
      {"no answer", silence(), Errc::no_answer},
      {"bad checksum", say(20ms, flipped), Errc::bad_checksum},
      {"a late answer", rtu_answer(timeout + 400ms, holding({1, 1})), Errc::no_answer},
      {"a late answer in pieces",
       [](ByteView) {
         const Bytes late = rtu_frame(1, holding({1, 1}));
         return std::vector<Arrival>{{timeout + 399ms, part(late, 0, 4)},
                                     {timeout + 401ms, part(late, 4, late.size())}};
       },
       Errc::no_answer},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    Line line(rtu(SessionOptions::Proof::loopback));
    line.script.on_request(row.reaction);
    line.script.on_request(repeat);
    line.script.on_request(rtu_answer(15ms, two_values));
    line.script.on_request(repeat);
    CHECK(line.session.transact(read_two).error().code == row.code);
    CHECK(line.elapsed() == timeout);
    CHECK(line.session.transact(read_two) == two_values);
    REQUIRE(line.script.sent.size() == 4);
    CHECK(line.sent_at(1) == 2 * timeout);
    CHECK(line.script.sent[1].bytes[1] == 0x08);
    CHECK(line.sent_at(2) == 2 * timeout + 15ms + gap);
    CHECK(line.script.sent[3].bytes[1] == 0x08);
    CHECK(line.count(Decision::resync) == 2);

    line.clock.advance(4 * timeout);
    line.script.on_request(rtu_answer(15ms, two_values));  // and then all is as before
    CHECK(line.session.transact(read_two) == two_values);
    CHECK(line.script.sent.size() == 5);
  }
}

TEST_CASE("rtu: an answer that comes later than the quarantine lasts is not the next one's") {
  // Behind the end of the quarantine (2 s) and the loop-back that proves the line.
  for (const Duration late : {2030ms, 2034ms, 2100ms, 3000ms, 3900ms}) {
    CAPTURE(late.count());
    Line line(rtu(SessionOptions::Proof::loopback));
    line.script.on_request(say(late, rtu_frame(1, holding({1, 1}))));
    line.script.otherwise = [](ByteView request) {
      if (request[1] == 0x08) return repeat(request);
      return std::vector<Arrival>{{15ms, rtu_frame(1, two_values)}};
    };
    CHECK(line.session.transact(read_two).error().code == Errc::no_answer);
    for (int i = 0; i < 100; ++i) {
      const auto answered = line.session.transact(read_two);
      if (answered) CHECK(*answered == two_values);
      if (!answered) CHECK(answered.error().code == Errc::no_answer);
    }
    CHECK(line.session.transact(read_two) == two_values);
  }
}

TEST_CASE("rtu: a session behind one that had trouble believes only what is proved") {
  SessionOptions options = rtu(SessionOptions::Proof::loopback);
  options.late_answers = SessionOptions::LateAnswers::possible;
  Line line(options);
  line.script.arrive(line.clock.now() + 10ms, rtu_frame(1, holding({1, 1})));
  line.script.on_request(repeat);  // it proves the line
  line.script.on_request(rtu_answer(15ms, two_values));
  line.script.otherwise = repeat;
  CHECK(line.session.transact(read_two) == two_values);
}

TEST_CASE("rtu: what was given up is left to the next program on the line") {
  test::FakeClock clock;
  Script script{clock};
  const auto run = [&](const auto& ask) {
    Session session(transport_to(script), clock, rtu(SessionOptions::Proof::loopback));
    ask(session);
  };
  const auto read = [](Session& session) { static_cast<void>(session.transact(read_two)); };
  SUBCASE("an answer that is lost") {
    script.on_request(silence());
    run(read);
    REQUIRE(script.left_late);
    CHECK(*script.left_late >= clock.now() + 2s);
  }
  SUBCASE("nothing where all answers came") {
    script.on_request(rtu_answer(15ms, two_values));
    run(read);
    CHECK_FALSE(script.left_late);
  }
  SUBCASE("nothing where the late one came, too") {
    script.on_request(say(timeout + 10ms, rtu_frame(1, two_values)));
    script.otherwise = repeat;
    run([&](Session& session) {
      read(session);
      script.on_request(repeat);
      script.on_request(rtu_answer(15ms, two_values));
      read(session);
    });
    CHECK_FALSE(script.left_late);
  }
}

TEST_CASE("rtu: behind a program that gave up an answer only what is proved is believed") {
  SUBCASE("by a loop-back") {
    Line line(rtu(SessionOptions::Proof::loopback), 2s);
    line.script.on_request([](ByteView request) {  // units answer in order
      return std::vector<Arrival>{{5ms, rtu_frame(1, holding({1, 1}))},
                                  {35ms, Bytes(request.begin(), request.end())}};
    });
    line.script.otherwise = [](ByteView request) {
      if (request[1] == 0x08) return repeat(request);
      return std::vector<Arrival>{{15ms, rtu_frame(1, two_values)}};
    };
    CHECK(line.session.transact(read_two) == two_values);
  }
  SUBCASE("where the unit does not hear what comes while it says what is late") {
    // Whichever request is lost, the frame in front of the answer to the next one is not its
    // answer.
    for (std::size_t lost = 0; lost < 4; ++lost) {
      CAPTURE(lost);
      Line line(rtu(SessionOptions::Proof::loopback), 2s);
      std::size_t heard = 0;
      line.script.otherwise = [&](ByteView request) -> std::vector<Arrival> {
        if (heard++ == lost) return say(5ms, rtu_frame(1, holding({1, 1})))(request);
        if (request[1] == 0x08) return repeat(request);
        return {{15ms, rtu_frame(1, two_values)}};
      };
      for (int i = 0; i < 4; ++i) {
        const auto answered = line.session.transact(read_two);
        if (answered) CHECK(*answered == two_values);
      }
      CHECK(line.session.transact(read_two) == two_values);
    }
  }
  SUBCASE("by another read, where there is no loop-back") {
    Line line(rtu(), 2s);
    line.script.on_request([](ByteView) {
      return std::vector<Arrival>{{5ms, rtu_frame(1, holding({1, 1}))},
                                  {35ms, rtu_frame(1, two_values)}};
    });
    line.script.otherwise = [](ByteView) {
      return std::vector<Arrival>{{15ms, rtu_frame(1, two_values)}};
    };
    CHECK(line.session.transact(read_two) == two_values);
    CHECK(line.script.sent.size() > 2);
  }
  SUBCASE("for so long as they may come") {
    Line line(rtu(), 2s);
    line.clock.advance(3s);
    line.script.on_request(rtu_answer(15ms, two_values));
    CHECK(line.session.transact(read_two) == two_values);
    CHECK(line.script.sent.size() == 1);
  }
}

TEST_CASE("rtu: behind a device server that others may use the first answer is proved") {
  SessionOptions options = rtu(SessionOptions::Proof::loopback);
  options.late_answers = SessionOptions::LateAnswers::shared;
  SUBCASE("it was meant for this request") {
    Line line(options);
    line.script.on_request(rtu_answer(15ms, two_values));
    line.script.otherwise = repeat;
    CHECK(line.session.transact(read_two) == two_values);
    CHECK(line.session.counters().requests > 1);
  }
  SUBCASE("it was meant for another client") {
    Line line(options);
    line.script.on_request([](ByteView) {
      return std::vector<Arrival>{{5ms, rtu_frame(1, holding({1, 1}))},
                                  {15ms, rtu_frame(1, two_values)}};
    });
    line.script.otherwise = repeat;
    const auto answered = line.session.transact(read_two);
    if (answered) CHECK(*answered == two_values);
    CHECK(line.session.counters().requests > 1);
  }
}

TEST_CASE("rtu: bytes at the end of the quarantine prolong it until the line is silent") {
  Line line(rtu());
  line.script.on_request(say(2 * timeout - 1ms, rtu_frame(1, holding({1, 1}))));
  line.script.on_request(rtu_answer(15ms, two_values));
  CHECK_FALSE(line.session.transact(read_two));
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.sent_at(1) == 2 * timeout - 1ms + gap);
}

TEST_CASE("rtu: the time until the next request is part of the quarantine") {
  Line line(rtu());
  line.script.on_request(silence());
  line.script.on_request(rtu_answer(15ms, two_values));
  CHECK_FALSE(line.session.transact(read_two));
  line.clock.advance(10s);
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.sent_at(1) == timeout + 10s);
}

TEST_CASE("rtu: a line that is not proved stays in quarantine") {
  struct Row {
    std::string_view what;
    Reaction proof;
    Errc code;
  };
  const std::vector<Row> rows = {
      {"another word", rtu_answer(15ms, modbus::loopback_request(0x0BAD)), Errc::malformed_answer},
      {"the answer to an older read", rtu_answer(15ms, holding({1, 1})), Errc::no_answer},
      {"silence", silence(), Errc::no_answer},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    Line line(rtu(SessionOptions::Proof::loopback));
    line.script.on_request(silence());
    line.script.on_request(row.proof);
    line.script.on_request(row.proof);
    CHECK_FALSE(line.session.transact(read_two));
    CHECK(line.session.transact(read_two).error().code == row.code);
    CHECK(line.session.transact(read_two).error().code == row.code);
    REQUIRE(line.script.sent.size() == 3);
    // The read itself never went out, and every word is another.
    CHECK(line.script.sent[1].bytes[1] == 0x08);
    CHECK(line.script.sent[2].bytes[1] == 0x08);
    CHECK(line.script.sent[1].bytes != line.script.sent[2].bytes);
    CHECK(line.sent_at(2) >= line.sent_at(1) + 2 * timeout);
  }
}

TEST_CASE("rtu: a device that refuses FC 08 has answered it all the same") {
  Line line(rtu(SessionOptions::Proof::loopback));
  line.script.on_request(silence());
  line.script.on_request(rtu_answer(15ms, modbus::exception_response(0x08, 1)));
  line.script.on_request(rtu_answer(15ms, two_values));
  line.script.on_request(rtu_answer(15ms, modbus::exception_response(0x08, 1)));
  CHECK_FALSE(line.session.transact(read_two));
  CHECK(line.session.transact(read_two) == two_values);
}

TEST_CASE("rtu: late answers never shift later reads") {
  for (const auto proof : {SessionOptions::Proof::none, SessionOptions::Proof::loopback}) {
    for (const Duration late : {1ms, 100ms, 500ms, 999ms}) {
      CAPTURE(late.count());
      Line line(rtu(proof));
      std::uint16_t reads = 0;
      line.script.otherwise = [&](ByteView request) {
        const modbus::Adu adu = test::request_of(Framing::rtu, request);
        if (adu.pdu.function == 0x08)
          return std::vector<Arrival>{{15ms, Bytes(request.begin(), request.end())}};
        const Duration after = reads % 3 == 1 ? timeout + late : Duration(15ms);
        const std::uint16_t value = reads++;
        return std::vector<Arrival>{{after, rtu_frame(1, holding({value, value}))}};
      };
      for (std::uint16_t read = 0; read < 12; ++read) {
        const auto response = line.session.transact(read_two);
        REQUIRE(response.has_value() == (read % 3 != 1));
        if (response) CHECK(*response == holding({read, read}));
      }
    }
  }
}

TEST_CASE("rtu: an answer that comes twice is not the next value") {
  for (const Duration again : {Duration(0ms), Duration(2ms), Duration(6ms)}) {
    CAPTURE(again.count());
    Line line(rtu());
    line.script.on_request([&](ByteView) {
      const Bytes frame = rtu_frame(1, holding({1, 1}));
      return std::vector<Arrival>{{15ms, frame}, {15ms + again, frame}};
    });
    CHECK(line.session.transact(read_two) == holding({1, 1}));
    line.script.otherwise = rtu_answer(15ms, two_values);
    if (again > gap) line.clock.advance(again);
    CHECK(line.session.transact(read_two) == two_values);
    CHECK(line.sent_at(1) >= 15ms + again + gap);
  }
}

TEST_CASE("rtu: a stop does not wait for the end of a quarantine, and does not end it") {
  const Pdu stop = modbus::write_request(modbus::RegisterAddress{0x007D}, 0);
  Line line(rtu());
  line.script.on_request(rtu_answer(timeout + 10ms, holding({1, 1})));
  line.script.on_request(rtu_answer(15ms, stop));
  line.script.on_request(rtu_answer(15ms, two_values));
  CHECK_FALSE(line.session.transact(read_two));
  CHECK(line.session.transact(stop) == stop);  // in spite of the late answer in between
  CHECK(line.sent_at(1) == timeout);
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.sent_at(2) == 2 * timeout);
}

TEST_CASE("rtu: an interrupted read is abandoned, the shielded stop goes out with its gap") {
  const Pdu stop = modbus::write_request(modbus::RegisterAddress{0x007D}, 0);
  Line line(rtu());
  line.clock.at(FakeClock::start + 10ms, [&] { line.interrupt.raise(2); });
  line.script.on_request(rtu_answer(12ms, holding({1, 1})));
  line.script.on_request(rtu_answer(15ms, stop));
  line.script.on_request(rtu_answer(15ms, two_values));
  CHECK(line.session.transact(read_two).error().code == Errc::interrupted);
  CHECK(line.session.transact(stop).error().code == Errc::interrupted);
  CHECK(line.elapsed() == 10ms);
  line.session.set_uninterruptible();
  line.script.arrive(FakeClock::start + 11ms, hex("00"));
  CHECK(line.session.transact(stop) == stop);
  CHECK(line.sent_at(1) == 10ms);
  CHECK(line.session.transact(read_two) == two_values);  // not the answer that came at 12 ms
}

TEST_CASE("rtu: the adapter's echo of the request is told from the answer") {
  Line line(rtu());
  bool present = true;
  line.script.otherwise = [&](ByteView request) {
    const Bytes echo(request.begin(), request.end());
    const bool write = request[1] == 0x06;
    std::vector<Arrival> arrivals = {{1ms, part(echo, 0, 3)}, {2ms, part(echo, 3, echo.size())}};
    if (present) arrivals.push_back({20ms, write ? echo : rtu_frame(1, two_values)});
    return arrivals;
  };
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.session.last_round_trip() == 20ms);
  CHECK(line.session.transact(arm) == arm);
  CHECK(line.session.last_round_trip() == 20ms);  // the answer, not the echo
  CHECK(line.session.counters().noise_bytes == 0);
  present = false;
  CHECK(line.session.transact(arm).error().code == Errc::local_echo);
  CHECK(line.session.transact(read_two).error().code == Errc::local_echo);
}

TEST_CASE("rtu: a loop-back's echo is never its answer, whatever the adapter does") {
  const Pdu loopback = modbus::loopback_request(0x1234);
  struct Row {
    std::string_view what;
    LocalEcho echo;
    bool echoing;
    bool there;
    std::optional<Errc> code;
    std::vector<std::uint8_t> functions;  // of what was sent for two loop-backs
  };
  const std::vector<Row> rows = {
      {"no echo", LocalEcho::automatic, false, true, {}, {0x03, 0x08, 0x08}},
      {"echo", LocalEcho::automatic, true, true, {}, {0x03, 0x08, 0x08}},
      {"no echo, no unit", LocalEcho::automatic, false, false, Errc::no_answer, {0x03, 0x08}},
      {"echo, no unit", LocalEcho::automatic, true, false, Errc::local_echo, {0x03, 0x08}},
      {"surely no echo", LocalEcho::absent, false, true, {}, {0x08, 0x08}},
      {"surely an echo", LocalEcho::present, true, true, {}, {0x08, 0x08}},
      {"surely an echo, no unit", LocalEcho::present, true, false, Errc::local_echo, {0x08, 0x08}},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    SessionOptions options = rtu();
    options.echo = row.echo;
    Line line(options);
    line.script.otherwise = [&](ByteView request) {
      const Bytes copy(request.begin(), request.end());
      std::vector<Arrival> arrivals;
      if (row.echoing) arrivals.push_back({1ms, copy});
      if (row.there)
        arrivals.push_back({15ms, copy[1] == 0x08 ? copy : rtu_frame(1, holding({7}))});
      return arrivals;
    };
    for (int turn = 0; turn < 2; ++turn) {
      const auto response = line.session.transact(loopback);
      REQUIRE(response.has_value() == !row.code);
      if (row.code) CHECK(response.error().code == *row.code);
      if (!response) continue;
      CHECK(*response == loopback);
      CHECK(line.session.last_round_trip() == 15ms);
    }
    std::vector<std::uint8_t> functions;
    for (const test::Sent& sent : line.script.sent) functions.push_back(sent.bytes[1]);
    CHECK(functions == row.functions);
  }
}

TEST_CASE("rtu: a refused read tells the echo as well") {
  Line line(rtu());
  line.script.on_request(rtu_answer(15ms, modbus::exception_response(0x03, 1)));
  line.script.on_request([](ByteView request) {
    return std::vector<Arrival>{{15ms, Bytes(request.begin(), request.end())}};
  });
  CHECK(line.session.transact(modbus::loopback_request(7)) == modbus::loopback_request(7));
}

TEST_CASE("rtu: noise before the echo does not make it the answer") {
  SessionOptions options = rtu();
  options.echo = LocalEcho::present;
  Line line(options);
  line.script.on_request([](ByteView request) {
    return std::vector<Arrival>{{1ms, hex("FF") + Bytes(request.begin(), request.end())}};
  });
  CHECK(line.session.transact(arm).error().code == Errc::local_echo);
}

TEST_CASE("rtu: a line that others have just left is given its gap") {
  SessionOptions options = rtu();
  options.in_use_until = FakeClock::start;
  Line line(options);
  line.script.on_request(rtu_answer(15ms, two_values));
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.sent_at(0) == gap);
}

TEST_CASE(
    "rtu: one session asks one unit after the other, and a late answer belongs to no question") {
  SessionOptions options = rtu();
  options.echo = LocalEcho::absent;
  Line line(options);
  const Pdu loopback = modbus::loopback_request(0x1234);
  line.script.on_request([](ByteView request) {
    return std::vector<Arrival>{{timeout + 8ms, Bytes(request.begin(), request.end())}};
  });
  CHECK(line.session.transact(loopback).error().code == Errc::no_answer);
  line.session.set_unit({2});
  line.script.on_request([](ByteView request) {
    return std::vector<Arrival>{{20ms, Bytes(request.begin(), request.end())}};
  });
  CHECK(line.session.transact(loopback) == loopback);
  CHECK(line.sent_at(1) == timeout);  // no quarantine before a request that its answer repeats
  CHECK(line.script.sent[1].bytes[0] == 2);
  CHECK(line.session.counters().strays == 1);
}

TEST_CASE(
    "rtu: a line is left when the answer to an abandoned read has come, or is not waited for") {
  struct Row {
    std::string_view what;
    std::vector<Arrival> late;
    Duration settled;  // after the interrupt at 10 ms
  };
  const Bytes answer_bytes = rtu_frame(1, two_values);
  for (const Row& row :
       {Row{"an answer", {{25ms, answer_bytes}}, 15ms},
        Row{"an answer in pieces",
            {{25ms, part(answer_bytes, 0, 3)}, {27ms, part(answer_bytes, 3, answer_bytes.size())}},
            17ms},
        Row{"an exception", {{25ms, rtu_frame(1, modbus::exception_response(0x03, 2))}}, 15ms},
        Row{"another unit's", {{25ms, rtu_frame(2, two_values)}}, 250ms},
        Row{"nothing", {}, 250ms}}) {
    CAPTURE(row.what);
    Line line(rtu());
    line.clock.at(FakeClock::start + 10ms, [&] { line.interrupt.raise(2); });
    line.script.on_request([&](ByteView) { return row.late; });
    CHECK(line.session.transact(read_two).error().code == Errc::interrupted);
    line.session.drain_late_answer();
    CHECK(line.elapsed() == 10ms + row.settled);
    CHECK(line.script.sent.size() == 1);
  }
  Line done(rtu());
  done.script.on_request(rtu_answer(15ms, two_values));
  CHECK(done.session.transact(read_two));
  done.session.drain_late_answer();
  CHECK(done.elapsed() == 15ms);

  Line told(rtu());  // an answer that repeats its request is the unit's own
  told.script.on_request(silence());
  CHECK_FALSE(told.session.transact(arm));
  told.session.drain_late_answer();
  CHECK(told.elapsed() == timeout);

  Line gone(rtu());
  gone.script.on_request([](ByteView) { return std::vector<Arrival>{{10ms, Errc::reset}}; });
  CHECK_FALSE(gone.session.transact(read_two));
  gone.session.drain_late_answer();
  CHECK(gone.elapsed() == 10ms);
}

TEST_CASE("rtu: words for loop-backs differ from request to request and start to start") {
  Line line(rtu());
  const std::uint16_t first = line.session.fresh_word();
  line.script.on_request(silence());
  CHECK_FALSE(line.session.transact(modbus::loopback_request(first)));
  CHECK(line.session.fresh_word() != first);
  Session later(transport_to(line.script), line.clock, rtu());
  CHECK(later.fresh_word() != first);
}

TEST_CASE("rtu: without an echo a write's only answer is its answer") {
  Line line(rtu());
  line.script.on_request(rtu_answer(15ms, two_values));
  line.script.on_request(rtu_answer(15ms, arm));
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.session.transact(arm) == arm);
}

TEST_CASE("rtu: a line that never falls silent keeps no caller for ever") {
  struct Row {
    std::string_view what;
    Bytes flood;
  };
  Bytes hopeful;  // every second byte might begin a frame of 245 bytes
  while (hopeful.size() < 300) hopeful = std::move(hopeful) + hex("03 F0");
  const std::vector<Row> rows = {{"noise", Bytes(520, 0xFF)},
                                 {"noise like frames", hopeful},
                                 {"other units", rtu_frame(9, two_values)}};
  for (const Row& row : rows) {
    for (const std::size_t chunk : {std::size_t{4096}, std::size_t{1}}) {
      CAPTURE(row.what);
      CAPTURE(chunk);
      Line busy(rtu());
      busy.script.flood = row.flood;
      busy.script.chunk = chunk;
      const auto before_sending = busy.session.transact(read_two);
      REQUIRE_FALSE(before_sending);
      CHECK(message_of(before_sending.error()) == "the line never falls silent");
      CHECK(busy.script.sent.empty());
      CHECK(busy.elapsed() <= timeout + gap + 2 * busy.script.flood_every);

      Line line(rtu());
      line.script.chunk = chunk;
      line.script.on_request([&](ByteView) {
        line.script.flood = row.flood;
        return std::vector<Arrival>();
      });
      REQUIRE_FALSE(line.session.transact(read_two));
      CHECK(line.elapsed() <= timeout + 2 * line.script.flood_every);
      const auto in_quarantine = line.session.transact(read_two);
      CHECK(message_of(in_quarantine.error()) == "the line never falls silent");
      CHECK(line.elapsed() <= 3 * timeout + 3 * line.script.flood_every);
      CHECK(line.script.sent.size() == 1);
    }
  }
}

TEST_CASE("rtu: spontaneous frames are kept while the gap is waited for") {
  SessionOptions options = rtu();
  options.rules.spontaneous = {{0x04, 28}};
  Line line(options);
  const Pdu push = {0x04, part(pushed_event, 8, pushed_event.size())};
  line.script.arrive(FakeClock::start, rtu_frame(1, push));
  line.script.on_request(rtu_answer(15ms, two_values));
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.events() == std::vector<std::uint16_t>{1962});
}

// ---- others on a serial line ----

namespace {

constexpr std::string_view master_told = "another master is on this line; each answer is proved";

/// A line that others may use.
SessionOptions shared(SessionOptions::Proof proof) {
  SessionOptions options = rtu(proof);
  options.echo = LocalEcho::absent;
  options.others = SessionOptions::Others::possible;
  return options;
}

Pdu read_holding(std::uint16_t first, std::uint16_t count) {
  return modbus::read_request(RegisterTable::holding, {first}, count);
}

/// A device whose holding register N has the value N, and what may be asked to prove its answers.
std::vector<OtherRead> others_of(std::uint16_t first, std::uint16_t count) {
  return {{read_holding(first, static_cast<std::uint16_t>(count + 1)), 0},
          {read_holding(first, static_cast<std::uint16_t>(count + 2)), 0}};
}

Registers numbers(std::uint16_t first, std::uint16_t count) {
  Registers registers;
  for (std::uint16_t at = first; at < first + count; ++at) registers.push_back(at);
  return registers;
}

Pdu react(ByteView request) {
  const Pdu pdu = test::request_of(Framing::rtu, request).pdu;
  const auto parsed = modbus::parse_request(pdu).value();
  const auto* read = std::get_if<modbus::ReadRequest>(&parsed);
  return read == nullptr ? pdu : holding(numbers(read->first.value, read->count));
}

std::vector<Arrival> react_in_time(ByteView request) {
  return {{15ms, rtu_frame(1, react(request))}};
}

/// The answer to what another master asked of the same unit: the shape of read_two's.
const Bytes foreign_answer = rtu_frame(1, holding({7777, 7777}));
const Bytes foreign_request = rtu_frame(1, read_holding(206, 2));

}  // namespace

TEST_CASE("rtu: a quiet line costs no more frames than what is asked") {
  for (const auto proof : {SessionOptions::Proof::none, SessionOptions::Proof::loopback}) {
    Line line(shared(proof));
    line.script.otherwise = react_in_time;
    for (std::uint16_t first = 1; first <= 20; ++first) {
      CHECK(line.session.transact(read_holding(first, 2), others_of(first, 2)) ==
            holding(numbers(first, 2)));
      CHECK(line.session.transact(read_holding(first, 2)) == holding(numbers(first, 2)));
    }
    CHECK(line.script.sent.size() == 40);
    CHECK(line.notices.empty());
  }
}

TEST_CASE("rtu: what makes a line doubtful is told once, and no wrong answer is believed") {
  struct Row {
    std::string_view what;
    Duration at;  ///< after the request
    Bytes bytes;
    std::string_view told;
  };
  const std::string_view noise =
      "bytes come that belong to no answer: noise, or another master is on this line; each answer "
      "is proved";
  const std::vector<Row> rows = {
      {"another master's request before the answer", 5ms, foreign_request, master_told},
      {"its request and its answer", 5ms, foreign_request + foreign_answer, master_told},
      {"its answer first", 5ms, foreign_answer, master_told},
      {"its answer behind ours", 15ms + 1us, foreign_answer, master_told},
      {"another unit's answer", 5ms, rtu_frame(2, holding({1, 1})), master_told},
      {"another count", 5ms, rtu_frame(1, holding({1})), master_told},
      {"a request of a function that is not spoken here", 17ms, hex("01 01 0000 0008 3DCC"),
       master_told},
      {"junk before the answer", 5ms, hex("FF 00"), noise},
      {"junk behind the answer", 17ms, hex("FF"), noise},
      {"the answer twice", 16ms, rtu_frame(1, holding({2, 3})),
       "answers come twice on this line; each answer is proved"},
  };
  for (const Row& row : rows) {
    for (const auto proof : {SessionOptions::Proof::none, SessionOptions::Proof::loopback}) {
      for (const bool others : {false, true}) {
        CAPTURE(row.what);
        CAPTURE(proof);
        CAPTURE(others);
        Line line(shared(proof));
        line.script.otherwise = react_in_time;
        line.script.on_request([&](ByteView request) {
          auto arrivals = react_in_time(request);
          arrivals.push_back({row.at, row.bytes});
          return arrivals;
        });
        const auto ask = [&] {
          return line.session.transact(read_two,
                                       others ? others_of(2, 2) : std::vector<OtherRead>());
        };
        const auto mark = line.session.mark();
        auto answer = ask();
        if (!line.session.is_undisturbed_since(mark).value()) answer = ask();
        CHECK(answer == holding({2, 3}));
        const std::size_t proved = line.script.sent.size();
        CHECK(proved > 1);
        CHECK(line.notices == std::vector<std::string>{std::string(row.told)});
        CHECK(ask() == holding({2, 3}));
        const std::size_t in_doubt = line.script.sent.size();
        CHECK(in_doubt >= proved + 2);
        CHECK(in_doubt <= proved + (others ? 2 : 3));
        line.clock.advance(20s);
        CHECK(ask() == holding({2, 3}));
        CHECK(line.script.sent.size() == in_doubt + 1);  // no proof when it was quiet
        CHECK(line.notices.size() == 1);
      }
    }
  }
}

TEST_CASE("rtu: answers that come twice never become another value") {
  for (const auto proof : {SessionOptions::Proof::none, SessionOptions::Proof::loopback}) {
    for (const bool others : {false, true}) {
      for (const Duration answer_after : {Duration(200us), Duration(6ms), Duration(15ms)}) {
        for (Duration again = 1ms; again <= 60ms; again += 1ms) {
          CAPTURE(others);
          CAPTURE(again.count());
          CAPTURE(answer_after.count());
          Line line(shared(proof));
          line.script.otherwise = [&](ByteView request) {
            const Bytes frame = rtu_frame(1, react(request));
            return std::vector<Arrival>{{answer_after, frame}, {answer_after + again, frame}};
          };
          for (std::uint16_t first = 10; first < 40; first += 2) {
            const auto answer = line.session.transact(
                read_holding(first, 2), others ? others_of(first, 2) : std::vector<OtherRead>());
            if (answer) CHECK(*answer == holding(numbers(first, 2)));
            if (!answer) CHECK(answer.error().code == Errc::no_answer);
          }
        }
      }
    }
  }
}

TEST_CASE("rtu: another master that polls all the time never gives a value") {
  // Both ask the same device, which answers one after the other; requests are heard on a bus, and
  // are not behind a device server.
  enum class Place : std::uint8_t { bus, server };
  for (const Place place : {Place::bus, Place::server}) {
    for (const auto proof : {SessionOptions::Proof::none, SessionOptions::Proof::loopback}) {
      for (const Duration period :
           {Duration(31ms), Duration(47ms), Duration(90ms), Duration(500ms)}) {
        unsigned right = 0;
        for (Duration phase = 0ms; phase < period; phase += 1ms) {
          CAPTURE(phase.count());
          CAPTURE(period.count());
          Line line(shared(proof));
          TimePoint free = line.clock.now();
          for (Duration at = phase; at < 3s; at += period) {
            line.clock.at(FakeClock::start + at, [&] {
              if (place == Place::bus) line.script.arrive(line.clock.now(), foreign_request);
              free = std::max(free, line.clock.now()) + 20ms;
              line.script.arrive(free, foreign_answer);
            });
          }
          line.script.otherwise = [&](ByteView request) {
            free = std::max(free, line.clock.now()) + 20ms;
            return std::vector<Arrival>{{free - line.clock.now(), rtu_frame(1, react(request))}};
          };
          const auto mark = line.session.mark();
          auto answer = line.session.transact(read_two, others_of(2, 2));
          const auto undisturbed = line.session.is_undisturbed_since(mark);
          if (!undisturbed || !*undisturbed) {
            answer = line.session.transact(read_two, others_of(2, 2));
          }
          if (answer) CHECK(*answer == holding({2, 3}));
          right += answer.has_value() ? 1U : 0U;
        }
        if (period >= 90ms) CHECK(right > 0);
      }
    }
  }
}

TEST_CASE("rtu: a line that another program has open, too, is doubtful for good") {
  FakeClock clock;
  test::Script script(clock);
  script.company = "minicom (process 4711)";
  script.otherwise = react_in_time;
  std::vector<std::string> notices;
  Session session(transport_to(script), clock, shared(SessionOptions::Proof::loopback),
                  {.notice = [&](std::string_view sentence) { notices.emplace_back(sentence); }});
  CHECK(notices == std::vector<std::string>{
                       "minicom (process 4711) has this line open, too: perhaps another master is "
                       "on this line; each answer is proved"});
  CHECK(session.transact(read_two, others_of(2, 2)) == holding({2, 3}));
  CHECK(script.sent.size() == 2);
  CHECK(script.sent[1].bytes[1] == 0x03);  // the order of answers would prove nothing
  clock.advance(1h);
  CHECK(session.transact(read_two, others_of(2, 2)) == holding({2, 3}));
  CHECK(script.sent.size() == 4);

  // It takes our answer, and we get the one to its own request.
  script.on_request(say(15ms, foreign_answer));
  CHECK(session.transact(read_two, others_of(2, 2)) == holding({2, 3}));
}

TEST_CASE("rtu: two answers of another program's shape prove nothing") {
  FakeClock clock;
  test::Script script(clock);
  script.company = "minicom (process 4711)";
  // It asks for two registers again and again, and takes our answers of that shape.
  script.otherwise = [](ByteView request) {
    const bool is_taken = test::request_of(Framing::rtu, request).pdu == read_holding(2, 2);
    return is_taken ? std::vector<Arrival>{{15ms, foreign_answer}} : react_in_time(request);
  };
  Session session(transport_to(script), clock, shared(SessionOptions::Proof::none));
  for (int i = 0; i < 10; ++i) {
    CHECK(session.transact(read_holding(2, 1), others_of(2, 1)) == holding({2}));
  }
  // Where there is no other way to ask, nothing proves it.
  CHECK_FALSE(session.transact(read_holding(2, 1)));
}

TEST_CASE("rtu: what cannot be proved is an error") {
  Line line(shared(SessionOptions::Proof::none));
  std::uint16_t value = 0;
  line.script.otherwise = [&](ByteView) {
    ++value;
    return std::vector<Arrival>{{15ms, rtu_frame(1, holding({value, value}))}};
  };
  line.script.arrive(FakeClock::start + 1ms, foreign_answer);
  const auto answer = line.session.transact(read_two);
  REQUIRE_FALSE(answer);
  CHECK(answer.error().code == Errc::no_answer);
  CHECK(message_of(answer.error()) ==
        "no answer to 'read 2 holding registers from 2' can be told from what others say on this "
        "line");
}

TEST_CASE("rtu: a value that never stands still can be proved where it has an order") {
  Line line(shared(SessionOptions::Proof::loopback));
  std::uint16_t value = 0;
  line.script.otherwise = [&](ByteView request) {
    Pdu answer = react(request);
    if (answer.function == 0x03) answer = holding(Registers(answer.data[0] / 2U, ++value));
    return std::vector<Arrival>{{15ms, rtu_frame(1, answer)}};
  };
  line.script.arrive(FakeClock::start + 1ms, foreign_answer);
  CHECK(line.session.transact(read_two, others_of(2, 2)));
  CHECK(line.session.transact(read_two, others_of(2, 2)));
}

TEST_CASE("rtu: an equal write waits until copies of the answer before have come") {
  Line line(shared(SessionOptions::Proof::loopback));
  line.script.arrive(FakeClock::start + 1ms, foreign_answer);
  line.script.on_request(react_in_time);
  line.script.on_request(react_in_time);
  CHECK(line.session.transact(arm) == arm);
  CHECK(line.session.transact(arm) == arm);
  CHECK(line.sent_at(1) - line.sent_at(0) >= 100ms);
}

// ---- TCP: ids and units ----

TEST_CASE("tcp: ids begin where the options say, never below 8000h, and wrap to there") {
  SessionOptions options = tcp();
  options.first_transaction = 0xFFFE;
  Line line(options);
  line.script.otherwise = tcp_answer(0ms, two_values);
  for (const unsigned id : {0xFFFEU, 0xFFFFU, 0x8000U}) {
    REQUIRE(line.session.transact(read_two));
    CHECK(transaction_of(line.script.sent.back()) == id);
  }
  options.first_transaction = 1;
  Line small(options);
  small.script.otherwise = tcp_answer(0ms, two_values);
  REQUIRE(small.session.transact(read_two));
  CHECK(transaction_of(small.script.sent.back()) == 0x8000);
}

TEST_CASE("tcp: what came before the request is not its answer, whatever its id") {
  Line line(tcp());
  line.script.arrive(FakeClock::start,
                     modbus::frame(Framing::tcp, {{0x8000}, {0}, holding({1, 1})}));
  line.script.on_request(tcp_answer(5ms, two_values));
  CHECK(line.session.transact(read_two) == two_values);
  CHECK(line.session.counters().strays == 1);
}

TEST_CASE("tcp: another unit's answer is not taken, and it is told which unit answered") {
  SessionOptions options = tcp();
  options.rules.units = Units::asked;
  Line line(options);
  line.script.on_request(say(5ms, modbus::frame(Framing::tcp, {{0x8000}, {2}, holding({1, 1})})));
  const auto answer = line.session.transact(read_two);
  REQUIRE_FALSE(answer);
  CHECK(answer.error().code == Errc::malformed_answer);
  CHECK(message_of(answer.error()) ==
        "unit 2 answered 'read 2 holding registers from 2', though unit 0 was asked");
  CHECK(answer.error().hint == "if that is the tool, ask for it with ?unit=2");
}

TEST_CASE("tcp: half a pushed frame is no part of an answer") {
  for (std::size_t size = 1; size < pushed_event.size(); ++size) {
    CAPTURE(size);
    Line line(tcp());
    line.script.on_request(say(5ms, part(pushed_event, 0, size)));
    CHECK(line.session.transact(read_two).error().code == Errc::no_answer);
    line.script.arrive(line.clock.now(), part(pushed_event, size, pushed_event.size()));
    line.script.on_request(tcp_answer(5ms, two_values));
    CHECK(line.session.transact(read_two) == two_values);
    CHECK(line.events() == std::vector<std::uint16_t>{1962});
  }
}

// ---- what came and was no answer ----

TEST_CASE("session: frames that came and did not fit are told, and nothing is called asleep") {
  Line line(rtu());
  line.script.on_request(say(20ms, rtu_frame(2, holding({7, 8}))));
  const auto response = line.session.transact(read_two);
  REQUIRE_FALSE(response);
  CHECK(response.error().code == Errc::no_answer);
  CHECK(message_of(response.error()).find("1 frame that does not answer it (the last: unit 2") !=
        std::string::npos);
  CHECK(hint_of(response.error()).find("asleep") == std::string::npos);

  Line awake(tcp());
  awake.script.on_request(say(20ms, event_frame(1, 1962)));
  const auto missed = awake.session.transact(read_two);
  REQUIRE_FALSE(missed);
  CHECK(message_of(missed.error()).find("but 1 event meanwhile") != std::string::npos);
  CHECK(hint_of(missed.error()).find("awake") != std::string::npos);

  Line silent(tcp());
  const auto nothing = silent.session.transact(read_two);
  REQUIRE_FALSE(nothing);
  CHECK(nothing.error().message.empty());
}

TEST_CASE("session: frames of the other framing name the target that fits") {
  Line line(tcp());
  line.script.on_request(say(20ms, rtu_frame(1, two_values)));
  const auto response = line.session.transact(read_two);
  REQUIRE_FALSE(response);
  CHECK(response.error().code == Errc::malformed_answer);
  CHECK(hint_of(response.error()).find("rtu+tcp://HOST:PORT") != std::string::npos);

  Line other(rtu());
  other.script.on_request(say(20ms, modbus::frame(Framing::tcp, {{0x0103}, {1}, two_values})));
  const auto foreign = other.session.transact(read_two);
  REQUIRE_FALSE(foreign);
  CHECK(foreign.error().code == Errc::malformed_answer);
  CHECK(hint_of(foreign.error()).find("as tcp://HOST:PORT") != std::string::npos);
}
