#include "spindle/catalogue/register_sets.hpp"

namespace spindle::catalogue {
namespace {

void add(Addresses& addresses, std::uint32_t first, std::uint32_t end) {
  for (std::uint32_t at = first; at < end; ++at) addresses.insert(static_cast<std::uint16_t>(at));
}

template <typename Select>
Addresses registers_of(const Profile& profile, modbus::RegisterTable table, Select select) {
  Addresses addresses;
  for (const Parameter& parameter : profile.parameters) {
    if (parameter.table != table || !select(parameter)) continue;
    const std::uint32_t first = parameter.address.value;
    add(addresses, first, first + register_count(parameter.encoding));
  }
  return addresses;
}

}  // namespace

Addresses consumed_registers(const Profile& profile, modbus::RegisterTable table) {
  return registers_of(profile, table, [](const Parameter& parameter) {
    return parameter.reading == Reading::consumes;
  });
}

Addresses secret_registers(const Profile& profile, modbus::RegisterTable table) {
  return registers_of(profile, table, [](const Parameter& parameter) {
    return parameter.secrecy == Secrecy::secret;
  });
}

Addresses known_registers(const Profile& profile, modbus::RegisterTable table) {
  Addresses addresses = registers_of(profile, table, [&](const Parameter& parameter) {
    return !profile.events || profile.events->form_of(parameter) == nullptr;
  });
  if (profile.numbered && profile.numbered->table == table) {
    add(addresses, profile.numbered->from, std::uint32_t{profile.numbered->to} + 1);
  }
  for (const Area& area : profile.link.contiguous) {
    if (area.table == table) add(addresses, area.from, std::uint32_t{area.to} + 1);
  }
  return addresses;
}

}  // namespace spindle::catalogue
