#include "posix/served_client.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "posix/baud.hpp"

namespace spindle::posix {
namespace {

// A client that takes nothing while the tool keeps sending: thousands of events. It is given up
// before it costs memory.
constexpr std::size_t max_outgoing = std::size_t{1} << 20U;

// Several frames at once, and still fair to the other clients.
constexpr std::size_t read_size = 4096;

// More unread input than this is no client of good will.
constexpr std::size_t max_discarded_reads = 64;

// What bits at another rate are heard as: no frame.
constexpr std::uint8_t noise_byte = 0xFF;

// How long the second direction may outlive the first. A client on a slow link has long taken
// everything by then.
constexpr Duration linger = std::chrono::seconds(2);

std::optional<TimePoint> earlier(std::optional<TimePoint> a, std::optional<TimePoint> b) {
  if (!a || !b) return a ? a : b;
  return std::min(*a, *b);
}

}  // namespace

ServedClient::ServedClient(Descriptor descriptor, Wire wire, sim::ConnectionId connection,
                           Service& service)
    : descriptor_(std::move(descriptor)),
      wire_(wire),
      connection_(connection),
      options_(&service.options),
      peer_(service.server, connection, service.options.framing, service.options.faults,
            service.answers, service.options.line) {
  hear(sim::Heard::connected, {});
  peer_.set_ignored([this](ByteView bytes, std::string_view reason) {
    if (!options_->ignored) return;
    if (!at_another_rate()) return options_->ignored(connection_.value, bytes, reason);
    options_->ignored(connection_.value, bytes,
                      fmt::format("it comes at another rate than {} baud", options_->baud));
  });
}

ServedClient::~ServedClient() {
  if (wire_ == Wire::socket) discard_input();
  hear(sim::Heard::disconnected, {});
}

void ServedClient::discard_input() const {
  // Closing with unread input would reset the connection and take away what the client has not
  // read yet.
  ::shutdown(descriptor(), SHUT_WR);
  std::array<std::uint8_t, read_size> discarded;
  std::size_t reads = health_ == Health::sound ? max_discarded_reads : 0;
  while (reads > 0 && ::recv(descriptor(), discarded.data(), discarded.size(), 0) > 0) --reads;
}

short ServedClient::events() const {
  const int in = input_ == Half::open ? POLLIN : 0;
  const int out = outgoing_.empty() ? 0 : POLLOUT;
  return static_cast<short>(in | out);
}

std::optional<TimePoint> ServedClient::wake_at() const {
  // While the client takes nothing, only its taking matters: what is due would stay due for ever.
  const bool may_send = output_ == Half::open && outgoing_.empty();
  return earlier(may_send ? peer_.next_due() : std::nullopt, linger_until_);
}

void ServedClient::read(TimePoint now) {
  std::array<std::uint8_t, read_size> bytes;
  const ssize_t received = ::read(descriptor(), bytes.data(), bytes.size());
  if (received < 0) {
    if (errno != EAGAIN && errno != EINTR) health_ = Health::broken;
  } else if (received == 0) {
    end_input(now);
  } else if (output_ == Half::open) {
    const ByteView got(bytes.data(), static_cast<std::size_t>(received));
    if (at_another_rate()) bytes.fill(noise_byte);
    hear(sim::Heard::request, got);
    peer_.receive(got, now);
  }
}

void ServedClient::forget() {
  std::array<std::uint8_t, read_size> lost;
  std::size_t reads = max_discarded_reads;
  while (reads > 0 && ::read(descriptor(), lost.data(), lost.size()) > 0) --reads;
  outgoing_.clear();
  peer_.forget();
}

void ServedClient::push(const modbus::Pdu& pdu, TimePoint now) {
  if (input_ == Half::open && output_ == Half::open) peer_.push(pdu, now);
}

void ServedClient::write(TimePoint now) {
  if (output_ == Half::ended) return;
  flush();
  // Piece by piece, so that each leaves as a segment of its own while the client keeps up.
  for (Bytes piece = peer_.take(now); !piece.empty(); piece = peer_.take(now)) {
    hear(sim::Heard::response, piece);
    outgoing_.insert(outgoing_.end(), piece.begin(), piece.end());
    flush();
    if (outgoing_.size() > max_outgoing) health_ = Health::broken;
    if (health_ == Health::broken) return;
  }
  const bool nothing_follows = input_ == Half::ended && !peer_.next_due();
  if (outgoing_.empty() && (peer_.closed(now) || nothing_follows)) end_output(now);
}

bool ServedClient::finished(TimePoint now) const {
  const bool both_ended = input_ == Half::ended && output_ == Half::ended;
  return health_ == Health::broken || both_ended || (linger_until_ && now >= *linger_until_);
}

void ServedClient::flush() {
  while (!outgoing_.empty() && health_ == Health::sound) {
    const ssize_t sent =
        wire_ == Wire::socket
            ? ::send(descriptor(), outgoing_.data(), outgoing_.size(), MSG_NOSIGNAL)
            : ::write(descriptor(), outgoing_.data(), outgoing_.size());
    if (sent >= 0) {
      outgoing_.erase(outgoing_.begin(), outgoing_.begin() + sent);
    } else if (errno == EAGAIN) {
      return;
    } else if (errno != EINTR) {
      health_ = Health::broken;
    }
  }
}

void ServedClient::end_input(TimePoint now) {
  input_ = Half::ended;
  if (!linger_until_) linger_until_ = now + linger;
}

void ServedClient::end_output(TimePoint now) {
  output_ = Half::ended;
  if (!linger_until_) linger_until_ = now + linger;
  if (wire_ == Wire::terminal) health_ = Health::broken;
  if (wire_ == Wire::socket) ::shutdown(descriptor(), SHUT_WR);
}

/// The client's bits are not what they seem to a server that counts them at its own rate.
bool ServedClient::at_another_rate() const {
  if (wire_ == Wire::socket || options_->baud == 0) return false;
  termios settings = {};
  return ::tcgetattr(descriptor(), &settings) == 0 &&
         ::cfgetospeed(&settings) != speed_of(options_->baud);
}

void ServedClient::hear(sim::Heard heard, ByteView bytes) const {
  if (options_->log) options_->log(heard, connection_.value, bytes);
}

}  // namespace spindle::posix
