#include "spindle/work/followers.hpp"

#include <algorithm>
#include <utility>

namespace spindle::work {
namespace {

template <typename Map, typename Drops>
void drop_if(Map& map, Drops drops) {
  for (auto at = map.begin(); at != map.end();) at = drops(*at) ? map.erase(at) : std::next(at);
}

}  // namespace

FollowerSearch::FollowerSearch(catalogue::LearnedBy by, const Moment& first, std::size_t settling)
    : by_(by), settling_(settling), numbers_({first.watched}), last_(first.watched) {
  for (const auto& [address, value] : first.registers) {
    candidates_[address] = {.held = {{first.watched, value}}, .rest = value, .now = value};
  }
}

bool FollowerSearch::take(const Moment& moment) {
  const bool ended =
      by_ == catalogue::LearnedBy::value ? take_value(moment) : take_clearing(moment);
  last_ = moment.watched;
  return ended;
}

/// Each number of the tool has one of the register, and no other number has it.
bool FollowerSearch::keeps(Candidate& candidate, std::uint16_t watched, std::uint16_t now) {
  const auto [known, is_new] = candidate.held.try_emplace(watched, now);
  if (!is_new) return known->second == now;
  return std::count_if(candidate.held.begin(), candidate.held.end(),
                       [now](const auto& held) { return held.second == now; }) == 1;
}

bool FollowerSearch::take_value(const Moment& moment) {
  settled_ = moment.watched == last_ ? settled_ + 1 : 0;
  if (settled_ < settling_) return false;
  drop_if(candidates_, [&](auto& each) {
    const auto now = moment.registers.find(each.first);
    return now == moment.registers.end() || !keeps(each.second, moment.watched, now->second);
  });
  if (moment.watched == numbers_.back()) return false;
  numbers_.push_back(moment.watched);
  return true;
}

/// It holds one number while what is watched is not 0, and shows another one when that becomes 0,
/// or a moment before. When it goes back is its own affair; but what changes along when what is
/// watched comes only mirrors it.
bool FollowerSearch::clears(Candidate& candidate, std::uint16_t watched, std::uint16_t now) const {
  const std::uint16_t before = std::exchange(candidate.now, now);
  const bool stands = watched != 0;
  if (stands && last_ == 0) {
    candidate.rest = now;
    candidate.moments = 0;
    return now == before;
  }
  const bool is_off = now != candidate.rest;
  if (is_off && (stands || is_clearing_)) candidate.shown.insert(now);
  if (!stands) return true;
  if (!is_off) return candidate.moments == 0;
  return ++candidate.moments <= settling_;
}

bool FollowerSearch::take_clearing(const Moment& moment) {
  if (last_ != 0 && moment.watched == 0) {
    is_clearing_ = true;
    cleared_ = last_;
    settled_ = 0;
  }
  drop_if(candidates_, [&](auto& each) {
    const auto now = moment.registers.find(each.first);
    return now == moment.registers.end() || !clears(each.second, moment.watched, now->second);
  });
  const bool ends = is_clearing_ && (settled_++ >= settling_ || moment.watched != 0);
  if (!ends) return false;
  close_clearing();
  numbers_.push_back(cleared_);
  return true;
}

void FollowerSearch::close_clearing() {
  is_clearing_ = false;
  drop_if(candidates_, [](const auto& each) { return each.second.shown.empty(); });
  for (auto& [address, candidate] : candidates_) {
    const std::uint16_t shown = *candidate.shown.begin();
    const bool is_same = candidate.shown.size() == 1 && candidate.value.value_or(shown) == shown;
    candidate.is_steady = candidate.is_steady && is_same;
    candidate.value = shown;
    candidate.shown.clear();
    candidate.moments = 0;
  }
}

std::set<std::uint16_t> FollowerSearch::candidates() const {
  std::set<std::uint16_t> addresses;
  for (const auto& [address, candidate] : candidates_) addresses.insert(address);
  return addresses;
}

std::vector<Follower> FollowerSearch::followers() const {
  std::vector<Follower> followers;
  if (changes() == 0) return followers;
  for (const auto& [address, candidate] : candidates_) {
    Follower follower{.address = address};
    if (by_ == catalogue::LearnedBy::value) {
      follower.is_equal = std::all_of(candidate.held.begin(), candidate.held.end(),
                                      [](const auto& held) { return held.first == held.second; });
    } else if (candidate.is_steady) {
      follower.value = candidate.value;
    }
    followers.push_back(follower);
  }
  return followers;
}

}  // namespace spindle::work
