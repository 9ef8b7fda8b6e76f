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

/// How long a line stays open that no session has.
enum class Stays : std::uint8_t {
  while_shared,     ///< it does not
  while_answering,  ///< as long as what was asked last brought something
  while_it_lives,   ///< as long as the SharedLine
};

/// A serial line, or a connection to a gateway, that several sessions of one program have, each for
/// a unit of its own and each in a thread of its own: a port can only be opened once, and many a
/// gateway takes one connection. They take turns: from a request to the end of its answer the line
/// belongs to one of them. The next one keeps its silence behind that on a serial line, and goes on
/// with the stream of a connection.
class SharedLine {
 public:
  using Open = std::function<Result<std::unique_ptr<Transport>>()>;

  /// `clock` must outlive the line, and the line all shares.
  explicit SharedLine(Clock& clock, Stays stays = Stays::while_shared)
      : clock_(&clock), stays_(stays) {}
  SharedLine(const SharedLine&) = delete;
  SharedLine& operator=(const SharedLine&) = delete;
  ~SharedLine() = default;

  /// A share of the line, which the first one opens; with the last one it is closed, unless it
  /// stays open. Outside of its turns it receives nothing. It has no shield, as an interrupt has to
  /// end the waits of all: what leaves a tool safe needs a line of its own. When the line breaks,
  /// it does so for all, and the next who joins opens it anew. Errors: those of `open`.
  Result<std::unique_ptr<Transport>> join(const Open& open);

 private:
  class Share;

  [[nodiscard]] bool stays_open() const {
    return stays_ == Stays::while_it_lives || (stays_ == Stays::while_answering && is_answering_);
  }

  Clock* clock_;
  Stays stays_;
  FairLock turn_ = {};
  Transport::BusLease left_ = {};  ///< belongs to the share that has the turn
  std::size_t left_by_ = 0;        ///< likewise: the opening that its stream is of

  std::mutex mutex_ = {};                           ///< guards everything below
  std::unique_ptr<Transport> transport_ = nullptr;  ///< empty: not open
  std::size_t opened_ = 0;                          ///< how often, so that old shares know
  std::size_t shares_ = 0;                          ///< of this opening
  std::optional<Error> broken_ = std::nullopt;      ///< why the last opening ended
  bool is_answering_ = true;                        ///< something came since the last request
  TimePoint late_until_ = {};  ///< when no answer of this opening that was given up can come
};

}  // namespace spindle::link
