#include "spindle/posix/doors.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <list>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "posix/asker.hpp"
#include "posix/listener.hpp"
#include "posix/runtime_folder.hpp"

namespace spindle::posix {
namespace {

/// Programs that ask by TCP at the same time; others of the machine are few by nature.
constexpr int most_clients = 64;

// While the process has no descriptor left, asking again at once would only burn time.
constexpr Duration accept_pause = std::chrono::milliseconds(100);

/// Each tool needs a few descriptors, and there may be hundreds.
constexpr rlim_t wanted_descriptors = 65'536;

void raise_descriptor_limit() {
  rlimit limit = {};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted_descriptors) return;
  limit.rlim_cur = std::min(limit.rlim_max, wanted_descriptors);
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

Error cannot_be_asked(int error_number) {
  return {.code = Errc::port_unusable,
          .message = "other programs cannot ask: " + std::generic_category().message(error_number)};
}

/// A socket of a line, with the lock that says whose it is: a socket that its owner left behind is
/// removed only by the next one, who has the lock.
struct UnixDoor {
  Descriptor lock = Descriptor();
  Descriptor listening = Descriptor();
  std::string path = {};
};

/// Empty where another program has this line.
Result<std::optional<UnixDoor>> open_unix(const OwnerFolder& folder, const std::string& name) {
  auto path = socket_path(folder.path, name);
  if (!path) return tl::unexpected(cannot_be_asked(ENAMETOOLONG));
  UnixDoor door{.path = std::move(*path)};
  const std::string lock = door.path + ".lock";
  door.lock = Descriptor(
      ::open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR));
  if (!door.lock.valid()) return tl::unexpected(cannot_be_asked(errno));
  if (::flock(door.lock.number(), LOCK_EX | LOCK_NB) != 0) return std::nullopt;
  ::unlink(door.path.c_str());
  door.listening = Descriptor(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  std::copy(door.path.begin(), door.path.end(), address.sun_path);
  const auto* const at = reinterpret_cast<const sockaddr*>(&address);
  const bool is_listening = door.listening.valid() &&
                            ::bind(door.listening.number(), at, sizeof address) == 0 &&
                            ::chmod(door.path.c_str(), folder.mode) == 0 &&
                            ::listen(door.listening.number(), SOMAXCONN) == 0;
  if (!is_listening) return tl::unexpected(cannot_be_asked(errno));
  return door;
}

class LineDoors final : public link::Doors {
 public:
  LineDoors(Clock& clock, const Interrupt& interrupt)
      : clock_(&clock),
        interrupt_(&interrupt),
        changed_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
        ended_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}
  ~LineDoors() override;

  Result<void> open(const std::string& name, link::SharedLine& line) override;
  void close(const std::string& name) override;
  Result<std::uint16_t> listen(const std::string& host, std::uint16_t port, link::SharedLine& line,
                               link::Rights rights) override;

 private:
  struct Door {
    std::string name;
    UnixDoor socket;
    AskedAt at;
    bool is_closing = false;
  };
  struct Asking {
    Descriptor socket;
    AskedAt at;
    std::atomic<bool> is_over = false;
    std::thread thread = {};
  };

  void add(Door door);
  Door* door_of(const std::string& name);
  void close_doors();
  void run();
  [[nodiscard]] std::vector<pollfd> polled();
  void accept_from(const pollfd& ready);
  bool accept_one(const Door& door);
  [[nodiscard]] bool may_ask(const Descriptor& socket, const Door& door);
  void reap(bool all);

