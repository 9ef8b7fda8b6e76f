#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "page/access.hpp"
#include "page/door.hpp"
#include "page/live.hpp"
#include "spindle/commands/context.hpp"

namespace spindle::page {

/// What every answer needs to know.
struct SiteFacts {
  ListenPlace place = {};
  std::string token = {};  ///< empty: none is asked for
  std::string store = {};  ///< path
};

/// Streams that are open, at most so many: each takes a thread.
class Streams {
 public:
  static constexpr std::size_t most = 48;

  explicit Streams(Live& live) : live_(&live) {}

  /// One stream, as long as it lives; of no socket where there are too many, or at the end.
  class Ticket {
   public:
    Ticket(Streams& streams, int socket) : streams_(&streams), socket_(streams.add(socket)) {}
    Ticket(const Ticket&) = delete;
    Ticket& operator=(const Ticket&) = delete;
    ~Ticket() { streams_->remove(socket_); }
    [[nodiscard]] bool is_granted() const { return socket_ >= 0; }

   private:
    Streams* streams_;
    int socket_;
  };

  [[nodiscard]] std::size_t count();
  /// Ends all of them, also one whose client takes nothing; there will be no other.
  void end();

 private:
  int add(int socket);
  void remove(int socket);

  Live* live_;
  std::mutex mutex_ = {};
  std::set<int> sockets_ = {};
  bool is_over_ = false;
};

/// Answers requests for the page until stop().
class Site {
 public:
  /// Begins at once. All must outlive it.
  Site(Socket listener, SiteFacts facts, Live& live, commands::Context& context);
  Site(const Site&) = delete;
  Site& operator=(const Site&) = delete;
  ~Site();

  /// Ends every stream and connection.
  void stop();

 private:
  class Pool;

  void answer(Arrival arrival);

  SiteFacts facts_;
  Live* live_;
  commands::Context* context_;
  Streams streams_;
  std::unique_ptr<Pool> pool_;
  Door door_;
  std::jthread doorman_;
};

}  // namespace spindle::page
