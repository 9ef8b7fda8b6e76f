#include "spindle/base/interrupt.hpp"

namespace spindle {
namespace {

constexpr int interrupt_signal = 2;  // SIGINT

static_assert(std::atomic<int>::is_always_lock_free, "raise() must be async-signal-safe");

}  // namespace

void Interrupt::raise(int signal_number) noexcept {
  int none = 0;
  signal_.compare_exchange_strong(none, signal_number);
}

Error Interrupt::error() const {
  const bool by_hand = signal_.load() == interrupt_signal;
  return Error{.code = by_hand ? Errc::interrupted : Errc::terminated};
}

}  // namespace spindle
