#include "spindle/posix/service.hpp"

#include <doctest/doctest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <functional>
#include <string>

#include "posix/descriptor.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;
using namespace std::chrono_literals;

namespace {

/// The end of a service manager.
class Listener {
 public:
  explicit Listener(const std::string& name)
      : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    name.copy(address.sun_path, sizeof address.sun_path - 1);
    if (name.front() == '@') address.sun_path[0] = '\0';
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    REQUIRE(::bind(socket_.number(), reinterpret_cast<const sockaddr*>(&address), length) == 0);
  }
  std::string take() {
    std::array<char, 256> text = {};
    const ssize_t got = ::recv(socket_.number(), text.data(), text.size(), MSG_DONTWAIT);
    return got < 0 ? std::string() : std::string(text.data(), static_cast<std::size_t>(got));
  }

 private:
  posix::Descriptor socket_;
};

/// The variables that a service manager sets, as long as it lives.
class Variables {
 public:
  Variables(const char* socket, const char* period, const char* pid) {
    set("NOTIFY_SOCKET", socket);
    set("WATCHDOG_USEC", period);
    set("WATCHDOG_PID", pid);
  }
  Variables(const Variables&) = delete;
  Variables& operator=(const Variables&) = delete;
  ~Variables() {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) ::unsetenv(name);
  }

 private:
  static void set(const char* name, const char* value) {
    if (value != nullptr) ::setenv(name, value, 1);
  }
};

}  // namespace

TEST_CASE("service manager: without its variables it is none") {
  const Variables none(nullptr, nullptr, nullptr);
  const ServiceManager manager = posix::take_service_manager();
  CHECK_FALSE(manager.notify);
  CHECK_FALSE(manager.watchdog);
}

TEST_CASE("service manager: a state arrives as one datagram, at a path and at a name") {
  const test::TemporaryFolder folder;
  const std::string own = std::to_string(::getpid());
  for (const std::string& name : {folder.path() + "/notify", "@spindle-service-test-" + own}) {
    CAPTURE(name);
    Listener listener(name);
    const Variables variables(name.c_str(), "30000000", own.c_str());
    const ServiceManager manager = posix::take_service_manager();
    REQUIRE(manager.notify);
    CHECK(manager.watchdog == Duration(30s));
    manager.notify("READY=1");
    manager.notify("STATUS=fine");
    CHECK(listener.take() == "READY=1");
    CHECK(listener.take() == "STATUS=fine");
    CHECK(listener.take().empty());
  }
}

TEST_CASE("service manager: a child is not the service") {
  const Variables variables("/nowhere/notify", "1000", nullptr);
  const ServiceManager manager = posix::take_service_manager();
  CHECK(manager.watchdog == Duration(1ms));
  for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) {
    CHECK(::getenv(name) == nullptr);
  }
  manager.notify("READY=1");  // none listens there, and that is no trouble of ours
}

TEST_CASE("service manager: what is meant for others, or makes no sense, is nothing") {
  struct Row {
    const char* socket;
    const char* period;
    const char* pid;
    bool notifies;
  };
  const Row rows[] = {{"/nowhere/notify", "1000", "1", true},
                      {"/nowhere/notify", "0", nullptr, true},
                      {"/nowhere/notify", "soon", nullptr, true},
                      {"/nowhere/notify", "10 ", nullptr, true},
                      {"/nowhere/notify", nullptr, nullptr, true},
                      {"relative", "1000", nullptr, false},
                      {"@", "1000", nullptr, false},
                      {"vsock:2:1234", "1000", nullptr, false},
                      {"", "1000", nullptr, false}};
  for (const Row& row : rows) {
    CAPTURE(row.socket);
    CAPTURE(row.period);
    const Variables variables(row.socket, row.period, row.pid);
    const ServiceManager manager = posix::take_service_manager();
    CHECK(static_cast<bool>(manager.notify) == row.notifies);
    CHECK_FALSE(manager.watchdog);
  }
  const std::string too_long = "/" + std::string(200, 'x');
  const Variables variables(too_long.c_str(), "1000", nullptr);
  CHECK_FALSE(posix::take_service_manager().notify);
}
