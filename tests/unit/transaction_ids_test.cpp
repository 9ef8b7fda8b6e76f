#include <doctest/doctest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "spindle/link/client.hpp"
#include "spindle/modbus/pdu.hpp"
#include "support/scripted_transport.hpp"

using namespace spindle;
using namespace spindle::link;
using namespace std::chrono_literals;
using modbus::Framing;
using modbus::Pdu;
using modbus::RegisterTable;
using modbus::TransactionIds;
using spindle::test::Arrival;
using spindle::test::Reaction;
using spindle::test::silence;

namespace {

constexpr Duration timeout = 1s;
constexpr std::uint8_t unit = 7;

SessionOptions options_of(TransactionIds ids,
                          SessionOptions::Proof proof = SessionOptions::Proof::none) {
  return {.rules = {.framing = Framing::tcp, .transactions = ids},
          .unit = {unit},
          .answer_timeout = timeout,
          .proof = proof,
          .others = SessionOptions::Others::possible};
}

struct Line : test::ScriptedPeer {
  explicit Line(const SessionOptions& options)
      : session(transport_to(script), clock, options,
                {.notice = [this](std::string_view text) { notices.emplace_back(text); }}) {}

  std::vector<std::string> notices = {};
  Session session;
};

enum class Ids : std::uint8_t { zero, constant, off_by_one, echoed };

/// The frame of a gateway that treats ids so.
Bytes framed(ByteView request, Pdu pdu, Ids ids, std::uint8_t from = unit) {
  modbus::Adu adu = test::request_of(Framing::tcp, request);
  adu.unit = {from};
  adu.pdu = std::move(pdu);
  if (ids == Ids::zero) adu.transaction = {0};
  if (ids == Ids::constant) adu.transaction = {0x1234};
  if (ids == Ids::off_by_one) ++adu.transaction.value;
  return modbus::frame(Framing::tcp, adu);
}

Reaction gateway(Duration after, Pdu pdu, Ids ids, std::uint8_t from = unit) {
  return [=](ByteView request) {
    return std::vector<Arrival>{{after, framed(request, pdu, ids, from)}};
  };
}

Pdu value_of(std::uint16_t value) {
  return modbus::read_response(RegisterTable::holding, Registers{value});
}

const Pdu read_one = modbus::read_request(RegisterTable::holding, {1}, 1);
const Pdu read_other = modbus::read_request(RegisterTable::holding, {2}, 1);
const Pdu gateway_silent = modbus::exception_response(0x03, 0x0B);

/// A device whose registers hold ten times their address, and that answers a loop-back.
Pdu tenfold(ByteView request) {
  const Pdu pdu = test::request_of(Framing::tcp, request).pdu;
  if (pdu.function == 0x08) return pdu;
  Registers registers;
  for (std::uint16_t at = 0; at < get_u16(pdu.data, 2); ++at) {
    registers.push_back(static_cast<std::uint16_t>(10 * (get_u16(pdu.data, 0) + at)));
  }
  return modbus::read_response(RegisterTable::holding, registers);
}

}  // namespace

TEST_CASE("ids: with any id but its own no answer counts, and the error names the key") {
  struct Row {
    Ids ids;
    std::string_view seen;
  };
  for (const Row& row :
       {Row{Ids::zero, "0000"}, Row{Ids::constant, "1234"}, Row{Ids::off_by_one, "8001"}}) {
    CAPTURE(row.seen);
    Line line(options_of(TransactionIds::echoed));
    line.script.on_request(gateway(5ms, value_of(271), row.ids));
    const auto answer = line.session.transact(read_one);
    REQUIRE_FALSE(answer);
    CHECK(answer.error().code == Errc::no_answer);
    CHECK(hint_of(answer.error()) ==
          "the answer has transaction id " + std::string(row.seen) +
              " instead of 8000: for a gateway that does not repeat ids, give "
              "transaction=ignored in the URL");
  }
}

