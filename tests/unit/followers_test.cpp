#include "spindle/work/followers.hpp"

#include <doctest/doctest.h>

using namespace spindle;
using namespace spindle::work;
using catalogue::LearnedBy;

namespace {

using Values = std::map<std::uint16_t, std::uint16_t>;

/// The same moment so often that a change comes to its end; how many ended.
int hold(FollowerSearch& search, const Moment& moment, int times = 4) {
  int ended = 0;
  for (int time = 0; time < times; ++time) ended += search.take(moment) ? 1 : 0;
  return ended;
}

std::vector<std::uint16_t> addresses(const FollowerSearch& search) {
  std::vector<std::uint16_t> all;
  for (const Follower& follower : search.followers()) all.push_back(follower.address);
  return all;
}

}  // namespace

TEST_CASE("followers: the register that holds the same number is left") {
  FollowerSearch search(LearnedBy::value, {5, {{10, 5}, {11, 5}, {12, 0}, {13, 9}}});
  CHECK(search.followers().empty());  // nothing changed yet
  CHECK(hold(search, {3, {{10, 3}, {11, 5}, {12, 0}, {13, 8}}}) == 1);
  CHECK(addresses(search) == std::vector<std::uint16_t>{10, 13});
  CHECK(hold(search, {5, {{10, 5}, {11, 5}, {12, 0}, {13, 7}}}) == 1);  // 13 had 9 at 5
  const auto left = search.followers();
  REQUIRE(left.size() == 1);
  CHECK(left.front().address == 10);
  CHECK(left.front().is_equal);
  CHECK(search.numbers() == std::vector<std::uint16_t>{5, 3, 5});
}

TEST_CASE("followers: other numbers are told from the same") {
  FollowerSearch search(LearnedBy::value, {1, {{10, 0}, {11, 7}}});
  hold(search, {2, {{10, 1}, {11, 7}}});
  hold(search, {1, {{10, 0}, {11, 7}}});
  const auto left = search.followers();
  REQUIRE(left.size() == 1);
  CHECK(left.front().address == 10);
  CHECK_FALSE(left.front().is_equal);
}

TEST_CASE("followers: a register may come a moment later, and no more than that") {
  FollowerSearch search(LearnedBy::value, {1, {{10, 1}, {11, 1}}});
  CHECK_FALSE(search.take({2, {{10, 1}, {11, 1}}}));
  CHECK_FALSE(search.take({2, {{10, 2}, {11, 1}}}));
  CHECK(search.take({2, {{10, 2}, {11, 1}}}));
  CHECK(search.candidates() == std::set<std::uint16_t>{10});  // 11 held 1 for both
  CHECK_FALSE(search.take({2, {{10, 1}}}));
  CHECK(search.candidates().empty());
}

TEST_CASE("followers: what changes while nothing happens follows nothing") {
  FollowerSearch search(LearnedBy::value, {1, {{10, 1}, {11, 100}}});
  hold(search, {1, {{10, 1}, {11, 101}}});
  CHECK(search.candidates() == std::set<std::uint16_t>{10});
}

TEST_CASE("followers: a glance at another number is no change") {
  FollowerSearch search(LearnedBy::value, {1, {{10, 1}}});
  CHECK(hold(search, {2, {{10, 2}}}, 2) == 0);
  CHECK(hold(search, {1, {{10, 1}}}) == 0);
  CHECK(search.changes() == 0);
  CHECK(search.candidates().size() == 1);
}

TEST_CASE("followers: a reset shows itself for a moment, each time the same") {
  FollowerSearch search(LearnedBy::clearing, {0, {{10, 0}, {11, 0}, {12, 4}}});
  for (int time = 1; time <= 2; ++time) {
    hold(search, {336, {{10, 0}, {11, static_cast<std::uint16_t>(time == 1 ? 0 : 1)}, {12, 4}}});
    CHECK_FALSE(search.take({336, {{10, 1}, {11, 0}, {12, 4}}}));  // before the tool says it
    CHECK(hold(search, {0, {{10, 0}, {11, 0}, {12, 4}}}) == 1);
  }
  const auto left = search.followers();
  REQUIRE(left.size() == 1);
  CHECK(left.front().address == 10);
  CHECK(left.front().value == 1);
  CHECK(search.numbers() == std::vector<std::uint16_t>{0, 336, 336});
}

TEST_CASE("followers: a counter of resets has no value that resets") {
  FollowerSearch search(LearnedBy::clearing, {7, {{10, 3}}});
  hold(search, {0, {{10, 4}}});
  hold(search, {7, {{10, 4}}});
  hold(search, {0, {{10, 5}}});
  const auto left = search.followers();
  REQUIRE(left.size() == 1);
  CHECK_FALSE(left.front().value);
}

TEST_CASE("followers: a reset may go back whenever it likes") {
  FollowerSearch search(LearnedBy::clearing, {336, {{10, 0}}});
  hold(search, {0, {{10, 1}}}, 8);
  hold(search, {0, {{10, 0}}}, 8);
  hold(search, {336, {{10, 0}}}, 8);
  hold(search, {0, {{10, 1}}});
  REQUIRE(search.followers().size() == 1);
  CHECK(search.followers().front().value == 1);
}

TEST_CASE("followers: what shows itself while the alarm stands is not its reset") {
  FollowerSearch search(LearnedBy::clearing, {336, {{10, 0}, {11, 0}}});
  hold(search, {336, {{10, 1}, {11, 1}}}, 1);
  hold(search, {336, {{10, 0}, {11, 1}}}, 1);
  CHECK(search.candidates() == std::set<std::uint16_t>{11});
  hold(search, {336, {{11, 1}}}, 1);
  CHECK(search.candidates().empty());
}

TEST_CASE("followers: what shows itself when the alarm comes is not its reset") {
  FollowerSearch search(LearnedBy::clearing, {0, {{10, 0}}});
  hold(search, {336, {{10, 1}}});
  hold(search, {0, {{10, 0}}});
  CHECK(search.candidates().empty());
}
