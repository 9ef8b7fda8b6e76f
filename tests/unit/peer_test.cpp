#include "spindle/sim/peer.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "hex.hpp"
#include "spindle/modbus/pdu.hpp"
#include "support/fault_plan.hpp"

using namespace spindle;
using namespace spindle::sim;
using namespace std::chrono_literals;
using modbus::Framing;
using spindle::test::hex;
using spindle::test::plan_of;

namespace {

constexpr TimePoint start = TimePoint(1h);

// Register 2 reads 271 for ever; writes are echoed and remembered.
class ScriptedServer final : public Server {
 public:
  std::optional<modbus::Pdu> answer(ConnectionId, modbus::UnitId unit, const modbus::Pdu& request,
                                    TimePoint) override {
    ++executed;
    if (!answers_to(unit)) return std::nullopt;
    const auto parsed = modbus::parse_request(request);
    if (parsed && std::holds_alternative<modbus::ReadRequest>(*parsed)) {
      return modbus::Pdu{request.function, hex("02 010F")};
    }
    return request;
  }
  [[nodiscard]] bool answers_to(modbus::UnitId unit) const override {
    return unit.value == 0 || unit.value == 1;
  }
  void advance(TimePoint) override {}
  [[nodiscard]] std::optional<TimePoint> next_change() const override { return std::nullopt; }
  std::vector<Push> take_pushes() override { return {}; }
  [[nodiscard]] std::optional<modbus::Pdu> event_frame() const override {
    return modbus::Pdu{0x04, hex("02 07AA")};
  }
  void connected(ConnectionId) override { ++clients; }
  void disconnected(ConnectionId) override { --clients; }

  int executed = 0;
  int clients = 0;
};

struct Sent {
  Duration at;
  Bytes bytes;
};

// Everything that the peer sends, each piece at the time it asks to be woken for.
struct Log {
  std::vector<Sent> pieces;
  std::optional<Duration> closed_at;
};

Log drain(Peer& peer) {
  Log log;
  TimePoint now = start;
  while (const auto due = peer.next_due()) {
    now = std::max(now, *due);
    if (peer.closed(now)) {
      log.closed_at = now - start;
      return log;
    }
    Bytes piece = peer.take(now);
    REQUIRE_FALSE((piece.empty() && !peer.closed(now)));
    if (!piece.empty()) log.pieces.push_back({now - start, std::move(piece)});
  }
  return log;
}

std::string show(const std::vector<Sent>& pieces) {
  std::string text;
  for (const Sent& piece : pieces) {
    const auto us = std::chrono::duration_cast<std::chrono::microseconds>(piece.at).count();
    text += std::to_string(us) + "us: " + to_hex(piece.bytes) + "; ";
  }
  return text;
}

const Bytes tcp_read = hex("8002 0000 0006 00 03 0002 0001");
const Bytes tcp_next_read = hex("8003 0000 0006 00 03 0002 0001");
const Bytes tcp_write = hex("8004 0000 0006 00 06 0002 0007");
const Bytes rtu_read = hex("01 03 0002 0001 25CA");
const Bytes rtu_write = hex("01 06 0002 0007 69C8");

struct Row {
  std::vector<std::string> faults;
  std::vector<Sent> expected;
  std::optional<Duration> closed_at = std::nullopt;
};

void check_rows(Framing framing, const std::vector<Bytes>& requests, const std::vector<Row>& rows) {
  for (const Row& row : rows) {
    std::string name;
    for (const std::string& fault : row.faults) name += fault + " ";
    CAPTURE(name);
    ScriptedServer server;
    const FaultPlan plan = plan_of(row.faults);
    AnswerCounter counter;
    Peer peer(server, {1}, framing, plan, counter);
    for (const Bytes& request : requests) peer.receive(request, start);
    const Log log = drain(peer);
    CHECK(show(log.pieces) == show(row.expected));
    CHECK(log.closed_at == row.closed_at);
  }
}

}  // namespace

