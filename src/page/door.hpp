#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "page/sockets.hpp"

struct pollfd;

namespace spindle::page {

/// A client whose request head has arrived, up to and with the empty line.
struct Arrival {
  Socket socket = {};
  std::string head = {};
};

/// Lets clients in, in one thread for all: one that says nothing, or takes nothing, costs a
/// descriptor and no thread, and is sent away in time.
class Door {
 public:
  static constexpr std::size_t longest_head = 8192;
  static constexpr std::size_t most_guests = 256;  ///< that are not in yet, or on their way out

  /// `enter` must not wait. The clock must outlive it.
  Door(Socket listener, const Clock& clock, std::function<void(Arrival)> enter);

  /// Until stop().
  void run();
  void stop();
  /// Sends the whole of an answer and closes, once the client has taken it. By any thread.
  void send_off(Socket socket, std::string answer);

 private:
  enum class Doing : std::uint8_t { arriving, leaving, closing };
  struct Guest {
    Socket socket = {};
    Doing doing = Doing::arriving;
    std::string text = {};  ///< what was heard, or what is left to be sent
    std::size_t sent = 0;
    TimePoint until = {};
  };

  void wake() const;
  void take_leavers();
  void let_in();
  [[nodiscard]] std::vector<pollfd> wanted() const;
  [[nodiscard]] int patience() const;
  /// False where the guest is done with.
  bool serve(Guest& guest);
  bool hear(Guest& guest);
  bool send(Guest& guest) const;

  Socket listener_;
  Socket waker_;
  const Clock* clock_;
  std::function<void(Arrival)> enter_;
  std::atomic<bool> is_over_{false};
  std::mutex mutex_ = {};
  std::deque<Guest> leavers_ = {};
  std::deque<Guest> guests_ = {};
  TimePoint accepts_again_ = {};  ///< where there was no descriptor left
};

}  // namespace spindle::page
