#include "spindle/link/client.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include "spindle/modbus/pdu.hpp"
#include "support/scripted_transport.hpp"
#include "unit/hex.hpp"

using namespace spindle;
using namespace spindle::link;
using namespace std::chrono_literals;
using modbus::Framing;
using modbus::Pdu;
using modbus::RegisterTable;
using spindle::test::Arrival;
using spindle::test::FakeClock;
using spindle::test::hex;
using spindle::test::Script;

namespace {

constexpr RegisterTable holding = RegisterTable::holding;
constexpr RegisterTable input = RegisterTable::input;

using Ranges = std::vector<RegisterRange>;

/// Single registers first...last.
Ranges singles(RegisterTable table, std::uint16_t first, std::uint16_t last) {
  Ranges ranges;
  for (std::uint32_t at = first; at <= last; ++at) {
    ranges.push_back({table, static_cast<std::uint16_t>(at), 1});
  }
  return ranges;
}

Ranges operator+(Ranges head, const Ranges& tail) {
  head.insert(head.end(), tail.begin(), tail.end());
  return head;
}

Ranges requests_of(const std::vector<PlannedRead>& plan) {
  Ranges requests;
  for (const PlannedRead& planned : plan) requests.push_back(planned.range);
  return requests;
}

// bm-bmt.md: 100 registers a read, events of 14 input registers.
ReadLimits bm_limits() {
  return {.max_read = 100,
          .contiguous = {{input, 3200, 14}, {input, 3300, 14}},
          .forbidden_shapes = {RegisterRange{input, 0, 14}}};
}

std::uint16_t value_at(RegisterTable table, std::uint32_t address) {
  return static_cast<std::uint16_t>(address * 31U + (table == input ? 7U : 0U));
}

/// A server of registers. Those in `holes` make it refuse a read with 02, those in `trouble` with
/// the code there.
struct Server {
  std::vector<Arrival> operator()(ByteView bytes) {
    return {{1ms, test::response_to(Framing::tcp, bytes,
                                    react(test::request_of(Framing::tcp, bytes).pdu))}};
  }

  Pdu react(const Pdu& pdu) {
    const auto request = modbus::parse_request(pdu).value();
    const auto* read = std::get_if<modbus::ReadRequest>(&request);
    if (read == nullptr) return pdu;
    reads.push_back({read->table, read->first.value, read->count});
    Registers values;
    for (std::uint32_t at = read->first.value; values.size() < read->count; ++at) {
      const std::uint32_t key = register_key(read->table, static_cast<std::uint16_t>(at));
      if (holes.count(key) > 0) return modbus::exception_response(pdu.function, 2);
      if (const auto found = trouble.find(key); found != trouble.end()) {
        return modbus::exception_response(pdu.function, found->second);
      }
      values.push_back(value_at(read->table, at));
    }
    return modbus::read_response(read->table, values);
  }

  std::set<std::uint32_t> holes = {};
  std::map<std::uint32_t, std::uint8_t> trouble = {};
  Ranges reads = {};
};

struct Bench : test::ScriptedPeer {
  explicit Bench(ReadLimits limits = {}, unsigned retries = 0)
      : session(transport_to(script), clock, {.unit = {0}}), client(session, limits, retries) {
    script.otherwise = [this](ByteView bytes) { return server(bytes); };
  }

  Server server;
  Session session;
  Client client;
};

void check_values(const RegisterImage& image, const RegisterRange& range) {
  const auto values = image.get(range);
  REQUIRE(values);
  REQUIRE(values->size() == range.count);
  for (std::uint16_t i = 0; i < range.count; ++i) {
    CHECK((*values)[i] == value_at(range.table, std::uint32_t{range.first} + i));
  }
}

/// Numbers that are the same on every machine.
class Numbers {
 public:
  explicit Numbers(std::uint32_t seed) : engine_(seed) {}
  std::uint16_t below(std::uint32_t limit) { return static_cast<std::uint16_t>(engine_() % limit); }

 private:
  std::minstd_rand engine_;
};

}  // namespace

// ---- plan_reads() ----