TEST_CASE("one read over TCP, under every fault") {
  const Bytes answer = hex("8002 0000 0005 00 03 02 010F");
  check_rows(
      Framing::tcp, {tcp_read},
      {
          {{}, {{0ms, answer}}},
          {{"latency=30ms"}, {{30ms, answer}}},
          {{"latency=30ms", "latency=10ms"}, {{30ms, answer}}},
          {{"lost"}, {}},
          {{"late=40ms"}, {{40ms, answer}}},
          {{"repeated"}, {{0ms, hex("8002 0000 0005 00 03 02 010F 8002 0000 0005 00 03 02 010F")}}},
          {{"split=4"}, {{0ms, hex("8002 0000")}, {1ms, hex("0005 00 03")}, {2ms, hex("02 010F")}}},
          {{"split=11"}, {{0ms, answer}}},
          {{"glued"}, {{50ms, answer}}},
          {{"half"}, {{0ms, hex("8002 0000 00")}}},
          {{"wrong-unit"}, {{0ms, hex("8002 0000 0005 4D 03 02 010F")}}},
          {{"wrong-unit=9"}, {{0ms, hex("8002 0000 0005 09 03 02 010F")}}},
          {{"wrong-transaction"}, {{0ms, hex("8003 0000 0005 00 03 02 010F")}}},
          {{"wrong-transaction=0x8000"}, {{0ms, hex("0002 0000 0005 00 03 02 010F")}}},
          {{"fixed-transaction"}, {{0ms, hex("0000 0000 0005 00 03 02 010F")}}},
          {{"fixed-transaction=7"}, {{0ms, hex("0007 0000 0005 00 03 02 010F")}}},
          {{"wrong-protocol"}, {{0ms, hex("8002 0001 0005 00 03 02 010F")}}},
          {{"wrong-echo"}, {{0ms, answer}}},
          {{"wrong-length"}, {{0ms, hex("8002 0000 0007 00 03 04 010F 0000")}}},
          {{"wrong-header-length"}, {{0ms, hex("8002 0000 0007 00 03 02 010F 0000")}}},
          {{"wrong-function"}, {{0ms, hex("8002 0000 0005 00 65 02 010F")}}},
          {{"garbage=3"}, {{0ms, hex("FF FF FF")}}},
          {{"noise=2"}, {{0ms, hex("FFFF 8002 0000 0005 00 03 02 010F")}}},
          {{"bad-crc"}, {{0ms, answer}}},
          {{"exception=0x0E"}, {{0ms, hex("8002 0000 0003 00 83 0E")}}},
          {{"push-before=1"},
           {{0ms, hex("0001 0000 0005 00 04 02 07AA 8002 0000 0005 00 03 02 010F")}}},
          {{"push-before=pending"},
           {{0ms, hex("8002 0000 0005 00 04 02 07AA 8002 0000 0005 00 03 02 010F")}}},
          {{"push-inside=1"},
           {{0ms, hex("0001 0000 00")},
            {1ms, hex("05 00 04 02 07AA 8002 0000 0005 00 03 02 010F")}}},
          {{"push-after=0x0203"},
           {{0ms, hex("8002 0000 0005 00 03 02 010F 0203 0000 0005 00 04 02 07AA")}}},
          {{"close"}, {}, 0ms},
          {{"close-inside"}, {{0ms, hex("8002 0000 00")}}, 0ms},
          {{"close-after"}, {{0ms, answer}}, 0ms},
          {{"ignore-write"}, {{0ms, answer}}},
          {{"store-other"}, {{0ms, answer}}},
      });
}

TEST_CASE("faults that strike the same answer combine") {
  check_rows(
      Framing::tcp, {tcp_read},
      {
          {{"push-before=1", "split=11"},
           {{0ms, hex("0001 0000 0005 00 04 02 07AA")},
            {1ms, hex("8002 0000 0005 00 03 02 010F")}}},
          {{"push-before=1", "glued"},
           {{50ms, hex("0001 0000 0005 00 04 02 07AA 8002 0000 0005 00 03 02 010F")}}},
          {{"push-before=1", "lost"}, {{0ms, hex("0001 0000 0005 00 04 02 07AA")}}},
          {{"push-before", "push-after"},
           {{0ms, hex("0001 0000 0005 00 04 02 07AA 8002 0000 0005 00 03 02 010F "
                      "0002 0000 0005 00 04 02 07AA")}}},
          {{"split=6", "close-after", "latency=5ms"},
           {{5ms, hex("8002 0000 0005")}, {6ms, hex("00 03 02 010F")}},
           6ms},
          {{"exception=2", "wrong-unit=1", "noise"}, {{0ms, hex("FF 8002 0000 0003 01 83 02")}}},
          {{"wrong-length", "wrong-header-length=1"},
           {{0ms, hex("8002 0000 0008 00 03 04 010F 0000 00")}}},
          {{"late=9ms", "close"}, {}, 9ms},
      });
}

