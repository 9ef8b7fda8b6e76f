#include "spindle/link/asked_line.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <vector>

#include "spindle/modbus/adu.hpp"
#include "spindle/modbus/pdu.hpp"
#include "support/scripted_transport.hpp"

using namespace spindle;
using namespace spindle::link;
using namespace std::chrono_literals;
using modbus::Framing;
using modbus::RegisterTable;
using spindle::test::Arrival;

namespace {

using Kind = AskedLine::Peer::Kind;

modbus::Pdu holding(Registers values) {
  return modbus::read_response(RegisterTable::holding, values);
}

/// A tool that one program has, and another one asks for.
struct World : test::ScriptedPeer {
  explicit World(Framing of = Framing::tcp, Kind kind = Kind::any, Rights rights = Rights::write)
      : framing(of),
        owner(line.join(opener()).value(), clock, options()),
        asked(
            line,
            {.kind = kind,
             .rights = rights,
             .answer =
                 [this](ByteView packet) {
                   answers.emplace_back(packet.begin(), packet.end());
                   return takes;
                 },
             .tell = [this](ByteView packet) { told.emplace_back(packet.begin(), packet.end()); }},
            clock) {}

  SharedLine::Open opener() {
    return [this]() -> Result<std::unique_ptr<Transport>> { return test::transport_to(script); };
  }
  SessionOptions options() const {
    return {
        .rules = {.framing = framing,
                  .spontaneous = framing == Framing::tcp ? std::vector<SpontaneousShape>{{0x04, 28}}
                                                         : std::vector<SpontaneousShape>{}},
        .unit = {1},
        .answer_timeout = 1s,
        .echo = LocalEcho::absent};
  }
  /// What comes back for a request with this id; nothing where the connection ends or stays silent.
  std::optional<modbus::Adu> ask(std::uint16_t id, modbus::Pdu pdu, std::uint8_t unit = 1) {
    answers.clear();
    goes_on = asked.take(
        modbus::frame(Framing::tcp, {.transaction = {id}, .unit = {unit}, .pdu = std::move(pdu)}));
    return answers.size() == 1 ? one_frame(answers.front()) : std::nullopt;
  }
  std::optional<std::uint8_t> exception_to(modbus::Pdu pdu) {
    const auto answer = ask(7, std::move(pdu));
    return answer ? modbus::exception_of(answer->pdu) : std::nullopt;
  }

  Framing framing;
  SharedLine line{clock};
  Session owner;
  AskedLine asked;
  std::vector<Bytes> answers = {};
  std::vector<Bytes> told = {};
  bool takes = true;
  bool goes_on = true;
};

const modbus::Pdu read_one = modbus::read_request(RegisterTable::holding, {2}, 1);

}  // namespace

TEST_CASE("asked line: an answer has the asker's own id and unit") {
  for (const Framing framing : {Framing::tcp, Framing::rtu}) {
    World world(framing);
    for (const auto id : std::initializer_list<std::uint16_t>{0, 1, 0x8000, 0xFFFF}) {
      world.script.on_request(test::answer(framing, 1ms, holding({271})));
      const auto answer = world.ask(id, read_one, 5);
      REQUIRE(answer);
      CHECK(answer->transaction.value == id);
      CHECK(answer->unit.value == 5);
      CHECK(answer->pdu == holding({271}));
    }
    REQUIRE(world.script.sent.size() == 4);
    CHECK(world.script.sent[0].bytes[framing == Framing::tcp ? 6 : 0] == 5);
  }
}