TEST_CASE("the fewest requests") {
  struct Row {
    std::string_view what;
    Ranges wanted;
    ReadLimits limits;
    Ranges expected;
    std::set<std::uint32_t> absent = {};
  };
  const ReadLimits plain{.max_read = 100};
  const ReadLimits ten{.max_read = 10, .contiguous = {{holding, 100, 50}}};
  const std::vector<Row> rows = {
      {"nothing", {}, plain, {}},
      {"one", {{holding, 7, 1}}, plain, {{holding, 7, 1}}},
      {"neighbours", {{holding, 7, 1}, {holding, 8, 1}}, plain, {{holding, 7, 2}}},
      {"in any order", {{holding, 8, 1}, {holding, 7, 1}}, plain, {{holding, 7, 2}}},
      {"twice the same", {{holding, 7, 2}, {holding, 7, 2}}, plain, {{holding, 7, 2}}},
      {"overlapping", {{holding, 7, 3}, {holding, 9, 3}}, plain, {{holding, 7, 5}}},
      {"one inside another", {{holding, 7, 9}, {holding, 9, 2}}, plain, {{holding, 7, 9}}},
      {"tables apart", {{holding, 7, 1}, {input, 8, 1}}, plain, {{holding, 7, 1}, {input, 8, 1}}},
      {"a gap that may not be read",
       {{holding, 7, 1}, {holding, 9, 1}},
       plain,
       {{holding, 7, 1}, {holding, 9, 1}}},
      {"a gap inside a contiguous area",
       {{holding, 100, 1}, {holding, 105, 1}},
       ten,
       {{holding, 100, 6}}},
      {"a gap at the end of the area",
       {{holding, 145, 1}, {holding, 150, 1}},
       ten,
       {{holding, 145, 6}}},
      {"a gap that leaves the area",
       {{holding, 145, 1}, {holding, 152, 1}},
       ten,
       {{holding, 145, 1}, {holding, 152, 1}}},
      {"the same gap in the other table",
       {{input, 100, 1}, {input, 105, 1}},
       ten,
       {{input, 100, 1}, {input, 105, 1}}},
      {"a gap with an absent register",
       {{holding, 100, 1}, {holding, 105, 1}},
       ten,
       {{holding, 100, 1}, {holding, 105, 1}},
       {register_key(holding, 103)}},
      {"an absent register of the other table",
       {{holding, 100, 1}, {holding, 105, 1}},
       ten,
       {{holding, 100, 6}},
       {register_key(input, 103)}},
      {"absent registers outside the gap",
       {{holding, 100, 1}, {holding, 105, 1}},
       ten,
       {{holding, 100, 6}},
       {register_key(holding, 99), register_key(holding, 106)}},
      {"a bridge that would be too long",
       {{holding, 100, 1}, {holding, 110, 1}},
       ten,
       {{holding, 100, 1}, {holding, 110, 1}}},
      {"a pair is not split",
       {{holding, 1, 9}, {holding, 10, 2}},
       ten,
       {{holding, 1, 9}, {holding, 10, 2}}},
      {"longer than the limit",
       {{holding, 1, 25}},
       ten,
       {{holding, 1, 10}, {holding, 11, 10}, {holding, 21, 5}}},
      {"at the end of the addresses",
       {{holding, 65534, 2}, {holding, 65533, 1}},
       plain,
       {{holding, 65533, 3}}},
      {"13 input registers", singles(input, 3200, 3212), bm_limits(), {{input, 3200, 13}}},
      {"14 input registers: 13 and 1",
       singles(input, 3200, 3213),
       bm_limits(),
       {{input, 3200, 13}, {input, 3213, 1}}},
      {"14 input registers by a bridge",
       {{input, 3200, 1}, {input, 3213, 1}},
       bm_limits(),
       {{input, 3200, 1}, {input, 3213, 1}}},
      {"14 input registers as one",
       {{input, 3200, 14}},
       bm_limits(),
       {{input, 3200, 13}, {input, 3213, 1}}},
      {"15 input registers", singles(input, 3200, 3214), bm_limits(), {{input, 3200, 15}}},
      {"14 holding registers", singles(holding, 1, 14), bm_limits(), {{holding, 1, 14}}},
      {"14 that end with a pair",
       singles(input, 3200, 3211) + Ranges{{input, 3212, 2}},
       bm_limits(),
       {{input, 3200, 12}, {input, 3212, 2}}},
      {"what is said to be absent, one request a hole",
       singles(holding, 8, 14),
       {.max_read = 10, .absent = {{holding, 10, 2}, {input, 8, 7}}},
       {{holding, 8, 2}, {holding, 10, 2}, {holding, 12, 3}}},
      {"two holes side by side, and a pair at the edge of one",
       singles(holding, 8, 13) + Ranges{{holding, 14, 2}},
       {.max_read = 10, .absent = {{holding, 9, 2}, {holding, 11, 2}, {holding, 15, 2}}},
       {{holding, 8, 1}, {holding, 9, 2}, {holding, 11, 2}, {holding, 13, 1}, {holding, 14, 2}}},
      {"a gap that is short enough",
       {{holding, 1, 1}, {holding, 6, 1}, {holding, 12, 1}},
       {.max_read = 20, .max_gap = 4},
       {{holding, 1, 6}, {holding, 12, 1}}},
      {"a gap that is short enough, with a hole",
       {{holding, 1, 1}, {holding, 6, 1}},
       {.max_read = 20, .max_gap = 4, .absent = {{holding, 3, 1}, {input, 2, 9}}},
       {{holding, 1, 1}, {holding, 6, 1}}},
      {"pieces of the forbidden shape",
       {{input, 0, 28}},
       {.max_read = 14, .forbidden_shapes = {RegisterRange{input, 0, 14}}},
       {{input, 0, 13}, {input, 13, 13}, {input, 26, 2}}},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    CHECK(requests_of(plan_reads(row.wanted, row.limits, row.absent)) == row.expected);
  }
}

