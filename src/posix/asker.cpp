#include "posix/asker.hpp"

#include <sys/socket.h>

#include <array>
#include <cerrno>

#include "spindle/link/asked_line.hpp"
#include "spindle/modbus/adu.hpp"

namespace spindle::posix {
namespace {

/// A program that takes no answer for so long is given up.
constexpr Duration patience = std::chrono::seconds(2);

constexpr std::size_t head_size = 6;  // of a Modbus TCP frame, up to its length
constexpr std::size_t length_at = 4;

/// One program that asks.
class Asker {
 public:
  Asker(const Descriptor& socket, const AskedAt& at, int ended, Clock& clock)
      : socket_(socket.number()),
        wire_(at.wire),
        ended_(ended),
        clock_(&clock),
        line_(*at.line,
              {.kind = at.wire == AskedAt::Wire::packets ? link::AskedLine::Peer::Kind::spindle
                                                         : link::AskedLine::Peer::Kind::any,
               .rights = at.rights,
               .answer = [this](ByteView packet) { return answer(packet); },
               .tell = [socket = socket_](ByteView packet) { tell(socket, packet); }},
              clock) {}
  Asker(const Asker&) = delete;
  Asker& operator=(const Asker&) = delete;
  ~Asker() = default;

  void serve() {
    std::array<std::uint8_t, link::max_owner_packet> bytes;  // NOLINT: filled by recv()
    while (wait(POLLIN, TimePoint::max())) {
      const ssize_t size = ::recv(socket_, bytes.data(), bytes.size(), 0);
      if (size < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (size <= 0) return;
      const ByteView got = ByteView(bytes).first(static_cast<std::size_t>(size));
      const bool goes_on = wire_ == AskedAt::Wire::packets ? line_.take(got) : take_stream(got);
      if (!goes_on) return;
    }
  }

 private:
  /// False when all ends, or at the deadline.
  [[nodiscard]] bool wait(short events, TimePoint deadline) const {
    std::array<pollfd, 2> descriptors = {pollfd{socket_, events, 0}, pollfd{ended_, POLLIN, 0}};
    while (true) {
      const int ready = poll_until(descriptors, deadline, *clock_);
      if (ready == 0) return false;
      if (ready > 0) return descriptors[1].revents == 0;
      if (clock_->now() >= deadline) return false;
    }
  }

  bool take_stream(ByteView got) {
    buffer_.insert(buffer_.end(), got.begin(), got.end());
    while (buffer_.size() >= head_size) {
      const std::size_t size = head_size + get_u16(buffer_, length_at);
      if (size > modbus::max_adu_size) return false;
      if (buffer_.size() < size) return true;
      const auto end = buffer_.begin() + static_cast<std::ptrdiff_t>(size);
      const Bytes frame(buffer_.begin(), end);
      buffer_.erase(buffer_.begin(), end);
      if (!line_.take(frame)) return false;
    }
    return true;
  }

  bool answer(ByteView packet) {
    const TimePoint deadline = clock_->now() + patience;
    while (!packet.empty()) {
      const ssize_t sent =
          ::send(socket_, packet.data(), packet.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent >= 0) {
        packet = packet.subspan(static_cast<std::size_t>(sent));
      } else if (errno != EINTR && (errno != EAGAIN || !wait(POLLOUT, deadline))) {
        return false;
      }
    }
    return true;
  }

  /// A whole packet or none: what is lost shows in the numbers that a tool gives its events.
  static void tell(int socket, ByteView packet) {
    [[maybe_unused]] const ssize_t sent =
        ::send(socket, packet.data(), packet.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }

  int socket_;
  AskedAt::Wire wire_;
  int ended_;
  Clock* clock_;
  Bytes buffer_ = {};
  link::AskedLine line_;
};

}  // namespace

void serve_asker(const Descriptor& socket, const AskedAt& at, int ended, Clock& clock) {
  Asker(socket, at, ended, clock).serve();
}

}  // namespace spindle::posix
