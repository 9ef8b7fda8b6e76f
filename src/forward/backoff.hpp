#pragma once

#include <cstdint>
#include <random>

#include "spindle/base/clock.hpp"

namespace spindle::forward {

/// How long to wait after a failure: half a second at first, twice as long after each further one,
/// 30 s at most; between half of that and all of it, so that many do not come back at once.
class Backoff {
 public:
  explicit Backoff(std::uint32_t seed) : random_(seed) {}

  /// For one more failure.
  Duration next();
  /// It went well.
  void reset() { failures_ = 0; }

 private:
  std::minstd_rand random_;
  unsigned failures_ = 0;
};

}  // namespace spindle::forward