TEST_CASE("limits without sense still lead to a plan") {
  CHECK(plan_reads({{holding, 0, 3}}, {.max_read = 0}).size() == 3);
  CHECK(
      plan_reads({{holding, 0, 1}}, {.forbidden_shapes = {RegisterRange{holding, 0, 1}}}).size() ==
      1);
}

TEST_CASE("the parameter space of a BM in as many requests as its registers need") {
  const Ranges presets = singles(holding, 1, 225);
  CHECK(requests_of(plan_reads(presets, bm_limits())) ==
        Ranges{{holding, 1, 100}, {holding, 101, 100}, {holding, 201, 25}});

  const Ranges all =
      singles(holding, 1, 725) + singles(holding, 1001, 1724) + singles(holding, 2001, 2724);
  CHECK(plan_reads(all, bm_limits()).size() == 24);
}

TEST_CASE("a plan covers what is wanted, whatever is wanted") {
  Numbers numbers(20240607);
  for (unsigned round = 0; round < 2000; ++round) {
    CAPTURE(round);
    Ranges wanted;
    for (std::uint16_t n = numbers.below(40); n > 0; --n) {
      const auto table = numbers.below(2) == 0 ? holding : input;
      const std::uint16_t count = numbers.below(8) == 0 ? numbers.below(60) : numbers.below(3);
      wanted.push_back({table, numbers.below(200), static_cast<std::uint16_t>(count + 1U)});
    }
    ReadLimits limits{.max_read = static_cast<std::uint16_t>(2U + numbers.below(40)),
                      .contiguous = {{holding, numbers.below(100), 80}, {input, 20, 100}}};
    const auto table = numbers.below(2) == 0 ? holding : input;
    if (numbers.below(2) == 0) {
      const auto count = static_cast<std::uint16_t>(2U + numbers.below(20));
      limits.forbidden_shapes = {RegisterRange{table, 0, count}};
    }
    std::set<std::uint32_t> absent;
    for (unsigned n = 0; n < 10; ++n) absent.insert(register_key(table, numbers.below(260)));

    const auto plan = plan_reads(wanted, limits, absent);
    std::set<std::uint32_t> wanted_keys;
    for (const RegisterRange& range : wanted) {
      for (std::uint32_t at = 0; at < range.count; ++at) {
        wanted_keys.insert(register_key(range.table, range.first) + at);
      }
    }
    std::set<std::uint32_t> read;
    for (const PlannedRead& planned : plan) {
      const RegisterRange& range = planned.range;
      REQUIRE(range.count >= 1);
      REQUIRE(range.count <= limits.max_read);
      if (!limits.forbidden_shapes.empty() && limits.forbidden_shapes[0].table == range.table) {
        REQUIRE(range.count != limits.forbidden_shapes[0].count);
      }
      // No register is asked for without reason.
      REQUIRE(wanted_keys.count(register_key(range.table, range.first)) == 1);
      for (std::uint32_t at = 0; at < range.count; ++at) {
        const std::uint32_t key = register_key(range.table, range.first) + at;
        read.insert(key);
        if (wanted_keys.count(key) > 0) continue;
        REQUIRE(absent.count(key) == 0);
        REQUIRE(std::any_of(limits.contiguous.begin(), limits.contiguous.end(),
                            [&](const RegisterRange& area) {
                              const std::uint32_t first = register_key(area.table, area.first);
                              return first <= key && key < first + area.count;
                            }));
      }
    }
    REQUIRE(std::includes(read.begin(), read.end(), wanted_keys.begin(), wanted_keys.end()));
    // What fits into one request comes with one request.
    for (const RegisterRange& range : wanted) {
      if (range.count > limits.max_read) continue;
      if (!limits.forbidden_shapes.empty() && limits.forbidden_shapes[0].table == range.table &&
          limits.forbidden_shapes[0].count == range.count) {
        continue;
      }
      REQUIRE(std::any_of(plan.begin(), plan.end(), [&](const PlannedRead& planned) {
        return planned.range.table == range.table && planned.range.first <= range.first &&
               range.first + range.count <= planned.range.first + planned.range.count;
      }));
    }
  }
}