TEST_CASE("a write over TCP: echoes") {
  check_rows(Framing::tcp, {tcp_write},
             {
                 {{}, {{0ms, hex("8004 0000 0006 00 06 0002 0007")}}},
                 {{"wrong-echo"}, {{0ms, hex("8004 0000 0006 00 06 0002 0008")}}},
                 {{"wrong-length"}, {{0ms, hex("8004 0000 0008 00 06 0002 0007 0000")}}},
                 {{"exception=2", "wrong-echo"}, {{0ms, hex("8004 0000 0003 00 86 02")}}},
             });
}

// Checksums: Modbus over Serial Line 1.02, 6.2.2, computed apart from the program.
TEST_CASE("a read on a serial line, under the faults that differ there") {
  const Bytes answer = hex("01 03 02 010F F9D0");
  check_rows(Framing::rtu, {rtu_read},
             {
                 {{}, {{0ms, answer}}},
                 {{"bad-crc"}, {{0ms, hex("01 03 02 010F F9D1")}}},
                 {{"noise"}, {{0ms, hex("FF 01 03 02 010F F9D0")}}},
                 {{"half"}, {{0ms, hex("01 03 02")}}},
                 {{"wrong-unit"}, {{0ms, hex("4D 03 02 010F E81E")}}},
                 {{"wrong-function"}, {{0ms, hex("01 65 02 010F E758")}}},
                 {{"wrong-length"}, {{0ms, hex("01 03 04 010F 0000 CBCC")}}},
                 {{"exception=0x0E"}, {{0ms, hex("01 83 0E C0F4")}}},
                 {{"push-before"}, {{0ms, hex("01 04 02 07AA 3B7F 01 03 02 010F F9D0")}}},
                 {{"wrong-transaction"}, {{0ms, answer}}},
                 {{"wrong-protocol"}, {{0ms, answer}}},
                 {{"wrong-header-length"}, {{0ms, answer}}},
             });
  check_rows(Framing::rtu, {rtu_write},
             {
                 {{}, {{0ms, hex("01 06 0002 0007 69C8")}}},
                 {{"wrong-echo"}, {{0ms, hex("01 06 0002 0008 29CC")}}},
             });
}

TEST_CASE("two requests: what waits for what") {
  const Bytes first = hex("8002 0000 0005 00 03 02 010F");
  const Bytes second = hex("8003 0000 0005 00 03 02 010F");
  const Bytes both = hex("8002 0000 0005 00 03 02 010F 8003 0000 0005 00 03 02 010F");
  check_rows(Framing::tcp, {tcp_read, tcp_next_read},
             {
                 {{}, {{0ms, first}, {0ms, second}}},
                 {{"latency=20ms@1"}, {{20ms, first}, {20ms, second}}},
                 {{"late=20ms@1"}, {{0ms, second}, {20ms, first}}},
                 {{"late=20ms@2"}, {{0ms, first}, {20ms, second}}},
                 {{"lost@1"}, {{0ms, second}}},
                 {{"glued@1"}, {{0ms, both}}},
                 {{"glued"}, {{50ms, both}}},
                 {{"glued@1", "latency=60ms@2"}, {{50ms, first}, {60ms, second}}},
                 {{"glued@1", "lost@2"}, {{50ms, first}}},
                 {{"glued@1", "close@2"}, {{0ms, first}}, 0ms},
                 {{"split=6@1"},
                  {{0ms, hex("8002 0000 0005")}, {1ms, hex("00 03 02 010F")}, {1ms, second}}},
                 // A frame that has begun is not cut by one that is due meanwhile.
                 {{"split=6@1", "late=0@2"},
                  {{0ms, hex("8002 0000 0005")}, {1ms, hex("00 03 02 010F")}, {1ms, second}}},
                 {{"close@1"}, {}, 0ms},
                 {{"close-after@2"}, {{0ms, first}, {0ms, second}}, 0ms},
             });
}

TEST_CASE("answers are counted over all connections of a server, silence is not") {
  ScriptedServer server;
  const FaultPlan plan = plan_of({"exception=4@2"});
  AnswerCounter counter;
  Peer one(server, {1}, Framing::rtu, plan, counter);
  Peer other(server, {2}, Framing::rtu, plan, counter);
  one.receive(rtu_read, start);
  one.receive(hex("02 03 0002 0001 25F9"), start);  // another unit's
  CHECK(counter.value == 1);
  other.receive(rtu_read, start);
  CHECK(counter.value == 2);
  CHECK(one.take(start) == hex("01 03 02 010F F9D0"));
  CHECK(other.take(start)[1] == 0x83);
}

