#include "spindle/link/register_scan.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <random>

using namespace spindle;
using namespace spindle::link;
using modbus::RegisterTable;

namespace {

struct Found {
  std::set<std::uint32_t> there = {};
  std::size_t requests = 0;
  std::vector<RegisterRun> runs = {};
};

using Answers = std::function<bool(const RegisterRange&)>;

/// Asks a device that answers the blocks for which `answers` says so; each register is its address.
Found explore(const std::vector<RegisterRange>& wanted, const BlockRules& rules,
              const Answers& answers) {
  RegisterScan scan(wanted, rules);
  Found found;
  while (const auto block = scan.next()) {
    const bool fits = block->count >= 1 && block->count <= rules.longest;
    if (!fits || ++found.requests > 2 * scan.wanted()) FAIL("too long, or too often");
    if (!answers(*block)) {
      scan.refuse();
      continue;
    }
    Registers values;
    for (std::uint32_t at = 0; at < block->count; ++at) {
      values.push_back(static_cast<std::uint16_t>(block->first + at));
    }
    scan.answer(values);
  }
  CHECK(scan.known() == scan.wanted());
  found.runs = scan.runs();
  bool right = true;
  for (const RegisterRun& run : found.runs) {
    for (std::size_t at = 0; at < run.values.size(); ++at) {
      right =
          right && run.values[at] == run.first + at && found.there.insert(run.values[at]).second;
    }
  }
  CHECK(right);
  CHECK(scan.answered() == found.there.size());
  return found;
}

Answers having(const std::set<std::uint32_t>& there) {
  return [&there](const RegisterRange& block) {
    for (std::uint32_t at = 0; at < block.count; ++at) {
      if (!there.contains(block.first + at)) return false;
    }
    return true;
  };
}

}  // namespace

TEST_CASE("every pattern of holes in twelve registers is found") {
  for (std::uint32_t pattern = 0; pattern < 0x1000; ++pattern) {
    std::set<std::uint32_t> there;
    for (std::uint32_t bit = 0; bit < 12; ++bit) {
      if ((pattern >> bit & 1U) != 0) there.insert(100 + bit);
    }
    for (const std::uint16_t longest : std::initializer_list<std::uint16_t>{5, 8, 16}) {
      const Found found =
          explore({{RegisterTable::holding, 100, 12}}, {.longest = longest}, having(there));
      CHECK(found.there == there);
    }
  }
}

TEST_CASE("random maps of a thousand registers are found with few requests") {
  std::mt19937 engine(4711);
  const auto below = [&](std::uint32_t end) { return static_cast<std::uint32_t>(engine() % end); };
  for (int round = 0; round < 200; ++round) {
    std::set<std::uint32_t> there;
    std::uint32_t edges = 0;
    for (std::uint32_t at = below(50); at < 1000;) {
      const std::uint32_t end = std::min<std::uint32_t>(at + 1 + below(200), 1000);
      for (; at < end; ++at) there.insert(at);
      edges += 2;
      at += 1 + below(200);
    }
    const Found found =
        explore(ranges_between(RegisterTable::input, 0, 999, {}), {.longest = 16}, having(there));
    CHECK(found.there == there);
    // What answers costs a request a block, and what does not is halved down to the last register.
    const std::size_t holes = 1000 - there.size();
    CHECK(found.requests <= 1000 / 16 + 1 + 2 * holes + 8 * edges);
    for (std::size_t at = 1; at < found.runs.size(); ++at) {
      CHECK(found.runs[at - 1].last() + 1 < found.runs[at].first);
    }
  }
}

TEST_CASE("where all answers, a block is one request") {
  const Found found = explore(ranges_between(RegisterTable::holding, 0, 999, {}), {.longest = 125},
                              [](const RegisterRange&) { return true; });
  CHECK(found.requests == 8);
  CHECK(found.runs.size() == 1);
}

TEST_CASE("a device that refuses long reads is read in short ones") {
  const Found found = explore({{RegisterTable::holding, 7, 100}}, {.longest = 16},
                              [](const RegisterRange& block) { return block.count <= 3; });
  CHECK(found.there.size() == 100);
  CHECK(found.runs.size() == 1);
}

TEST_CASE("pairs are asked for whole, at even addresses") {
  const BlockRules rules{.longest = 16, .even_pairs = true};
  const Found found =
      explore({{RegisterTable::holding, 5, 40}}, rules, [](const RegisterRange& block) {
        const bool is_edge = block.count == 1;
        CHECK((is_edge || (block.first % 2 == 0 && block.count % 2 == 0)));
        return is_edge || block.first / 2 % 3 != 0;
      });
  CHECK(found.there.contains(5));
  CHECK(found.there.contains(44));
}

TEST_CASE("no block has the shape of what a tool sends unasked") {
  const BlockRules rules{.longest = 16,
                         .forbidden_shapes = {{RegisterTable::input, 0, 14},
                                              {RegisterTable::input, 0, 13},
                                              {RegisterTable::holding, 0, 16}}};
  const auto check = [](const RegisterRange& block) {
    CHECK(block.count != 14);
    CHECK(block.count != 13);
    return block.count < 8;
  };
  CHECK(explore({{RegisterTable::input, 0, 14}}, rules, check).there.size() == 14);
  CHECK(explore({{RegisterTable::input, 3, 300}}, rules, check).there.size() == 300);
}

TEST_CASE("the whole table without what is left out") {
  const auto all = ranges_between(RegisterTable::holding, 0, 0xFFFF, {});
  CHECK(all == std::vector<RegisterRange>{{RegisterTable::holding, 0, 0x8000},
                                          {RegisterTable::holding, 0x8000, 0x8000}});
  const auto parts = ranges_between(RegisterTable::holding, 0, 0xFFFF, {0, 7, 8, 0xFFFF});
  CHECK(parts.front() == RegisterRange{RegisterTable::holding, 1, 6});
  CHECK(parts.back().first + parts.back().count == 0xFFFF);
  CHECK(ranges_between(RegisterTable::holding, 5, 5, {5}).empty());
  CHECK(ranges_between(RegisterTable::holding, 5, 6, {4, 7}).size() == 1);
  const Found found = explore(all, {.longest = 125}, [](const RegisterRange&) { return true; });
  CHECK(found.there.size() == 0x10000);
  CHECK(found.runs.size() == 1);
}