// ---- RegisterImage ----

TEST_CASE("an image gives whole ranges, or the first error in them") {
  RegisterImage image;
  image.store({holding, 10, 3}, Registers{1, 2, 3});
  image.fail({holding, 13, 2}, {.code = Errc::exception_response, .exception = 2});
  image.store({input, 10, 1}, Registers{9});
  CHECK(image.get({holding, 10, 3}) == Registers{1, 2, 3});
  CHECK(image.get({holding, 11, 1}) == Registers{2});
  CHECK(image.get({input, 10, 1}) == Registers{9});
  CHECK(image.get({holding, 12, 2}).error().exception == 2);
  CHECK(image.get({holding, 99, 1}).error().code == Errc::internal);
  CHECK(image.get({input, 11, 1}).error().code == Errc::internal);
}

// ---- Client ----

TEST_CASE("read_each() brings every register at its place") {
  Bench bench(bm_limits());
  const Ranges wanted = singles(holding, 1, 225) + singles(input, 3200, 3213) +
                        Ranges{{holding, 1002, 2}, {holding, 2002, 250}};
  std::vector<std::pair<std::size_t, std::size_t>> progress;
  const auto image = bench.client.read_each(
      wanted, [&](std::size_t done, std::size_t total) { progress.emplace_back(done, total); });
  REQUIRE(image);
  for (const RegisterRange& range : wanted) check_values(*image, range);
  REQUIRE(progress.size() == bench.server.reads.size());
  std::size_t before = 0;
  for (const auto& [done, total] : progress) {
    CHECK(before < done);
    CHECK(total == bench.client.count_wanted(wanted));
    before = done;
  }
  CHECK(before == bench.client.count_wanted(wanted));
}

