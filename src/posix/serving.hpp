#pragma once

#include <poll.h>

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "posix/descriptor.hpp"
#include "posix/served_client.hpp"

namespace spindle::posix {

/// All clients of one tool, in one thread.
class Serving {
 public:
  Serving(Service service, const Clock& clock, const Interrupt& interrupt)
      : service_(service),
        clock_(&clock),
        interrupt_(&interrupt),
        outages_(service.options.outages, clock.now()) {}
  Serving(const Serving&) = delete;
  Serving& operator=(const Serving&) = delete;
  ~Serving() = default;

  /// Takes clients from this socket.
  void listen(Descriptor listener) { listener_ = std::move(listener); }
  /// A client that is there already.
  void adopt(Descriptor descriptor, ServedClient::Wire wire);
  /// Until an interrupt, or until no client is left and none can come any more.
  void run();

 private:
  void wait();
  [[nodiscard]] TimePoint wake_at(TimePoint now) const;
  void accept_waiting(TimePoint now);
  void read_ready(TimePoint now);
  void distribute_pushes(TimePoint now);
  void write_and_reap(TimePoint now);
  void follow_outages(TimePoint now);
  [[nodiscard]] bool is_silent() const;

  Service service_;
  Descriptor listener_ = Descriptor();
  const Clock* clock_;
  const Interrupt* interrupt_;
  sim::OutageSchedule outages_;
  std::optional<sim::OutageKind> outage_ = std::nullopt;  // under way
  std::map<std::uint32_t, ServedClient> clients_ = {};
  // The listener, the interrupt, then the clients in the map's order.
  std::vector<pollfd> polled_ = {};
  TimePoint accept_after_ = {};
  std::uint32_t last_connection_ = 0;
};

}  // namespace spindle::posix
