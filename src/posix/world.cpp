#include "spindle/posix/world.hpp"

#include <fmt/format.h>
#include <modbus.h>

#include <cstdlib>
#include <filesystem>

#include "posix/owner_transport.hpp"
#include "spindle/posix/serial.hpp"
#include "spindle/posix/tcp.hpp"

namespace spindle::posix {
namespace {

Behind behind(const link::Endpoint& endpoint) {
  if (endpoint.medium != link::Medium::rtu_over_tcp) return Behind::tool;
  return endpoint.claim == link::Claim::beside ? Behind::busy_line : Behind::line;
}

}  // namespace

std::function<Result<std::unique_ptr<link::Transport>>(const link::Endpoint&,
                                                       const catalogue::LinkSpec&, Duration)>
line_opener(Clock& clock, const Interrupt& interrupt) {
  return
      [&clock, &interrupt](const link::Endpoint& endpoint, const catalogue::LinkSpec& facts,
                           Duration connect_timeout) -> Result<std::unique_ptr<link::Transport>> {
        const auto ask = [&](const std::string& name) {
          return ask_owner(name, endpoint.claim, clock, interrupt);
        };
        if (endpoint.medium == link::Medium::serial) {
          if (auto asked = ask(serial_line_name(endpoint.device))) return std::move(*asked);
          return open_serial(endpoint.device, link::serial_settings(endpoint, facts.serial.line),
                             endpoint.switching, clock, interrupt);
        }
        return open_tcp(endpoint.host, endpoint.port.value_or(facts.port), connect_timeout, clock,
                        interrupt, behind(endpoint), ask);
      };
}

std::optional<std::string> environment(std::string_view name) {
  const char* value = std::getenv(std::string(name).c_str());
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

Installation installation() {
  std::error_code failed;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", failed);
  return {.folder = failed ? std::string(".") : program.parent_path().string(),
          .modbus_library = fmt::format("{}.{}.{}", libmodbus_version_major,
                                        libmodbus_version_minor, libmodbus_version_micro)};
}

}  // namespace spindle::posix
