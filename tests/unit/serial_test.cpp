#include "spindle/posix/serial.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <pty.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <string>
#include <thread>

#include "loopback.hpp"
#include "spindle/posix/clock.hpp"
#include "unit/hex.hpp"

using namespace spindle;
using namespace spindle::posix;
using namespace std::chrono_literals;
using link::LineSwitching;
using modbus::Parity;
using modbus::SerialSettings;
using spindle::test::hex;
using spindle::test::WakingInterrupt;

namespace {

/// A pseudo terminal; the test holds the far end.
struct Pty {
  Pty() {
    int far_end = -1;
    int near_end = -1;
    std::array<char, 64> name = {};
    REQUIRE(::openpty(&far_end, &near_end, name.data(), nullptr, nullptr) == 0);
    far = Descriptor(far_end);
    near = Descriptor(near_end);
    path = name.data();
  }

  [[nodiscard]] termios settings() const {
    termios found = {};
    ::tcgetattr(far.number(), &found);
    return found;
  }
  void say(const Bytes& bytes) const {
    CHECK(::write(far.number(), bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()));
  }
  [[nodiscard]] Bytes hear() const {
    std::array<std::uint8_t, 512> bytes = {};
    const ssize_t count = ::read(far.number(), bytes.data(), bytes.size());
    return {bytes.begin(), bytes.begin() + std::max<ssize_t>(count, 0)};
  }

  Descriptor far;
  Descriptor near;  ///< keeps the terminal alive while no other program has it open
  std::string path;
};

struct Room {
  auto open(const std::string& path, const SerialSettings& settings = {},
            LineSwitching switching = LineSwitching::adapter) {
    return open_serial(path, settings, switching, clock, interrupt.get());
  }

  WakingInterrupt interrupt;
  SteadyClock clock{interrupt.get()};
};

Result<Bytes> receive(link::Transport& transport, TimePoint deadline) {
  std::array<std::uint8_t, 512> bytes = {};
  return transport.receive(bytes, deadline).map([&](std::size_t count) {
    return Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
  });
}

/// A deadline so far off that what ends before it did not wait for it.
constexpr Duration never_waited_out = 1h;

}  // namespace

TEST_CASE("serial: bytes go both ways, every value of them") {
  Room room;
  const Pty pty;
  auto line = room.open(pty.path);
  REQUIRE_MESSAGE(line, describe(line.error()));
  Bytes all;
  for (int byte = 0; byte < 256; ++byte) all.push_back(static_cast<std::uint8_t>(byte));
  REQUIRE((*line)->send(all, room.clock.now() + 1s));
  CHECK(pty.hear() == all);
  pty.say(all);
  Bytes got;
  while (got.size() < all.size()) {
    auto more = receive(**line, room.clock.now() + 1s);
    REQUIRE(more);
    REQUIRE_FALSE(more->empty());
    got.insert(got.end(), more->begin(), more->end());
  }
  CHECK(got == all);
}

TEST_CASE("serial: rate and stop bits are set, and what was there before comes back") {
  Room room;
  const Pty pty;
  termios before = pty.settings();
  ::cfsetspeed(&before, B1200);
  before.c_lflag |= ECHO;
  REQUIRE(::tcsetattr(pty.near.number(), TCSANOW, &before) == 0);
  before = pty.settings();
  for (int turn = 0; turn < 3; ++turn) {
    CAPTURE(turn);
    {
      auto line = room.open(pty.path, {115200, Parity::none, 2});
      REQUIRE_MESSAGE(line, describe(line.error()));
      const termios during = pty.settings();
      CHECK(::cfgetospeed(&during) == B115200);
      CHECK(::cfgetispeed(&during) == B115200);
      CHECK((during.c_cflag & CSIZE) == CS8);
      CHECK((during.c_cflag & CSTOPB) != 0);
      CHECK((during.c_lflag & (ECHO | ICANON | ISIG)) == 0);
      CHECK((during.c_iflag & (IXON | ICRNL | ISTRIP)) == 0);
      CHECK((during.c_oflag & OPOST) == 0);
    }
    const termios after = pty.settings();
    CHECK(::cfgetospeed(&after) == B1200);
    CHECK(after.c_cflag == before.c_cflag);
    CHECK(after.c_lflag == before.c_lflag);
    CHECK(after.c_iflag == before.c_iflag);
    CHECK(after.c_oflag == before.c_oflag);
  }
}

