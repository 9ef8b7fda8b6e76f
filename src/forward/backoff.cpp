#include "backoff.hpp"

#include <algorithm>

namespace spindle::forward {

Duration Backoff::next() {
  constexpr Duration first = std::chrono::milliseconds(500);
  constexpr Duration longest = std::chrono::seconds(30);
  constexpr unsigned most_doublings = 6;
  const Duration whole = std::min(first * (1U << std::min(failures_, most_doublings)), longest);
  ++failures_;
  const std::int64_t half = whole.count() / 2;
  return Duration(std::uniform_int_distribution<std::int64_t>(half, whole.count())(random_));
}

}  // namespace spindle::forward