TEST_CASE("what is lost or closed was executed, what got an exception was not") {
  struct Case {
    std::string fault;
    int executed;
  };
  for (const Case& row : {Case{"lost", 1}, Case{"close", 1}, Case{"exception=4", 0}}) {
    CAPTURE(row.fault);
    ScriptedServer server;
    const FaultPlan plan = plan_of({row.fault});
    AnswerCounter counter;
    Peer peer(server, {1}, Framing::tcp, plan, counter);
    peer.receive(tcp_write, start);
    CHECK(server.executed == row.executed);
  }
}

TEST_CASE("an exception fault does not make other units speak") {
  ScriptedServer server;
  const FaultPlan plan = plan_of({"exception=4"});
  AnswerCounter counter;
  Peer peer(server, {1}, Framing::rtu, plan, counter);
  peer.receive(hex("02 03 0002 0001 25F9"), start);
  CHECK_FALSE(peer.next_due().has_value());
}

TEST_CASE("requests may arrive in any pieces") {
  for (std::size_t cut = 1; cut < tcp_read.size(); ++cut) {
    CAPTURE(cut);
    ScriptedServer server;
    const FaultPlan plan;
    AnswerCounter counter;
    Peer peer(server, {1}, Framing::tcp, plan, counter);
    peer.receive(ByteView(tcp_read).first(cut), start);
    CHECK_FALSE(peer.next_due().has_value());
    peer.receive(ByteView(tcp_read).subspan(cut), start + 3ms);
    CHECK(peer.next_due() == start + 3ms);
    CHECK(peer.take(start + 3ms) == hex("8002 0000 0005 00 03 02 010F"));
  }
}

TEST_CASE("junk closes a TCP connection behind the answers that are due") {
  ScriptedServer server;
  const FaultPlan plan = plan_of({"latency=10ms"});
  AnswerCounter counter;
  Peer peer(server, {1}, Framing::tcp, plan, counter);
  Bytes bytes = tcp_read;
  bytes.insert(bytes.end(), 8, 0xFF);
  peer.receive(bytes, start);
  peer.receive(tcp_read, start);  // too late
  CHECK_FALSE(peer.closed(start));
  const Log log = drain(peer);
  CHECK(log.pieces.size() == 1);
  CHECK(log.closed_at == Duration(10ms));
  CHECK(server.executed == 1);
}

TEST_CASE("junk on a serial line is dropped") {
  ScriptedServer server;
  const FaultPlan plan;
  AnswerCounter counter;
  Peer peer(server, {1}, Framing::rtu, plan, counter);
  peer.receive(Bytes(600, 0xFF), start);
  peer.receive(rtu_read, start);
  CHECK(peer.take(start) == hex("01 03 02 010F F9D0"));
  CHECK_FALSE(peer.closed(start));
}

TEST_CASE("pushed frames count up and go out at their time") {
  ScriptedServer server;
  const FaultPlan plan = plan_of({"latency=10ms"});
  AnswerCounter counter;
  Peer peer(server, {1}, Framing::tcp, plan, counter);
  peer.receive(tcp_read, start);
  peer.push({0x04, hex("02 0001")}, start + 2ms);
  peer.push({0x04, hex("02 0002")}, start + 3ms);
  CHECK(show(drain(peer).pieces) == show({{2ms, hex("0001 0000 0005 00 04 02 0001")},
                                          {3ms, hex("0002 0000 0005 00 04 02 0002")},
                                          {10ms, hex("8002 0000 0005 00 03 02 010F")}}));
}

TEST_CASE("a frame kept back leaves with a pushed one") {
  ScriptedServer server;
  const FaultPlan plan = plan_of({"glued"});
  AnswerCounter counter;
  Peer peer(server, {1}, Framing::tcp, plan, counter);
  peer.receive(tcp_read, start);
  CHECK(peer.take(start + 49ms).empty());
  peer.push({0x04, hex("02 0001")}, start + 49ms);
  CHECK(peer.take(start + 49ms) ==
        hex("8002 0000 0005 00 03 02 010F 0001 0000 0005 00 04 02 0001"));
  CHECK_FALSE(peer.next_due().has_value());
}

TEST_CASE("the server hears of clients coming and going") {
  ScriptedServer server;
  const FaultPlan plan;
  AnswerCounter counter;
  {
    const Peer peer(server, {1}, Framing::tcp, plan, counter);
    CHECK(server.clients == 1);
  }
  CHECK(server.clients == 0);
}