TEST_CASE("asked line: read-only lets through what changes nothing, and only that") {
  World world(Framing::tcp, Kind::any, Rights::read);
  const modbus::Pdu refused[] = {modbus::write_request({4}, 1),
                                 modbus::write_request({4}, Registers{1, 2}),
                                 modbus::write_coil_request({4}, 1),
                                 modbus::write_coils_request({4}, Registers{1}),
                                 {.function = 0x16, .data = {0, 4, 0, 0, 0, 1}},
                                 {.function = 0x17, .data = Bytes(11, 0)},
                                 {.function = 0x15, .data = {0}},
                                 {.function = 0x08, .data = {0, 1, 0, 0}},
                                 {.function = 0x2B, .data = {0x0D, 0}},
                                 {.function = 0x5A, .data = {}}};
  for (const modbus::Pdu& pdu : refused) {
    CAPTURE(pdu.function);
    CHECK(world.exception_to(pdu) == 0x01);
  }
  CHECK(world.script.sent.empty());
  const modbus::Pdu passed[] = {modbus::read_request(RegisterTable::coil, {1}, 3),
                                modbus::read_request(RegisterTable::input, {1}, 3),
                                modbus::loopback_request(77),
                                modbus::report_server_id_request(),
                                {.function = 0x07, .data = {}},
                                {.function = 0x0B, .data = {}},
                                {.function = 0x14, .data = {7, 6, 0, 4, 0, 1, 0, 2}},
                                {.function = 0x18, .data = {0, 4}},
                                {.function = 0x2B, .data = {0x0E, 1, 0}}};
  for (const modbus::Pdu& pdu : passed) {
    CAPTURE(pdu.function);
    world.script.on_request(
        test::answer(Framing::tcp, 1ms, modbus::exception_response(pdu.function, 0x02)));
    CHECK(world.exception_to(pdu) == 0x02);
  }
  CHECK(world.script.sent.size() == std::size(passed));
}

TEST_CASE("asked line: a malformed request never reaches the line") {
  World world;
  CHECK(world.exception_to({.function = 0x03, .data = {1}}) == 0x03);
  CHECK(world.exception_to({.function = 0x03, .data = {0, 0, 0, 0}}) == 0x03);
  CHECK(world.exception_to({.function = 0x10, .data = {0, 0, 0, 2, 9}}) == 0x03);
  CHECK(world.script.sent.empty());
  CHECK_FALSE(world.asked.take(Bytes{0, 1, 0, 9, 0, 2, 1, 3}));  // another protocol
  CHECK_FALSE(world.asked.take(Bytes{0, 1, 0, 0, 0, 9, 1, 3}));  // cut off
  CHECK_FALSE(world.asked.take(encode(Hello{})));                // for spindles only
}

TEST_CASE("asked line: no answer is exception 0Bh, no link 0Ah; a spindle is told the error") {
  World world;
  CHECK(world.exception_to(read_one) == 0x0B);
  world.line.close({.code = Errc::closed, .message = "gone"});
  CHECK(world.exception_to(read_one) == 0x0A);
  CHECK(world.goes_on);

  World spindle(Framing::tcp, Kind::spindle);
  CHECK_FALSE(spindle.ask(9, read_one));
  REQUIRE(spindle.answers.size() == 1);
  const auto note = decode_owner_note(spindle.answers.front());
  REQUIRE(note);
  const auto& unanswered = std::get<Unanswered>(*note);
  CHECK(unanswered.request.value == 9);
  REQUIRE(unanswered.error);
  CHECK(unanswered.error->code == Errc::no_answer);
  CHECK(unanswered.error->tried == "read 1 holding register from 2");
}

TEST_CASE("asked line: a spindle says how it is to be asked, and hears events") {
  World world(Framing::tcp, Kind::spindle);
  CHECK(world.asked.take(encode(Hello{})));
  CHECK_FALSE(std::get<Welcome>(*decode_owner_note(world.answers.at(0))).trouble);
  const auto event = modbus::frame(
      Framing::tcp, {.transaction = {1},
                     .unit = {1},
                     .pdu = modbus::read_response(RegisterTable::input, Registers(14, 5))});
  const auto during_a_read = [&] {
    world.script.on_request([&](ByteView bytes) {
      return std::vector<Arrival>{{1ms, event},
                                  {2ms, test::response_to(Framing::tcp, bytes, holding({1}))}};
    });
    CHECK(world.ask(3, read_one)->pdu == holding({1}));
  };
  during_a_read();
  CHECK(world.told.empty());
  CHECK(world.asked.take(encode(Manner{world.options()})));
  during_a_read();
  CHECK(world.told == std::vector<Bytes>{event});
  // Its own patience counts.
  CHECK(world.asked.take(encode(Haste{.answer_timeout = 50ms})));
  const TimePoint began = world.clock.now();
  CHECK_FALSE(world.ask(4, read_one));
  CHECK(world.clock.now() - began == 50ms);
}