TEST_CASE("ids: what is not the answer, or a late one, does not make the error name the key") {
  struct Row {
    std::string_view what;
    Pdu late;
    std::uint8_t from;
    std::vector<SpontaneousShape> spontaneous;
    Units units;
  };
  const std::vector<Row> rows = {
      {"another unit", value_of(1), 9, {}, Units::asked},
      {"another shape",
       tenfold(modbus::frame(Framing::tcp,
                             {{1}, {unit}, modbus::read_request(RegisterTable::holding, {1}, 2)})),
       unit,
       {},
       Units::asked},
      {"events", value_of(1), unit, {{0x04, 28}}, Units::asked},
      {"any unit", value_of(1), unit, {}, Units::any}};
  for (const Row& row : rows) {
    CAPTURE(row.what);
    SessionOptions options = options_of(TransactionIds::echoed);
    options.rules.spontaneous = row.spontaneous;
    options.rules.units = row.units;
    Line line(options);
    line.script.on_request(gateway(5ms, row.late, Ids::zero, row.from));
    const auto answer = line.session.transact(read_one);
    REQUIRE_FALSE(answer);
    CHECK(hint_of(answer.error()).find("transaction=ignored") == std::string::npos);
  }

  Line line(options_of(TransactionIds::echoed));
  line.script.on_request(gateway(timeout + 100ms, value_of(1), Ids::echoed));
  line.script.on_request(silence());
  CHECK_FALSE(line.session.transact(read_one));
  const auto answer = line.session.transact(read_other);
  REQUIRE_FALSE(answer);
  CHECK(hint_of(answer.error()).find("transaction=ignored") == std::string::npos);
}

TEST_CASE("ids: where they are ignored, unit, function and shape tell the answer") {
  for (const Ids ids : {Ids::zero, Ids::constant, Ids::off_by_one, Ids::echoed}) {
    CAPTURE(static_cast<int>(ids));
    Line line(options_of(TransactionIds::ignored));
    for (std::uint16_t value = 271; value < 274; ++value) {
      line.script.on_request(gateway(5ms, value_of(value), ids));
      CHECK(line.session.transact(read_one) == value_of(value));
    }
    line.script.on_request(gateway(5ms, gateway_silent, ids));
    CHECK(line.session.transact(read_one) == gateway_silent);
    CHECK(line.script.sent.size() == 4);  // a quiet connection costs no more than what is asked
    CHECK(line.notices.empty());

    line.script.on_request(gateway(5ms, value_of(1), ids, 9));
    CHECK(line.session.transact(read_one).error().code == Errc::no_answer);
  }
  Line shape(options_of(TransactionIds::ignored));
  shape.script.on_request(
      gateway(5ms, modbus::read_response(RegisterTable::holding, Registers{1, 2}), Ids::zero));
  CHECK(shape.session.transact(read_one).error().code == Errc::malformed_answer);
}

TEST_CASE("ids: after a timeout no late answer becomes the value of another register") {
  using Proof = SessionOptions::Proof;
  for (const Proof proof : {Proof::none, Proof::loopback}) {
    for (const std::size_t lost : {1U, 2U, 3U}) {
      // Of every length, also when the next request is out that the connection is proved with.
      for (Duration late = timeout + 1ms; late < 12s; late += 83ms) {
        CAPTURE(static_cast<int>(proof));
        CAPTURE(lost);
        CAPTURE(late.count());
        Line line(options_of(TransactionIds::ignored, proof));
        Client client(line.session, {}, 0);
        for (std::size_t count = 0; count < lost; ++count) {
          line.script.on_request(gateway(late, value_of(10), Ids::zero));
        }
        line.script.otherwise = [](ByteView request) {
          return std::vector<Arrival>{{5ms, framed(request, tenfold(request), Ids::zero)}};
        };
        for (std::size_t count = 0; count < lost; ++count) {
          const auto answer = client.read({RegisterTable::holding, 1, 1});
          if (answer) CHECK(*answer == Registers{10});
        }
        for (int count = 0; count < 40; ++count) {
          const auto answer = client.read({RegisterTable::holding, 2, 1});
          if (answer) CHECK(*answer == Registers{20});
          line.clock.advance(50ms);
        }
        line.clock.advance(30s);
        CHECK(client.read({RegisterTable::holding, 2, 1}) == Registers{20});
      }
    }
  }
}

