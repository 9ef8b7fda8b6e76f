#pragma once

#include "spindle/base/bytes.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/sim/simulated_tool.hpp"

namespace spindle::sim {

/// The device-specific bytes of a simulated tool's answer to FC 11h: those of the start state, cut
/// or padded to the length asked for, with the options' numbers in the places that the profile
/// names. The start state has its serial number in the form of its usual length; another length
/// gets the same serial in its own form.
Bytes make_identity(const std::optional<catalogue::IdentitySpec>& facts,
                    const catalogue::SimulationSpec& start, const DeviceOptions& options);

/// The firmware that this identity says; 0 where it says none.
unsigned firmware_of(const std::optional<catalogue::IdentitySpec>& facts,
                     const catalogue::SimulationSpec& start, const DeviceOptions& options);

}  // namespace spindle::sim
