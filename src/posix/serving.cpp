#include "posix/serving.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

#include "posix/wait.hpp"

namespace spindle::posix {
namespace {

// While the process has no descriptor left, a waiting client keeps the listener ready; asking again
// at once would only burn time until others leave.
constexpr Duration accept_pause = std::chrono::milliseconds(100);

constexpr std::size_t polled_before_clients = 2;

}  // namespace

void Serving::run() {
  while (!interrupt_->raised() && (listener_.valid() || !clients_.empty())) {
    follow_outages(clock_->now());
    wait();
    const TimePoint now = clock_->now();
    service_.server.advance(now);
    read_ready(now);
    accept_waiting(now);
    distribute_pushes(now);
    if (!is_silent()) write_and_reap(now);
  }
}

// While a tool sleeps, or its radio is away, nothing passes.
bool Serving::is_silent() const { return outage_ && *outage_ != sim::OutageKind::other_client; }

void Serving::follow_outages(TimePoint now) {
  const auto before = std::exchange(outage_, outages_.at(now));
  if (outage_ == before) return;
  const bool rebooted = outage_ == sim::OutageKind::reboot;
  if (rebooted) service_.server.reboot(now);
  const bool came_back = before == sim::OutageKind::roam;
  // A line outlives what hangs on it, but what was said to a driver without power is lost.
  const bool serial = service_.options.framing == modbus::Framing::rtu;
  if (serial && (rebooted || before == sim::OutageKind::reboot)) {
    for (auto& [id, client] : clients_) client.forget();
  }
  const bool drops = came_back || (rebooted && !serial) || outage_ == sim::OutageKind::other_client;
  if (drops && listener_.valid()) clients_.clear();  // a serial line stays where it is
}

void Serving::adopt(Descriptor descriptor, ServedClient::Wire wire) {
  const sim::ConnectionId connection{++last_connection_};
  clients_.try_emplace(connection.value, std::move(descriptor), wire, connection, service_);
}

void Serving::wait() {
  const TimePoint now = clock_->now();
  const bool accepts = now >= accept_after_ && !is_silent();
  const int listener = accepts ? listener_.number() : -1;
  polled_.assign({pollfd{listener, POLLIN, 0}, pollfd{interrupt_->descriptor(), POLLIN, 0}});
  for (const auto& [id, client] : clients_) {
    polled_.push_back({is_silent() ? -1 : client.descriptor(), client.events(), 0});
  }
  if (poll_until(polled_, wake_at(now), *clock_) >= 0) return;
  // After a signal nothing was filled in, and nothing is known to be ready.
  for (pollfd& polled : polled_) polled.revents = 0;
}

TimePoint Serving::wake_at(TimePoint now) const {
  TimePoint wake = service_.server.next_change().value_or(TimePoint::max());
  wake = std::min(wake, outages_.next_change(now).value_or(TimePoint::max()));
  if (is_silent()) return wake;
  if (accept_after_ > now) wake = std::min(wake, accept_after_);
  for (const auto& [id, client] : clients_) {
    wake = std::min(wake, client.wake_at().value_or(TimePoint::max()));
  }
  return wake;
}

void Serving::read_ready(TimePoint now) {
  std::size_t place = polled_before_clients;
  for (auto& [id, client] : clients_) {
    constexpr int readable = POLLIN | POLLHUP | POLLERR;
    if ((polled_[place++].revents & readable) != 0) client.read(now);
  }
}

void Serving::accept_waiting(TimePoint now) {
  if (polled_.front().revents == 0) return;
  for (;;) {
    Descriptor socket(
        ::accept4(listener_.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (socket.valid() && outage_ == sim::OutageKind::other_client) continue;  // and is closed
    if (socket.valid()) {
      const int on = 1;
      ::setsockopt(socket.number(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      adopt(std::move(socket), ServedClient::Wire::socket);
      continue;
    }
    // A client that has left already; the next may be waiting behind it.
    if (errno == ECONNABORTED || errno == EINTR) continue;
    if (errno != EAGAIN) accept_after_ = now + accept_pause;
    return;
  }
}

void Serving::distribute_pushes(TimePoint now) {
  for (const sim::Push& push : service_.server.take_pushes()) {
    const auto client = clients_.find(push.connection.value);
    if (client != clients_.end()) client->second.push(push.pdu, now);
  }
}

void Serving::write_and_reap(TimePoint now) {
  for (auto client = clients_.begin(); client != clients_.end();) {
    client->second.write(now);
    client = client->second.finished(now) ? clients_.erase(client) : std::next(client);
  }
}

}  // namespace spindle::posix
