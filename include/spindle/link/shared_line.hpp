#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "spindle/link/session.hpp"
#include "spindle/link/transport.hpp"

namespace spindle::link {

/// Who of those that wait for a line gets it first.
enum class Lane : std::uint8_t {
  stop,   ///< what leaves a tool safe
  usual,  ///< everything else, in the order in which it was asked for
};

/// A lock that is had in the order in which it was asked for, so that a session that is always busy
/// keeps no other one waiting for ever. Only a stop does not wait for its turn.
class FairLock {
 public:
  /// `call` is called, with nothing locked, when one begins to wait; it may be empty.
  void lock(Lane lane = Lane::usual, const std::function<void()>& call = {});
  /// False where it is held.
  bool try_lock();
  void unlock();

  /// Whether one waits in this lane. Where none holds the lock, none waits.
  [[nodiscard]] bool is_wanted(Lane lane) const;
  [[nodiscard]] bool is_wanted() const { return is_wanted(Lane::stop) || is_wanted(Lane::usual); }

 private:
  struct Waiter {
    std::condition_variable called = {};
    bool has_turn = false;
  };

  [[nodiscard]] const std::deque<Waiter*>& waiting(Lane lane) const {
    return lane == Lane::stop ? stops_ : usual_;
  }

  mutable std::mutex mutex_ = {};
  bool held_ = false;
  std::deque<Waiter*> stops_ = {};
  std::deque<Waiter*> usual_ = {};
};

/// How long a line stays open that no session has.
enum class Stays : std::uint8_t {
  while_shared,     ///< it does not
  while_answering,  ///< as long as what was asked last brought something
  while_it_lives,   ///< as long as the SharedLine
};

/// A serial line or a connection that several sessions have, each in a thread of its own: units of
/// one line or gateway, and other programs that ask through this one. A port can only be opened
/// once, and many a gateway or tool takes one connection. They take turns: from a request to the
/// end of its answer the line belongs to one of them. The next one keeps its silence behind that on
/// a serial line, and goes on with the stream of a connection.
///
/// What a Modbus TCP tool sends unasked reaches all of them: outside of the turns one session that
/// waits listens, and what came in the turn of another one is kept for those that did not see it.
/// Frames with the id of a request of this connection are kept from the others unless they have a
/// shape that tools send unasked, so that no late answer is taken for an event.
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
  /// stays open. On a serial line a share receives nothing outside of its turns, unless it is the
  /// only one. An interrupt ends the waits of all but those of a share that was made
  /// uninterruptible, which is urgent, too. When the line breaks, it does so for all, and the next
  /// who joins opens it anew. Errors: those of `open`.
  Result<std::unique_ptr<Transport>> join(const Open& open);

  /// A share for another program: it neither opens the line nor keeps it open, and hears nothing
  /// outside of its turns. Error: why the line is not open, or that no session of this program said
  /// yet how it is asked.
  Result<std::unique_ptr<Transport>> join_open();

  /// Hears every frame of Modbus TCP that comes unasked, as long as it lives. `hear` must neither
  /// wait nor use the line; it is called by the thread that received the frame.
  class Ear;
  std::unique_ptr<Ear> listen(std::function<void(ByteView frame)> hear);

  /// Calls `tell` once, when a session of this program says for the first time how it asks on the
  /// present opening: from then on others can ask. By the thread of that session.
  void when_introduced(std::function<void()> tell);

  /// Which opening this is, counted from 1; changes when the line is opened anew.
  [[nodiscard]] std::size_t opening() const;
  /// Why the line is not open; empty: it is.
  [[nodiscard]] std::optional<Error> trouble() const;
  /// How this program's own sessions ask this unit, or any other one where it asks none of this
  /// number. Empty: none did yet.
  [[nodiscard]] std::optional<SessionOptions> manner_with(modbus::UnitId unit) const;
  /// Frames that were dropped because a session did not take them.
  [[nodiscard]] std::uint64_t dropped() const;

  /// Ends the line for all: what waits in a turn ends at once with this error.
  void close(const Error& why);
  /// The same, where it stayed open although no session of this program has a share any more.
  void close_unused(const Error& why);

 private:
  class Share;
  enum class Of : std::uint8_t { this_program, others };

  [[nodiscard]] bool stays_open() const {
    return stays_ == Stays::while_it_lives || (stays_ == Stays::while_answering && is_answering_);
  }
  void call_holder(Lane lane);
  void close_opening(std::unique_lock<std::mutex>& lock, const Error& why);
  void deliver(ByteView frame, const Share* but_not);

  Clock* clock_;
  Stays stays_;
  FairLock turn_ = {};
  Transport::BusLease left_ = {};  ///< belongs to the share that has the turn
  Bytes rest_ = {};                ///< likewise: of a stream, received outside of the turns
  std::size_t left_by_ = 0;        ///< likewise: the opening that its stream is of

  std::mutex opening_ = {};  ///< held while the line is opened or closed; locked before the other

  mutable std::mutex mutex_ = {};                   ///< guards everything below
  std::unique_ptr<Transport> transport_ = nullptr;  ///< empty: not open
  std::size_t opened_ = 0;                          ///< how often, so that old shares know
  std::size_t shares_ = 0;                          ///< of this opening and program
  std::vector<Share*> hearing_ = {};                ///< shares of this program, of any opening
  std::vector<Ear*> ears_ = {};
  const Share* listener_ = nullptr;             ///< waits for frames outside of the turns
  bool is_listened_to_ = false;                 ///< it has the turn meanwhile
  std::optional<Error> broken_ = std::nullopt;  ///< why the last opening ended
  std::map<modbus::UnitId, SessionOptions> manners_ = {};
  std::function<void()> tell_introduced_ = {};
  std::optional<modbus::Framing> framing_ = std::nullopt;  ///< empty: no session yet
  std::uint64_t dropped_ = 0;
  bool is_answering_ = true;   ///< something came since the last request
  TimePoint late_until_ = {};  ///< when no answer of this opening that was given up can come
};

class SharedLine::Ear {
 public:
  Ear(SharedLine& line, std::function<void(ByteView frame)> hear);
  Ear(const Ear&) = delete;
  Ear& operator=(const Ear&) = delete;
  ~Ear();

 private:
  friend class SharedLine;

  SharedLine* line_;
  std::function<void(ByteView frame)> hear_;
};

}  // namespace spindle::link
