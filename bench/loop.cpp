// Reads registers 2 and 3 many times over one connection: loop spindle|libmodbus PORT [COUNT].
// Prints microseconds a round trip.
#include <modbus.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string_view>
#include <utility>

#include "spindle/base/interrupt.hpp"
#include "spindle/link/client.hpp"
#include "spindle/posix/clock.hpp"
#include "spindle/posix/tcp.hpp"

namespace {

constexpr int default_count = 10'000;

/// One reading; whether it came.
using ReadOnce = std::function<bool()>;

int failed(const char* why) {
  std::fprintf(stderr, "loop: %s\n", why);
  return 1;
}

int measure(const ReadOnce& read_once, int count) {
  const auto begin = std::chrono::steady_clock::now();
  for (int done = 0; done < count; ++done) {
    if (!read_once()) return failed("a reading failed");
  }
  const std::chrono::duration<double, std::micro> taken = std::chrono::steady_clock::now() - begin;
  std::printf("%.2f\n", taken.count() / count);
  return 0;
}

int measure_spindle(std::uint16_t port, int count) {
  using namespace spindle;
  const Interrupt interrupt;
  posix::SteadyClock clock(interrupt);
  auto transport = posix::open_tcp("127.0.0.1", port, std::chrono::seconds(1), clock, interrupt);
  if (!transport) return failed(describe(transport.error()).c_str());
  link::Session session(std::move(*transport), clock, {});
  link::Client client(session, {}, 0);
  return measure(
      [&client] {
        const auto words = client.read({modbus::RegisterTable::holding, 2, 2});
        return words && words->size() == 2;
      },
      count);
}

int measure_libmodbus(std::uint16_t port, int count) {
  const std::unique_ptr<modbus_t, decltype(&modbus_free)> tool(modbus_new_tcp("127.0.0.1", port),
                                                               modbus_free);
  if (!tool || modbus_connect(tool.get()) != 0) return failed(modbus_strerror(errno));
  return measure(
      [&tool] {
        std::uint16_t words[2] = {};
        return modbus_read_registers(tool.get(), 2, 2, words) == 2;
      },
      count);
}

}  // namespace

int main(int count, char** arguments) {
  const std::string_view whose = count > 2 ? arguments[1] : "";
  if (whose != "spindle" && whose != "libmodbus") {
    std::fputs("usage: loop spindle|libmodbus PORT [COUNT]\n", stderr);
    return 2;
  }
  const auto port = static_cast<std::uint16_t>(std::atoi(arguments[2]));
  const int times = count > 3 ? std::atoi(arguments[3]) : default_count;
  return whose == "spindle" ? measure_spindle(port, times) : measure_libmodbus(port, times);
}