TEST_CASE("bisecting finds exactly the holes, and they are not asked for again") {
  Numbers numbers(566);
  for (unsigned round = 0; round < 60; ++round) {
    CAPTURE(round);
    Bench bench(bm_limits());
    const auto table = round % 2 == 0 ? holding : input;
    for (std::uint16_t n = numbers.below(25); n > 0; --n) {
      const std::uint16_t first = numbers.below(300);
      const std::uint16_t size = numbers.below(6);
      for (std::uint32_t at = first; at <= first + std::uint32_t{size}; ++at) {
        bench.server.holes.insert(register_key(table, static_cast<std::uint16_t>(at)));
      }
    }
    const Ranges wanted = singles(table, 0, 300);
    for (unsigned pass = 0; pass < 2; ++pass) {
      bench.server.reads.clear();
      const auto image = bench.client.read_each(wanted);
      REQUIRE(image);
      for (const RegisterRange& range : wanted) {
        if (bench.server.holes.count(register_key(table, range.first)) == 0) {
          check_values(*image, range);
          continue;
        }
        const auto missing = image->get(range);
        REQUIRE_FALSE(missing);
        CHECK(missing.error().exception == 2);
        CHECK(missing.error().register_address == range.first);
      }
      for (const RegisterRange& read : bench.server.reads) {
        CHECK_FALSE((read.table == input && read.count == 14));
        if (pass == 0) continue;
        for (std::uint32_t at = 0; at < read.count; ++at) {  // no hole is touched any more
          REQUIRE(bench.server.holes.count(register_key(table, read.first) + at) == 0);
        }
      }
    }
  }
}

TEST_CASE("a half that would look like an event is asked for in two parts") {
  Bench bench(bm_limits());
  bench.server.holes = {register_key(input, 3227)};
  const auto image = bench.client.read_each(singles(input, 3200, 3227));  // halves of 14
  REQUIRE(image);
  for (const RegisterRange& range : singles(input, 3200, 3226)) check_values(*image, range);
  CHECK(bench.server.reads[0] == RegisterRange{input, 3200, 28});
  CHECK(bench.server.reads[1] == RegisterRange{input, 3200, 13});
  for (const RegisterRange& read : bench.server.reads) CHECK(read.count != 14);
}

TEST_CASE("the holes of a BM cost few requests, and none the second time") {
  Bench bench(bm_limits());
  for (std::uint16_t at = 564; at <= 568; ++at) bench.server.holes.insert(at);
  REQUIRE(bench.client.read_each(singles(holding, 1, 725)));
  CHECK(bench.server.reads.size() <= 8 + 2 * 7 + 10);
  bench.server.reads.clear();
  REQUIRE(bench.client.read_each(singles(holding, 1, 725)));
  CHECK(bench.server.reads == Ranges{{holding, 1, 100},
                                     {holding, 101, 100},
                                     {holding, 201, 100},
                                     {holding, 301, 100},
                                     {holding, 401, 100},
                                     {holding, 501, 63},
                                     {holding, 569, 100},
                                     {holding, 669, 57}});
  bench.server.reads.clear();
  const auto holes_only = bench.client.read_each(singles(holding, 564, 568));
  CHECK(bench.server.reads.empty());
  CHECK(holes_only.value().get({holding, 566, 1}).error().exception == 2);
}

TEST_CASE("a refused pair does not condemn its halves") {
  Bench bench;
  bench.server.holes = {11};
  const auto pairs = bench.client.read_each({{holding, 8, 2}, {holding, 10, 2}, {holding, 12, 2}});
  REQUIRE(pairs);
  check_values(*pairs, {holding, 8, 2});
  check_values(*pairs, {holding, 12, 2});
  CHECK(pairs->get({holding, 10, 2}).error().register_address == 10);
  for (const RegisterRange& read : bench.server.reads) {  // no pair was split
    CHECK(read.first % 2 == 0);
    CHECK(read.count % 2 == 0);
  }
  const auto halves = bench.client.read_each(singles(holding, 10, 11));
  REQUIRE(halves);
  check_values(*halves, {holding, 10, 1});
  CHECK(halves->get({holding, 11, 1}).error().exception == 2);

  // What contains a refused range is refused without asking.
  bench.server.reads.clear();
  CHECK_FALSE(bench.client.read_each({{holding, 9, 4}}).value().get({holding, 9, 4}));
  CHECK(bench.server.reads.empty());
  // A hole is not bridged either.
  Bench bridging({.max_read = 100, .contiguous = {{holding, 0, 100}}});
  bridging.server.holes = {11};
  REQUIRE(bridging.client.read_each({{holding, 11, 1}}));
  REQUIRE(bridging.client.read_each({{holding, 9, 1}, {holding, 13, 1}}));
  CHECK(bridging.server.reads == Ranges{{holding, 11, 1}, {holding, 9, 1}, {holding, 13, 1}});
}

