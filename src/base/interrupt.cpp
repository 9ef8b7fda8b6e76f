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
  const int signal = signal_.load();
  const bool by_hand = signal == interrupt_signal || signal == 0;
  return Error{.code = by_hand ? Errc::interrupted : Errc::terminated};
}

}  // namespace spindle
