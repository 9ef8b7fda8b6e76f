#pragma once

#include <cstdint>
#include <set>

#include "spindle/catalogue/profile.hpp"

namespace spindle::catalogue {

using Addresses = std::set<std::uint16_t>;

/// The registers of a table that reading clears.
Addresses consumed_registers(const Profile& profile, modbus::RegisterTable table);

/// The registers of a table that are part of a secret.
Addresses secret_registers(const Profile& profile, modbus::RegisterTable table);

/// The registers of a table that the profile speaks of: those of parameters, with or without a
/// name, and those that may be read along.
Addresses known_registers(const Profile& profile, modbus::RegisterTable table);

}  // namespace spindle::catalogue