TEST_CASE("what is said to be absent is asked for all the same, and costs no other answer") {
  Bench bench({.max_read = 10, .absent = {{holding, 10, 3}}});
  bench.server.holes = {10, 12};
  const Ranges wanted = singles(holding, 8, 14);
  CHECK(bench.client.count_wanted(wanted) == 7);
  std::pair<std::size_t, std::size_t> last;
  const auto image = bench.client.read_each(wanted, [&](std::size_t done, std::size_t total) {
    last = {done, total};
  });
  CHECK(last == std::pair<std::size_t, std::size_t>{7, 7});
  REQUIRE(image);
  CHECK(bench.server.reads == Ranges{{holding, 8, 2}, {holding, 10, 3}, {holding, 13, 2}});
  for (const std::uint16_t there : Registers{8, 9, 13, 14})
    check_values(*image, {holding, there, 1});
  for (const std::uint16_t hole : Registers{10, 11, 12})
    CHECK_FALSE(image->get({holding, hole, 1}));
  CHECK(bench.client.count_wanted(wanted) == 4);
}

TEST_CASE("a register that is said to be absent is there when it answers, also alone") {
  Bench bench({.max_read = 10, .absent = {{holding, 10, 3}}});
  const auto all = bench.client.read_each(singles(holding, 10, 12));
  REQUIRE(all);
  check_values(*all, {holding, 10, 3});
  bench.server.holes = {10, 12};
  const auto one = bench.client.read_each({{holding, 11, 1}});
  REQUIRE(one);
  check_values(*one, {holding, 11, 1});
  CHECK(bench.server.reads == Ranges{{holding, 10, 3}, {holding, 11, 1}});
}

TEST_CASE("registers that are to be avoided are not read along") {
  Bench bench({.max_read = 100, .contiguous = {{holding, 0, 100}}});
  bench.client.avoid({holding, 4, 2});
  REQUIRE(bench.client.read_each({{holding, 3, 1}, {holding, 6, 1}}));
  CHECK(bench.server.reads == Ranges{{holding, 3, 1}, {holding, 6, 1}});
  REQUIRE(bench.client.read_each({{holding, 4, 1}}));  // asked for, it is read
}

TEST_CASE("a block that is refused because of what it reads along is read without it") {
  Bench bench({.max_read = 100, .contiguous = {{holding, 0, 100}}});
  bench.server.holes = {5};
  const auto image = bench.client.read_each({{holding, 0, 1}, {holding, 9, 1}});
  REQUIRE(image);
  check_values(*image, {holding, 0, 1});
  check_values(*image, {holding, 9, 1});
}

TEST_CASE("a block that is refused with 03 or 04 is asked for in parts") {
  for (const std::uint8_t code : hex("03 04")) {
    CAPTURE(code);
    Bench bench({.max_read = 10});
    bench.server.trouble = {{15, code}};
    const auto image = bench.client.read_each(singles(holding, 0, 29));
    REQUIRE(image);
    CHECK(bench.server.reads.size() == 9);
    for (std::uint16_t at = 0; at < 30; ++at) {
      CAPTURE(at);
      const auto value = image->get({holding, at, 1});
      CHECK(value.has_value() == (at != 15));
      if (!value) CHECK(value.error().exception == code);
    }
    // Only what does not exist (02) is remembered.
    bench.server.trouble.clear();
    CHECK(bench.client.read_each({{holding, 15, 1}})->get({holding, 15, 1}).has_value());
  }
}

TEST_CASE("other exceptions stand at the registers of their request, with the code as received") {
  for (const std::uint8_t code : hex("01 06 07 0C 0E FF")) {
    CAPTURE(code);
    Bench bench({.max_read = 10});
    bench.server.trouble = {{15, code}};
    const auto image = bench.client.read_each(singles(holding, 0, 29));
    REQUIRE(image);
    CHECK(bench.server.reads.size() == 3);
    for (std::uint16_t at = 0; at < 30; ++at) {
      const auto value = image->get({holding, at, 1});
      CHECK(value.has_value() == (at < 10 || at >= 20));
      if (value) continue;
      CHECK(value.error().code == Errc::exception_response);
      CHECK(value.error().exception == code);
      CHECK(value.error().register_address == at);
    }
    bench.server.trouble.clear();  // it was no hole: it is asked for again
    CHECK(bench.client.read_each(singles(holding, 15, 15)).value().get({holding, 15, 1}));
  }
}