  Clock* clock_;
  const Interrupt* interrupt_;
  Descriptor changed_;  ///< there is another door
  Descriptor ended_;    ///< stays readable
  std::mutex mutex_ = {};
  std::list<Door> doors_ = {};
  std::list<Asking> asking_ = {};  ///< only the accepting thread uses it while it runs
  TimePoint accept_after_ = {};    ///< likewise
  std::thread thread_ = {};
};

void raise(const Descriptor& event) {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(event.number(), &one, sizeof one);
}

LineDoors::~LineDoors() {
  raise(ended_);
  if (thread_.joinable()) thread_.join();
  for (const Door& door : doors_) {
    if (!door.socket.path.empty()) ::unlink(door.socket.path.c_str());
  }
  reap(true);
}

Result<void> LineDoors::open(const std::string& name, link::SharedLine& line) {
  {
    const std::lock_guard lock(mutex_);
    if (Door* const door = door_of(name)) {
      door->is_closing = false;
      return {};
    }
  }
  const auto folder = served_folder();
  if (!folder) return tl::unexpected(cannot_be_asked(EACCES));
  raise_descriptor_limit();
  TRY_LET(auto door, open_unix(*folder, name));
  if (!door) return {};
  add({.name = name,
       .socket = std::move(*door),
       .at = {.wire = AskedAt::Wire::packets, .line = &line, .rights = link::Rights::write}});
  return {};
}

/// Called with the mutex locked.
LineDoors::Door* LineDoors::door_of(const std::string& name) {
  const auto door =
      std::find_if(doors_.begin(), doors_.end(), [&](const Door& one) { return one.name == name; });
  return door == doors_.end() ? nullptr : &*door;
}

void LineDoors::close(const std::string& name) {
  const std::lock_guard lock(mutex_);
  Door* const door = door_of(name);
  if (door == nullptr) return;
  door->is_closing = true;
  raise(changed_);
}

/// By the thread that lets others in.
void LineDoors::close_doors() {
  const std::lock_guard lock(mutex_);
  for (auto door = doors_.begin(); door != doors_.end();) {
    if (!door->is_closing) {
      ++door;
      continue;
    }
    for (const Asking& asking : asking_) {
      const bool is_here = asking.at.line == door->at.line && asking.at.wire == door->at.wire;
      if (is_here) ::shutdown(asking.socket.number(), SHUT_RDWR);
    }
    ::unlink(door->socket.path.c_str());
    door = doors_.erase(door);
  }
}

Result<std::uint16_t> LineDoors::listen(const std::string& host, std::uint16_t port,
                                        link::SharedLine& line, link::Rights rights) {
  TRY_LET(auto listener, listen_on(host, port, *clock_, *interrupt_));
  add({.name = {},
       .socket = {.listening = std::move(listener.socket)},
       .at = {.wire = AskedAt::Wire::stream, .line = &line, .rights = rights}});
  return listener.port;
}

void LineDoors::add(Door door) {
  const std::lock_guard lock(mutex_);
  doors_.push_back(std::move(door));
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  raise(changed_);
}

std::vector<pollfd> LineDoors::polled() {
  std::vector<pollfd> all = {{ended_.number(), POLLIN, 0}, {changed_.number(), POLLIN, 0}};
  if (clock_->now() < accept_after_) return all;
  const std::lock_guard lock(mutex_);
  for (const Door& door : doors_) all.push_back({door.socket.listening.number(), POLLIN, 0});
  return all;
}

void LineDoors::run() {
  while (true) {
    auto descriptors = polled();
    const TimePoint until = clock_->now() < accept_after_ ? accept_after_ : TimePoint::max();
    if (poll_until(descriptors, until, *clock_) < 0) continue;
    if (descriptors[0].revents != 0) return;
    if (descriptors[1].revents != 0) {
      std::uint64_t times = 0;
      [[maybe_unused]] const ssize_t taken = ::read(changed_.number(), &times, sizeof times);
    }
    close_doors();
    for (std::size_t at = 2; at < descriptors.size(); ++at) accept_from(descriptors[at]);
    reap(false);
  }
}

void LineDoors::accept_from(const pollfd& ready) {
  if (ready.revents == 0) return;
  const std::lock_guard lock(mutex_);
  const auto door = std::find_if(doors_.begin(), doors_.end(), [&](const Door& one) {
    return one.socket.listening.number() == ready.fd;
  });
  while (door != doors_.end() && accept_one(*door)) {
  }
}

/// False where none waits any more, or none can be let in now.
bool LineDoors::accept_one(const Door& door) {
  Descriptor socket(
      ::accept4(door.socket.listening.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!socket.valid()) {
    if (errno == ECONNABORTED || errno == EINTR) return true;
    if (errno != EAGAIN) accept_after_ = clock_->now() + accept_pause;
    return false;
  }
  if (!may_ask(socket, door)) return true;  // and is closed
  Asking& asking = asking_.emplace_back();
  asking.socket = std::move(socket);
  asking.at = door.at;
  try {
    asking.thread = std::thread([this, &asking] {
      serve_asker(asking.socket, asking.at, ended_.number(), *clock_);
      ::shutdown(asking.socket.number(), SHUT_RDWR);
      asking.is_over = true;
      raise(changed_);
    });
  } catch (const std::system_error&) {  // there are too many threads
    asking_.pop_back();
    accept_after_ = clock_->now() + accept_pause;
    return false;
  }
  return true;
}

bool LineDoors::may_ask(const Descriptor& socket, const Door& door) {
  if (door.at.wire == AskedAt::Wire::stream) {
    const auto clients = std::count_if(asking_.begin(), asking_.end(), [](const Asking& one) {
      return one.at.wire == AskedAt::Wire::stream && !one.is_over;
    });
    const int on = 1;
    ::setsockopt(socket.number(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    ::setsockopt(socket.number(), SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
    return clients < most_clients;
  }
  ucred peer = {};
  socklen_t size = sizeof peer;
  if (::getsockopt(socket.number(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return false;
  // Into the service's folder the system lets only its group.
  const auto folder = served_folder();
  const bool is_for_group = folder && (folder->mode & S_IRGRP) != 0;
  return peer.uid == ::geteuid() || peer.uid == 0 || is_for_group;
}

void LineDoors::reap(bool all) {
  for (auto asking = asking_.begin(); asking != asking_.end();) {
    if (!all && !asking->is_over) {
      ++asking;
      continue;
    }
    if (asking->thread.joinable()) asking->thread.join();
    asking = asking_.erase(asking);
  }
}

}  // namespace

link::MakeDoors door_maker(Clock& clock, const Interrupt& interrupt) {
  return [&clock, &interrupt] { return std::make_unique<LineDoors>(clock, interrupt); };
}

}  // namespace spindle::posix
