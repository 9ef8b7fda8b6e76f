#include "page/door.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

namespace spindle::page {
namespace {

constexpr Duration to_arrive = std::chrono::seconds(5);
constexpr Duration to_leave = std::chrono::seconds(30);
constexpr Duration to_close = std::chrono::seconds(2);
constexpr Duration without_descriptors = std::chrono::milliseconds(100);

constexpr std::string_view too_long =
    "HTTP/1.1 431 Request Header Fields Too Large\r\nContent-Length: 0\r\nConnection: "
    "close\r\n\r\n";

}  // namespace

Door::Door(Socket listener, const Clock& clock, std::function<void(Arrival)> enter)
    : listener_(std::move(listener)),
      waker_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      clock_(&clock),
      enter_(std::move(enter)) {}

void Door::wake() const {
  const std::uint64_t one = 1;
  static_cast<void>(::write(waker_.get(), &one, sizeof one) == 0);
}

void Door::stop() {
  is_over_.store(true);
  wake();
}

void Door::send_off(Socket socket, std::string answer) {
  {
    const std::lock_guard lock(mutex_);
    leavers_.push_back({.socket = std::move(socket),
                        .doing = Doing::leaving,
                        .text = std::move(answer),
                        .until = clock_->now() + to_leave});
  }
  wake();
}

void Door::run() {
  while (!is_over_.load()) {
    take_leavers();
    std::vector<pollfd> looked = wanted();
    ::poll(looked.data(), looked.size(), patience());
    std::uint64_t woken = 0;
    static_cast<void>(::read(waker_.get(), &woken, sizeof woken) == 0);
    const TimePoint now = clock_->now();
    std::size_t at = 2;
    for (Guest& guest : guests_) {
      const bool is_ready = looked[at++].revents != 0;
      const bool stays = is_ready ? serve(guest) : guest.until > now;
      if (!stays) guest.socket = Socket();
    }
    std::erase_if(guests_, [](const Guest& guest) { return !guest.socket.is_open(); });
    if (looked[1].revents != 0) let_in();
  }
}

void Door::take_leavers() {
  const std::lock_guard lock(mutex_);
  while (!leavers_.empty()) {
    guests_.push_back(std::move(leavers_.front()));
    leavers_.pop_front();
  }
}

std::vector<pollfd> Door::wanted() const {
  const bool accepts = clock_->now() >= accepts_again_;
  std::vector<pollfd> wanted = {
      {.fd = waker_.get(), .events = POLLIN, .revents = 0},
      {.fd = accepts ? listener_.get() : -1, .events = POLLIN, .revents = 0}};
  for (const Guest& guest : guests_) {
    const bool sends = guest.doing == Doing::leaving;
    wanted.push_back({.fd = guest.socket.get(),
                      .events = static_cast<short>(sends ? POLLOUT : POLLIN),
                      .revents = 0});
  }
  return wanted;
}

/// Until the first of the guests has had its time.
int Door::patience() const {
  const TimePoint now = clock_->now();
  std::optional<TimePoint> first;
  if (accepts_again_ > now) first = accepts_again_;
  for (const Guest& guest : guests_) first = std::min(first.value_or(guest.until), guest.until);
  if (!first) return -1;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(*first - now).count();
  return static_cast<int>(std::max<std::int64_t>(left, 0));
}

void Door::let_in() {
  while (true) {
    Socket socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket.is_open()) {
      const bool has_none = errno == EMFILE || errno == ENFILE || errno == ENOMEM;
      if (has_none) accepts_again_ = clock_->now() + without_descriptors;
      return;
    }
    if (guests_.size() >= most_guests) {
      // The one that has kept others waiting for the longest time.
      const auto oldest =
          std::min_element(guests_.begin(), guests_.end(),
                           [](const Guest& a, const Guest& b) { return a.until < b.until; });
      guests_.erase(oldest);
    }
    guests_.push_back({.socket = std::move(socket), .until = clock_->now() + to_arrive});
  }
}

bool Door::serve(Guest& guest) { return guest.doing == Doing::leaving ? send(guest) : hear(guest); }

/// More of a head, or what comes behind the end of the talk.
bool Door::hear(Guest& guest) {
  std::array<char, 4096> part = {};
  const ssize_t length = ::recv(guest.socket.get(), part.data(), part.size(), 0);
  if (length < 0) return errno == EAGAIN || errno == EINTR;
  if (length == 0) return false;
  if (guest.doing == Doing::closing) return guest.until > clock_->now();
  guest.text.append(part.data(), static_cast<std::size_t>(length));
  const std::size_t end = guest.text.find("\r\n\r\n");
  const std::size_t size = end == std::string::npos ? guest.text.size() : end + 4;
  if (size > longest_head) {
    guest.doing = Doing::leaving;
    guest.text = too_long;
    guest.until = clock_->now() + to_close;
    return true;
  }
  if (end == std::string::npos) return guest.until > clock_->now();
  // What stands behind the head is the body of a request that is not granted.
  guest.text.resize(size);
  enter_({.socket = std::move(guest.socket), .head = std::move(guest.text)});
  return false;
}

bool Door::send(Guest& guest) const {
  const std::string_view left = std::string_view(guest.text).substr(guest.sent);
  const ssize_t sent =
      ::send(guest.socket.get(), left.data(), left.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  if (sent < 0) return errno == EAGAIN || errno == EINTR;
  guest.sent += static_cast<std::size_t>(sent);
  if (guest.sent < guest.text.size()) return guest.until > clock_->now();
  // Closed at once, what the client still sends would take the answer from it (RFC 9112, 9.6).
  ::shutdown(guest.socket.get(), SHUT_WR);
  guest.doing = Doing::closing;
  guest.until = clock_->now() + to_close;
  guest.text.clear();
  return true;
}

}  // namespace spindle::page