TEST_CASE("serial: a pseudo terminal drops parity, and is opened again and again all the same") {
  for (const Parity parity : {Parity::even, Parity::odd}) {
    Room room;
    const Pty pty;
    for (int turn = 0; turn < 3; ++turn) {
      CAPTURE(turn);
      auto line = room.open(pty.path, {9600, parity, 1});
      REQUIRE_MESSAGE(line, describe(line.error()));
      REQUIRE((*line)->send(hex("01"), room.clock.now() + 1s));
      CHECK(pty.hear() == hex("01"));
    }
    // As a killed process leaves it: set already, so that setting it again changes nothing.
    termios left = pty.settings();
    ::cfmakeraw(&left);
    ::cfsetspeed(&left, B9600);
    left.c_cflag |= CREAD | CLOCAL | CS8;
    left.c_iflag |= INPCK;
    left.c_cc[VMIN] = 0;
    left.c_cc[VTIME] = 0;
    ::tcsetattr(pty.near.number(), TCSANOW, &left);
    CHECK(room.open(pty.path, {9600, parity, 1}));
  }
}

TEST_CASE("serial: a rate that has no name is an error, never another rate") {
  Room room;
  const Pty pty;
  const termios before = pty.settings();
  for (const unsigned baud : {1U, 14400U, 28800U, 76800U, 250000U, 9601U}) {
    CAPTURE(baud);
    const auto line = room.open(pty.path, {baud, Parity::none, 1});
    REQUIRE_FALSE(line);
    CHECK(line.error().code == Errc::port_unusable);
    CHECK(message_of(line.error()) ==
          "the serial port does not do " + std::to_string(baud) + " baud");
    const termios after = pty.settings();
    CHECK(::cfgetospeed(&after) == ::cfgetospeed(&before));
  }
}

TEST_CASE("serial: every cause of a port that cannot be opened is told apart") {
  Room room;
  struct Row {
    std::string path;
    Errc code;
    std::string message;
  };
  const std::string folder = std::filesystem::temp_directory_path();
  const std::string file = folder + "/spindle-serial-test-" + std::to_string(::getpid());
  Descriptor plain(::open(file.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, S_IRUSR | S_IWUSR));
  REQUIRE(plain.valid());
  for (const Row& row :
       {Row{"/dev/no-such-port", Errc::port_missing, "there is no /dev/no-such-port"},
        Row{file + "/x", Errc::port_missing, "there is no " + file + "/x"},
        Row{folder, Errc::port_unusable, folder + " is not a serial port"},
        Row{file, Errc::port_unusable, file + " is not a serial port"},
        Row{"/dev/null", Errc::port_unusable, "/dev/null is not a serial port"}}) {
    const auto line = room.open(row.path);
    REQUIRE_FALSE(line);
    CHECK(line.error().code == row.code);
    CHECK(message_of(line.error()) == row.message);
  }
  if (::geteuid() != 0) {  // root may open everything
    ::chmod(file.c_str(), 0);
    const auto line = room.open(file);
    REQUIRE_FALSE(line);
    CHECK(line.error().code == Errc::port_unusable);
    CHECK(message_of(line.error()) == "no permission to open " + file);
    CHECK(line.error().hint.find("dialout") != std::string::npos);
  }
  std::filesystem::remove(file);
}