TEST_CASE("an exception response of a single read is an error with its code") {
  Bench bench;
  bench.server.trouble = {{5, 0x0E}, {6, 0x02}};
  const auto vendor = bench.client.read({holding, 5, 1});
  REQUIRE_FALSE(vendor);
  CHECK(vendor.error().exception == 0x0E);
  CHECK(vendor.error().status() == ExitStatus::refused);
  CHECK(vendor.error().message ==
        "the tool refused 'read 1 holding register from 5' with exception 0E");
  CHECK(bench.client.read({holding, 6, 1}).error().message ==
        "the tool refused 'read 1 holding register from 6' with exception 02 (illegal data "
        "address)");
}

TEST_CASE("a read without answer is repeated as often as was said, then it ends everything") {
  for (const unsigned retries : {0U, 1U, 3U}) {
    for (const unsigned lost : {0U, 1U, 2U, 5U}) {
      CAPTURE(retries);
      CAPTURE(lost);
      Bench bench({.max_read = 10}, retries);
      for (unsigned n = 0; n < lost; ++n) bench.script.on_request(test::silence());
      const auto image = bench.client.read_each(singles(holding, 0, 29));
      CHECK(image.has_value() == (lost <= retries));
      if (image) {
        CHECK(bench.script.sent.size() == lost + 3);
      } else {
        CHECK(image.error().code == Errc::no_answer);
        CHECK(bench.script.sent.size() == retries + 1);
      }
    }
  }
}

TEST_CASE("a line that broke makes no read be repeated") {
  struct Row {
    std::string_view what;
    test::Reaction reaction;
    Errc code;
  };
  const std::vector<Row> rows = {
      {"closed",
       [](ByteView) {
         return std::vector<Arrival>{{1ms, Errc::closed}};
       },
       Errc::closed},
      {"reset",
       [](ByteView) {
         return std::vector<Arrival>{{1ms, Errc::reset}};
       },
       Errc::reset},
      {"no Modbus TCP", test::say(1ms, hex("FFFF FFFF FFFF FFFF")), Errc::malformed_answer},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    Bench bench({}, 3);
    bench.script.on_request(row.reaction);
    CHECK(bench.client.read_each({{holding, 0, 2}}).error().code == row.code);
    CHECK(bench.script.sent.size() == 1);
  }
}

TEST_CASE("a damaged answer makes a read be repeated like a lost one, on either framing") {
  struct Row {
    std::string_view what;
    Bytes bytes;
  };
  for (const Row& row :
       {Row{"nothing", {}}, Row{"another count", hex("8000 0000 0005 00 03 02 0000")},
        Row{"half a header", hex("8000 0000 00")},
        Row{"all but a byte", hex("8000 0000 0007 00 03 04 0000 00")},
        Row{"half a pushed frame", hex("0001 0000 001F 00 04 1C 07AA")}}) {
    for (const std::size_t chunk : {std::size_t{4096}, std::size_t{1}}) {
      CAPTURE(row.what);
      CAPTURE(chunk);
      Bench bench({}, 1);
      bench.script.chunk = chunk;
      bench.script.on_request(test::say(1ms, row.bytes));
      CHECK(bench.client.read({holding, 2, 2}).value() ==
            Registers{value_at(holding, 2), value_at(holding, 3)});
      CHECK(bench.script.sent.size() == 2);
    }
  }
  Bytes flipped =
      modbus::frame(Framing::rtu, {{}, {1}, modbus::read_response(holding, Registers{7})});
  const Bytes whole = flipped;
  flipped.back() ^= 1U;
  for (const Bytes& bytes : {Bytes(), flipped, Bytes(whole.begin(), whole.begin() + 4)}) {
    FakeClock clock;
    test::Script script(clock);
    Session session(transport_to(script), clock,
                    {.rules = {.framing = Framing::rtu}, .unit = {1}, .answer_timeout = 100ms});
    Client client(session, {}, 1);
    script.on_request(test::say(1ms, bytes));
    script.on_request(test::say(1ms, whole));
    CHECK(client.read({holding, 0, 1}).value() == Registers{7});
  }
}

