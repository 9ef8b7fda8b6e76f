#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "spindle/link/transport.hpp"

namespace spindle::link {

/// A lock that is had in the order in which it was asked for, so that a session that is always busy
/// keeps no other one waiting for ever.
class FairLock {
 public:
  void lock() {
    std::unique_lock guard(mutex_);
    const std::uint64_t ticket = issued_++;
    served_.wait(guard, [&] { return ticket == serving_; });
  }
  void unlock() {
    const std::lock_guard guard(mutex_);
    ++serving_;
    served_.notify_all();
  }

 private:
  std::mutex mutex_ = {};
  std::condition_variable served_ = {};
  std::uint64_t issued_ = 0;
  std::uint64_t serving_ = 0;
};

/// A serial line that several sessions of one program have, each for a unit of its own and each in
/// a thread of its own, as the port can only be opened once. They take turns: from a request to the
/// end of its answer the line belongs to one of them, and the next one keeps its silence behind
/// that.
class SharedLine {
 public:
  using Open = std::function<Result<std::unique_ptr<Transport>>()>;

  /// `clock` must outlive the line, and the line all shares.
  explicit SharedLine(Clock& clock) : clock_(&clock) {}
  SharedLine(const SharedLine&) = delete;
  SharedLine& operator=(const SharedLine&) = delete;
  ~SharedLine() = default;

  /// A share of the line, which the first one opens and the last one closes. Outside of its turns
  /// it receives nothing. It has no shield, as an interrupt has to end the waits of all: what
  /// leaves a tool safe needs a line of its own. When the line breaks, it does so for all, and the
  /// next who joins opens it anew. Errors: those of `open`.
  Result<std::unique_ptr<Transport>> join(const Open& open);

 private:
  class Share;

  Clock* clock_;
  FairLock turn_ = {};
  Transport::BusLease left_ = {};  ///< belongs to the share that has the turn

  std::mutex mutex_ = {};                           ///< guards everything below
  std::unique_ptr<Transport> transport_ = nullptr;  ///< empty: not open
  std::size_t opened_ = 0;                          ///< how often, so that old shares know
  std::size_t shares_ = 0;                          ///< of this opening
  std::optional<Error> broken_ = std::nullopt;      ///< why the last opening ended
};

}  // namespace spindle::link
