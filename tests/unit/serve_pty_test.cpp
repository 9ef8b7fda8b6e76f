// A simulated tool on a pseudo terminal, reached by the serial transport under test.
#include <doctest/doctest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <optional>
#include <string>
#include <thread>

#include "loopback.hpp"
#include "spindle/link/session.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/posix/clock.hpp"
#include "spindle/posix/serial.hpp"
#include "spindle/posix/serve.hpp"
#include "support/serial_bank.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using posix::ServeOptions;
using spindle::test::SerialBank;

namespace {

namespace fs = std::filesystem;
constexpr Duration patience = 5s;

std::string scratch_path(const std::string& name) {
  return fs::temp_directory_path() / ("spindle-" + name + "-" + std::to_string(::getpid()));
}

// A bus that is served in a thread of its own until the test ends.
class Served {
 public:
  explicit Served(ServeOptions options = {}) {
    options.framing = modbus::Framing::rtu;
    options.pty = path;
    std::promise<void> listening;
    options.listening = [&listening](std::uint16_t port) -> Result<void> {
      CHECK(port == 0);
      listening.set_value();
      return {};
    };
    auto known = listening.get_future();
    thread_ = std::thread([this, served = options] {
      outcome_ = posix::serve_pty(bank, served, clock_, stop_.get());
    });
    REQUIRE(known.wait_for(patience) == std::future_status::ready);
  }
  ~Served() { stop(); }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;

  Result<void> stop() {
    stop_.raise(2);
    join();
    return outcome_;
  }
  void join() {
    if (thread_.joinable()) thread_.join();
  }

  std::string path = scratch_path("pty");
  SerialBank bank{{.units = {{1}}, .gap = 5500us, .delay = 1ms}};

 private:
  test::WakingInterrupt stop_;
  posix::SteadyClock clock_{stop_.get()};
  Result<void> outcome_ = {};
  std::thread thread_;
};

struct Client {
  explicit Client(const std::string& path, unsigned baud = 9600)
      : opened(
            posix::open_serial(path, {.baud = baud}, link::LineSwitching::adapter, clock, never)) {
    REQUIRE_MESSAGE(opened, describe(opened.error()));
    session.emplace(
        std::move(*opened), clock,
        link::SessionOptions{.rules = {.framing = modbus::Framing::rtu, .spontaneous = {}},
                             .unit = {1},
                             .answer_timeout = 200ms,
                             .gap = 5500us,
                             .in_use_until = clock.now()});
  }
  Result<modbus::Pdu> read(std::uint16_t address) {
    return session->transact(modbus::read_request(modbus::RegisterTable::holding, {address}, 1));
  }

  const Interrupt never;
  posix::SteadyClock clock{never};
  Result<std::unique_ptr<link::Transport>> opened;
  std::optional<link::Session> session;
};

}  // namespace

TEST_CASE("pty: one client after the other is answered, and the path is gone at the end") {
  std::string path;
  {
    Served served;
    path = served.path;
    CHECK(fs::is_symlink(path));
    for (std::uint16_t turn = 0; turn < 3; ++turn) {
      Client client(path);
      for (std::uint16_t address = 0; address < 5; ++address) {
        const auto answer = client.read(address);
        REQUIRE_MESSAGE(answer, describe(answer.error()));
        CHECK(modbus::registers_of(*answer) == Registers{address});
      }
    }
    CHECK(served.stop());
    CHECK(served.bank.queries == 15);
    CHECK(served.bank.bad_frames == 0);
  }
  CHECK_FALSE(fs::exists(fs::symlink_status(path)));
}

TEST_CASE("pty: a client at another rate is noise") {
  Served served({.baud = 9600});
  {
    Client wrong(served.path, 115200);
    CHECK(wrong.read(7).error().code == Errc::no_answer);
  }
  {
    Client right(served.path, 9600);
    CHECK(right.read(7));
  }
  CHECK(served.stop());
  CHECK(served.bank.bad_frames == 1);
}

TEST_CASE("pty: what exists is never touched") {
  const std::string path = scratch_path("taken");
  const auto serve = [&path](unsigned baud) {
    SerialBank bank({});
    test::WakingInterrupt stop;
    stop.raise(2);  // should it serve after all, the test fails instead of hanging
    const posix::SteadyClock clock(stop.get());
    return posix::serve_pty(bank, {.framing = modbus::Framing::rtu, .pty = path, .baud = baud},
                            clock, stop.get());
  };
  std::ofstream(path) << "mine";
  const auto file = serve(9600);
  REQUIRE_FALSE(file);
  CHECK(file.error().code == Errc::port_busy);
  CHECK(message_of(file.error()) == path + " exists already");
  CHECK(fs::file_size(path) == 4);
  fs::remove(path);

  fs::create_symlink("/nowhere", path);
  CHECK(serve(9600).error().code == Errc::port_busy);
  CHECK(fs::read_symlink(path) == "/nowhere");
  fs::remove(path);

  CHECK(serve(14400).error().code == Errc::port_unusable);
  CHECK(serve(9600));
  CHECK_FALSE(fs::exists(fs::symlink_status(path)));
}

TEST_CASE("pty: a link that another program has put in its place stays") {
  Served served;
  fs::remove(served.path);
  fs::create_symlink("/nowhere", served.path);
  CHECK(served.stop());
  CHECK(fs::read_symlink(served.path) == "/nowhere");
  fs::remove(served.path);
}

TEST_CASE("pty: a line that is cut ends the service and the client's waiting") {
  Served served({.faults = {{.kind = sim::FaultKind::close, .at = 2}}});
  Client client(served.path);
  CHECK(client.read(7));
  const auto cut = client.read(7);
  REQUIRE_FALSE(cut);
  CHECK(cut.error().code == Errc::reset);
  served.join();  // by itself
  CHECK_FALSE(fs::exists(fs::symlink_status(served.path)));
}