TEST_CASE("serial: a port is opened once, its settings are left alone, and its holder is named") {
  Room room;
  const Pty pty;
  auto first = room.open(pty.path, {115200, Parity::none, 1});
  REQUIRE(first);
  const auto second = room.open(pty.path, {9600, Parity::none, 1});
  REQUIRE_FALSE(second);
  CHECK(second.error().code == Errc::port_busy);
  CHECK(message_of(second.error()) == "the serial port is in use by this program itself");
  const termios during = pty.settings();
  CHECK(::cfgetospeed(&during) == B115200);
  first->reset();
  CHECK(room.open(pty.path, {9600, Parity::none, 1}));

  // Another program's lock, whatever it is.
  Descriptor other(::open(pty.path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  REQUIRE(::flock(other.number(), LOCK_EX) == 0);
  CHECK(room.open(pty.path).error().code == Errc::port_busy);
  other.close();
  CHECK(room.open(pty.path));
}

TEST_CASE("serial: a port without RS-485 mode says so") {
  Room room;
  const Pty pty;
  const auto line = room.open(pty.path, {}, LineSwitching::kernel);
  REQUIRE_FALSE(line);
  CHECK(line.error().code == Errc::port_unusable);
  CHECK(message_of(line.error()) == "the serial port has no RS-485 mode");
  CHECK(room.open(pty.path));  // and lets the port go
}

TEST_CASE("serial: receive waits until the deadline, and gives what is there even behind it") {
  Room room;
  const Pty pty;
  auto line = room.open(pty.path);
  REQUIRE(line);
  const TimePoint began = room.clock.now();
  CHECK(receive(**line, began + 30ms) == Bytes());
  CHECK(room.clock.now() - began >= 30ms);
  pty.say(hex("01 02 03"));
  CHECK(receive(**line, began) == hex("01 02 03"));
}

TEST_CASE("serial: an interrupt ends a wait at once, and a shield lets the last words out") {
  Room room;
  const Pty pty;
  auto line = room.open(pty.path);
  REQUIRE(line);
  const TimePoint began = room.clock.now();
  {
    const std::jthread hand([&room] {
      CHECK(room.clock.sleep_until(room.clock.now() + 20ms));
      room.interrupt.raise(2);
    });
    CHECK(receive(**line, began + never_waited_out).error().code == Errc::interrupted);
  }
  CHECK((*line)->send(hex("01"), began + never_waited_out).error().code == Errc::interrupted);
  (*line)->set_uninterruptible();
  CHECK((*line)->send(hex("02"), began + never_waited_out));
  CHECK(pty.hear() == hex("02"));
  pty.say(hex("03"));
  CHECK(receive(**line, room.clock.now() + never_waited_out) == hex("03"));
}

TEST_CASE("serial: an adapter that is pulled out is an error in every direction") {
  for (const bool waiting : {false, true}) {
    CAPTURE(waiting);
    Room room;
    Pty pty;
    auto line = room.open(pty.path);
    REQUIRE(line);
    pty.near.close();
    const TimePoint began = room.clock.now();
    std::jthread hand;
    if (waiting) {
      hand = std::jthread([&] {
        CHECK(room.clock.sleep_until(began + 20ms));
        pty.far.close();
      });
    } else {
      pty.far.close();
    }
    const auto received = receive(**line, began + never_waited_out);
    REQUIRE_FALSE(received);
    CHECK(received.error().code == Errc::reset);
    CHECK(message_of(received.error()) == "the serial port is gone (Input/output error)");
    CHECK((*line)->send(hex("01"), room.clock.now() + never_waited_out).error().code ==
          Errc::reset);
  }
}

TEST_CASE("serial: a port whose far end takes nothing is no answer, at the deadline") {
  Room room;
  const Pty pty;
  auto line = room.open(pty.path);
  REQUIRE(line);
  const TimePoint began = room.clock.now();
  const Bytes much(std::size_t{1} << 20U, 0x55);
  const auto sent = (*line)->send(much, began + 50ms);
  REQUIRE_FALSE(sent);
  CHECK(sent.error().code == Errc::no_answer);
}