TEST_CASE("a read can be asked for in other shapes where neighbours may be read") {
  struct Row {
    RegisterRange wanted;
    ReadLimits limits;
    std::vector<std::pair<Pdu, std::size_t>> others;
  };
  const auto read = [](std::uint16_t first, std::uint16_t count) {
    return modbus::read_request(holding, {first}, count);
  };
  const std::vector<Row> rows = {
      {{holding, 10, 2}, {}, {}},
      {{holding, 10, 2}, {.contiguous = {{holding, 8, 6}}}, {{read(10, 3), 0}, {read(10, 4), 0}}},
      {{holding, 10, 2}, {.max_read = 3, .contiguous = {{holding, 9, 3}}}, {{read(9, 3), 1}}},
      {{holding, 10, 2},
       {.contiguous = {{holding, 8, 6}}, .forbidden_shapes = {{holding, 0, 3}, {holding, 0, 4}}},
       {}},
      {{holding, 0, 1},
       {.neighbours = Neighbours::anywhere},
       {{read(0, 2), 0}, {read(0, 3), 0}, {read(0, 4), 0}}},
      {{holding, 65535, 1},
       {.max_read = 2, .neighbours = Neighbours::anywhere},
       {{read(65534, 2), 1}}},
  };
  for (const Row& row : rows) {
    std::vector<std::pair<Pdu, std::size_t>> others;
    for (const OtherRead& other : other_reads(row.wanted, row.limits)) {
      others.emplace_back(other.request, other.skip);
    }
    CHECK(others == row.others);
  }
}

TEST_CASE("questions that change nothing are repeated like reads") {
  Bench bench({}, 1);
  bench.script.on_request(test::silence());
  bench.script.on_request(
      test::answer(Framing::tcp, 1ms, modbus::report_server_id_response(hex("0001 0203"))));
  CHECK(bench.client.report_server_id() == hex("0001 0203"));
  bench.script.on_request(test::silence());
  CHECK(bench.client.loopback(0x1234));
  CHECK(bench.script.sent.size() == 4);
  CHECK(Bytes(bench.script.sent[3].bytes.begin() + 7, bench.script.sent[3].bytes.end()) ==
        hex("08 0000 1234"));
}

TEST_CASE("a write is sent once, whatever comes of it") {
  struct Row {
    std::string_view what;
    test::Reaction reaction;
    Errc code;
  };
  const std::vector<Row> rows = {
      {"no answer", test::silence(), Errc::no_answer},
      {"refused", test::answer(Framing::tcp, 1ms, modbus::exception_response(0x06, 0x0E)),
       Errc::exception_response},
      {"refused, ten registers",
       test::answer(Framing::tcp, 1ms, modbus::exception_response(0x10, 0x0E)),
       Errc::exception_response},
      {"closed",
       [](ByteView) {
         return std::vector<Arrival>{{1ms, Errc::closed}};
       },
       Errc::closed},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    Bench bench({}, 5);
    bench.script.on_request(row.reaction);
    const auto written =
        row.what == "refused, ten registers"
            ? bench.client.write(modbus::write_request({0x0480}, RegisterView(Registers(10))))
            : bench.client.write(modbus::write_request({2}, std::uint16_t{271}));
    REQUIRE_FALSE(written);
    CHECK(written.error().code == row.code);
    CHECK(bench.script.sent.size() == 1);
  }
}

TEST_CASE("writes go out as FC 06 and FC 10h") {
  Bench bench;
  CHECK(bench.client.write(modbus::write_request({4002}, std::uint16_t{1})));
  bench.script.on_request(
      test::answer(Framing::tcp, 1ms, modbus::write_multiple_response({0x0480}, 2)));
  const Registers two{0, 100};
  CHECK(bench.client.write(modbus::write_request({0x0480}, RegisterView(two))));
  CHECK(bench.script.sent[0].bytes == hex("8000 0000 0006 00 06 0FA2 0001"));
  CHECK(bench.script.sent[1].bytes == hex("8001 0000 000B 00 10 0480 0002 04 0000 0064"));
}
