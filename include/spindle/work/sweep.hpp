#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "spindle/base/ipv4.hpp"
#include "spindle/work/identification.hpp"
#include "spindle/work/target.hpp"

namespace spindle::work {

/// A network whose addresses are tried one by one.
struct SweepPlan {
  Ipv4Network network = {};
  std::vector<std::uint16_t> ports = {};
  std::vector<modbus::UnitId> units = {};  ///< to be asked at each port; none: as a tool is asked
  unsigned rate = 50;                      ///< connections that are begun in a second
};

/// "192.168.10.0/24", or one address. Errors `usage`: no network, more than a /16, or addresses
/// that no tool has.
Result<Ipv4Network> parse_sweep(const std::string& text);

/// What answered at one port.
struct SweptTool {
  Target target;
  std::string address;
  std::uint16_t port = 0;
  std::optional<modbus::UnitId> unit = std::nullopt;  ///< empty: it was not named
  /// Empty: it speaks Modbus, and does not say what it is.
  std::optional<Identification> identification = std::nullopt;
};

struct SweepResult {
  std::size_t addresses = 0;  ///< of the network
  std::size_t asked = 0;      ///< of them, all ports
  std::size_t found = 0;
  std::size_t open = 0;  ///< ports that take connections and do not speak Modbus
  std::optional<Error> error = std::nullopt;  ///< why it ended before all were asked
};

/// Tries every address. Sends nothing but "report server id" (FC 11h), once to each unit. `tell`
/// and `progress` are called by one thread at a time.
SweepResult sweep_network(const SweepPlan& plan, const Environment& environment,
                          const std::function<void(const SweptTool&)>& tell,
                          const link::Progress& progress = {});

}  // namespace spindle::work
