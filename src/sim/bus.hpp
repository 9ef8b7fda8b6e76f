#pragma once

#include <functional>
#include <memory>

#include "unit.hpp"

namespace spindle::sim {

using MakeUnit = std::function<std::unique_ptr<Unit>(std::uint8_t address)>;

/// What several units are together. `make` is called once for each.
std::unique_ptr<SimulatedBus> make_bus(const catalogue::Profile& profile,
                                       const DeviceOptions& options, const MakeUnit& make);

}  // namespace spindle::sim