TEST_CASE("asked line: a read that looks like an event is made in two") {
  World world;
  const auto asked = modbus::read_request(RegisterTable::input, {3200}, 14);
  Registers all;
  for (std::uint16_t value = 0; value < 14; ++value) all.push_back(value);
  world.script.otherwise = [&](ByteView bytes) {
    const modbus::Pdu pdu = test::request_of(Framing::tcp, bytes).pdu;
    const std::uint16_t first = static_cast<std::uint16_t>(get_u16(pdu.data, 0) - 3200);
    const std::uint16_t count = get_u16(pdu.data, 2);
    const auto values = RegisterView(all).subspan(first, count);
    // An event that copies the id of the request comes first.
    Bytes event = modbus::frame(
        Framing::tcp, {.transaction = {get_u16(bytes, 0)},
                       .unit = {1},
                       .pdu = modbus::read_response(RegisterTable::input, Registers(14, 99))});
    return std::vector<Arrival>{
        {1ms, event},
        {2ms, test::response_to(Framing::tcp, bytes,
                                modbus::read_response(RegisterTable::input, values))}};
  };
  CHECK(world.ask(1, asked)->pdu == modbus::read_response(RegisterTable::input, all));
  CHECK(world.script.sent.size() == 2);
}

TEST_CASE("asked line: a broadcast is sent once, and only a spindle learns that") {
  World world(Framing::rtu, Kind::spindle);
  CHECK_FALSE(world.ask(5, modbus::write_request({4}, 1), 0));
  REQUIRE(world.answers.size() == 1);
  const auto note = std::get<Unanswered>(*decode_owner_note(world.answers.front()));
  CHECK(note.request.value == 5);
  CHECK_FALSE(note.error);
  CHECK(world.script.sent.size() == 1);
  CHECK(world.script.sent.front().bytes.front() == 0);

  World other(Framing::rtu);
  CHECK_FALSE(other.ask(5, modbus::write_request({4}, 1), 0));
  CHECK(other.answers.empty());
  CHECK(other.script.sent.size() == 1);
}

TEST_CASE("owner notes: what is written is read, and nothing else is a note") {
  SessionOptions options;
  options.unit = {3};
  options.gap = 5500us;
  options.answer_timeout = 2s;
  options.proof = SessionOptions::Proof::loopback;
  options.rules.units = Units::any;
  options.rules.spontaneous = {{0x04, 28}, {0x03, 2}};
  const Bytes packet = encode(Manner{options});
  const auto note = decode_owner_note(packet);
  REQUIRE(note);
  const SessionOptions& read = std::get<Manner>(*note).options;
  CHECK(read.unit.value == 3);
  CHECK(read.gap == options.gap);
  CHECK(read.answer_timeout == options.answer_timeout);
  CHECK(read.proof == options.proof);
  CHECK(read.rules.units == Units::any);
  CHECK(read.rules.spontaneous.size() == 2);
  for (std::size_t size = 0; size < packet.size(); ++size) {
    CHECK_FALSE(decode_owner_note(ByteView(packet).first(size)));
  }
  const Error error{.code = Errc::no_answer,
                    .message = "no answer",
                    .hint = "wait",
                    .tried = "read",
                    .waited = 1s};
  const auto told = decode_owner_note(encode(Unanswered{.request = {7}, .error = error}));
  const Error heard = std::get<Unanswered>(told.value()).error.value();
  CHECK(heard.code == Errc::no_answer);
  CHECK(heard.message == "no answer");
  CHECK(heard.waited == error.waited);
  CHECK_FALSE(is_owner_note(
      modbus::frame(Framing::tcp, {.transaction = {1}, .unit = {}, .pdu = read_one})));
}
