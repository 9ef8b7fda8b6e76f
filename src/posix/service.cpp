#include "spindle/posix/service.hpp"

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "posix/descriptor.hpp"

namespace spindle::posix {
namespace {

/// A manager that takes nothing must not hold up the recording for longer.
constexpr timeval longest_send = {.tv_sec = 2, .tv_usec = 0};

/// The value of a variable, which is no longer set; empty: it was not.
std::string take_variable(const char* name) {
  const char* const value = std::getenv(name);
  std::string taken = value == nullptr ? std::string() : std::string(value);
  ::unsetenv(name);
  return taken;
}

std::optional<std::uint64_t> to_number(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

struct Address {
  sockaddr_un socket = {};
  socklen_t length = 0;
};

/// A path, or a name of the abstract namespace behind "@".
std::optional<Address> address_of(std::string_view text) {
  Address address;
  if (text.size() < 2 || text.size() >= sizeof address.socket.sun_path) return std::nullopt;
  if (text.front() != '/' && text.front() != '@') return std::nullopt;
  address.socket.sun_family = AF_UNIX;
  text.copy(address.socket.sun_path, text.size());
  if (text.front() == '@') address.socket.sun_path[0] = '\0';
  address.length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + text.size());
  return address;
}

std::function<void(std::string_view)> notifier(const std::string& place) {
  const auto address = address_of(place);
  if (!address) return {};
  return [address = *address](std::string_view state) {
    const Descriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    if (!socket.valid()) return;
    ::setsockopt(socket.number(), SOL_SOCKET, SO_SNDTIMEO, &longest_send, sizeof longest_send);
    const auto* const to = reinterpret_cast<const sockaddr*>(&address.socket);
    // One that does not take it is not there any more, and there is no other way to tell.
    [[maybe_unused]] const ssize_t sent =
        ::sendto(socket.number(), state.data(), state.size(), MSG_NOSIGNAL, to, address.length);
  };
}

}  // namespace

ServiceManager take_service_manager() {
  ServiceManager manager;
  manager.notify = notifier(take_variable("NOTIFY_SOCKET"));
  const auto period = to_number(take_variable("WATCHDOG_USEC"));
  const std::string pid = take_variable("WATCHDOG_PID");
  const bool is_meant = pid.empty() || pid == std::to_string(::getpid());
  if (manager.notify && period && *period > 0 && is_meant) {
    manager.watchdog = std::chrono::microseconds(*period);
  }
  return manager;
}

}  // namespace spindle::posix