TEST_CASE("ids: where answers were held up, each of them is counted before one is believed") {
  for (const std::uint16_t lost : std::initializer_list<std::uint16_t>{1, 2, 3}) {
    for (Duration held_up = 2s; held_up < 12s; held_up += 83ms) {
      CAPTURE(lost);
      CAPTURE(held_up.count());
      Line line(options_of(TransactionIds::ignored));
      Client client(line.session, {}, 0);
      test::Queue queue(line.clock, line.clock.now() + held_up, [](ByteView request) {
        return framed(request, tenfold(request), Ids::zero);
      });
      line.script.otherwise = [&](ByteView request) { return queue.answer(request); };
      for (std::uint16_t count = 0; count < lost; ++count) {
        const auto answer = client.read({RegisterTable::holding, 1, 1});
        if (answer) CHECK(*answer == Registers{10});
      }
      for (int count = 0; count < 40; ++count) {
        const auto answer = client.read({RegisterTable::holding, 2, 1});
        if (answer) CHECK(*answer == Registers{20});
      }
      CHECK(client.read({RegisterTable::holding, 2, 1}) == Registers{20});
    }
  }
}

TEST_CASE("ids: neighbours prove a value behind a timeout, but not in the shape of a late answer") {
  ReadLimits limits;
  limits.neighbours = Neighbours::anywhere;
  for (Duration held_up = 7s; held_up < 12s; held_up += 37ms) {
    CAPTURE(held_up.count());
    Line line(options_of(TransactionIds::ignored));
    Client client(line.session, limits, 0);
    test::Queue queue(line.clock, line.clock.now() + held_up, [](ByteView request) {
      const bool other = get_u16(test::request_of(Framing::tcp, request).pdu.data, 0) >= 100;
      const std::uint16_t count = get_u16(test::request_of(Framing::tcp, request).pdu.data, 2);
      const Pdu equal = modbus::read_response(RegisterTable::holding, Registers(count, 1000));
      return framed(request, other ? equal : tenfold(request), Ids::zero);
    });
    line.script.otherwise = [&](ByteView request) { return queue.answer(request); };
    for (std::uint16_t count = 1; count <= 3; ++count) {
      CHECK_FALSE(client.read({RegisterTable::holding, 100, count}));
    }
    for (int count = 0; count < 30; ++count) {
      const auto answer = client.read({RegisterTable::holding, 2, 1});
      if (answer) CHECK(*answer == Registers{20});
    }
  }
}

TEST_CASE("ids: an answer that comes twice is not the value of another register") {
  for (const Duration behind : {0ms, 5ms, 12ms, 20ms, 60ms}) {
    CAPTURE(behind.count());
    Line line(options_of(TransactionIds::ignored));
    Client client(line.session, {}, 0);
    line.script.on_request([=](ByteView request) {
      return std::vector<Arrival>{{5ms, framed(request, value_of(10), Ids::zero)},
                                  {5ms + behind, framed(request, value_of(10), Ids::zero)}};
    });
    line.script.otherwise = [](ByteView request) {
      return std::vector<Arrival>{{5ms, framed(request, tenfold(request), Ids::zero)}};
    };
    CHECK(client.read({RegisterTable::holding, 1, 1}) == Registers{10});
    for (int count = 0; count < 20; ++count) {
      const auto answer = client.read({RegisterTable::holding, 2, 1});
      if (answer) CHECK(*answer == Registers{20});
    }
  }
}

TEST_CASE("ids: behind half an answer only a new connection helps") {
  const auto half = [](ByteView request) {
    Bytes frame = framed(request, value_of(10), Ids::zero);
    frame.resize(9);
    return std::vector<Arrival>{{5ms, frame}};
  };
  Line line(options_of(TransactionIds::ignored));
  Client client(line.session, {}, 3);
  line.script.on_request(half);
  CHECK(client.read({RegisterTable::holding, 1, 1}).error().code == Errc::incomplete_answer);
  CHECK(line.session.is_out_of_step());
  CHECK(client.read({RegisterTable::holding, 2, 1}).error().code == Errc::incomplete_answer);
  CHECK(client.write(modbus::write_request(modbus::RegisterAddress{5}, 1)).error().code ==
        Errc::incomplete_answer);
  CHECK(line.script.sent.size() == 1);

  // With ids the next answer is found behind it.
  Line strict(options_of(TransactionIds::echoed));
  strict.script.on_request(half);
  CHECK_FALSE(strict.session.transact(read_one));
  strict.script.on_request(gateway(5ms, value_of(20), Ids::echoed));
  CHECK(strict.session.transact(read_other) == value_of(20));
}
