#include "register_bank.hpp"

#include <fmt/format.h>

#include "spindle/base/text.hpp"

namespace spindle::sim {
namespace {

using catalogue::Access;
using catalogue::Kind;
using modbus::RegisterTable;

// Both halves of a 32-bit value take any word; the tool's limits are of 16-bit registers.
Kind word_kind(Kind kind) { return kind == Kind::i16 ? Kind::i16 : Kind::u16; }

std::uint16_t low_word(std::int64_t number) { return static_cast<std::uint16_t>(number & 0xFFFF); }

std::int64_t number_in(std::uint16_t word, Kind kind) {
  return kind == Kind::i16 ? std::int64_t{static_cast<std::int16_t>(word)} : std::int64_t{word};
}

}  // namespace

RegisterBank::RegisterBank(const catalogue::Profile& profile,
                           const catalogue::SimulationFacts& start) {
  for (const catalogue::Parameter& parameter : profile.parameters) add_parameter(parameter);
  if (profile.numbered) add_numbered(*profile.numbered);
  if (profile.events) add_event_block(*profile.events);
  for (const auto& value : start.values) {
    for (const Place& place : matching(value.pattern)) start_value(place, value.raw);
  }
  for (const auto& limits : start.limits) {
    for (const Place& place : matching(limits.pattern)) {
      start_limits(place, limits.minimum, limits.maximum);
    }
  }
  if (profile.limits) add_mirrors(*profile.limits);
  for (const catalogue::Area& area : start.absent) remove(area, profile.limits);
}

std::optional<Registers> RegisterBank::read(RegisterTable table, std::uint16_t first,
                                            std::uint16_t count) const {
  const Words& all = words(table);
  Registers registers;
  std::uint32_t address = first;
  for (auto word = all.find(first); registers.size() < count; ++word, ++address) {
    if (word == all.end() || word->first != address) return std::nullopt;
    registers.push_back(word->second);
  }
  return registers;
}

WriteVerdict RegisterBank::check_write(std::uint16_t address, std::uint16_t value) const {
  const auto found = writable_.find(address);
  if (found == writable_.end()) return WriteVerdict::no_such_register;
  const Limits& limits = found->second;
  const std::int64_t number = number_in(value, limits.kind);
  const bool inside = number >= limits.minimum && number <= limits.maximum;
  return inside ? WriteVerdict::allowed : WriteVerdict::outside_limits;
}

void RegisterBank::store(std::uint16_t address, std::uint16_t value) {
  const auto word = holding_.find(address);
  if (word != holding_.end()) word->second = value;
}

std::uint16_t RegisterBank::get(std::string_view name) const {
  const auto place = places_.find(name);
  if (place == places_.end()) return 0;
  const Words& all = words(place->second.table);
  const auto word = all.find(place->second.address);
  return word == all.end() ? std::uint16_t{0} : word->second;
}

void RegisterBank::set(std::string_view name, std::uint16_t value) {
  const auto place = places_.find(name);
  if (place == places_.end()) return;
  Words& all = words(place->second.table);
  const auto word = all.find(place->second.address);
  if (word != all.end()) word->second = value;
}

void RegisterBank::set_raw(std::string_view name, std::int64_t raw) {
  const auto place = places_.find(name);
  if (place != places_.end()) start_value(place->second, raw);
}

std::optional<std::pair<RegisterTable, std::uint16_t>> RegisterBank::place_of(
    std::string_view name) const {
  const auto place = places_.find(name);
  if (place == places_.end()) return std::nullopt;
  return std::pair(place->second.table, place->second.address);
}

const RegisterBank::Words& RegisterBank::words(RegisterTable table) const {
  return table == RegisterTable::holding ? holding_ : input_;
}

RegisterBank::Words& RegisterBank::words(RegisterTable table) {
  return table == RegisterTable::holding ? holding_ : input_;
}

void RegisterBank::add_parameter(const catalogue::Parameter& parameter) {
  const Place place{parameter.table, parameter.address.value, parameter.encoding.kind};
  places_[parameter.name] = place;
  const Kind kind = word_kind(place.kind);
  for (std::uint16_t i = 0; i < catalogue::register_count(place.kind); ++i) {
    const auto address = static_cast<std::uint16_t>(place.address + i);
    words(place.table)[address] = 0;
    if (parameter.table == RegisterTable::holding && parameter.access == Access::read_write) {
      writable_[address] = {catalogue::lowest(kind), catalogue::highest(kind), kind};
    }
  }
}

// A register that has a name already keeps what its name says of it.
void RegisterBank::add_numbered(const catalogue::NumberedFacts& facts) {
  for (std::uint32_t number = facts.from; number <= facts.to; ++number) {
    const auto address = static_cast<std::uint16_t>(number);
    places_[fmt::format("{}{}", facts.prefix, number)] = {facts.table, address, Kind::u16};
    words(facts.table).try_emplace(address, std::uint16_t{0});
    if (facts.table == RegisterTable::holding && facts.access == Access::read_write) {
      writable_.try_emplace(
          address, Limits{catalogue::lowest(Kind::u16), catalogue::highest(Kind::u16), Kind::u16});
    }
  }
}

void RegisterBank::add_event_block(const catalogue::EventFacts& facts) {
  for (std::uint16_t i = 0; i < facts.count; ++i) {
    const auto address = static_cast<std::uint16_t>(facts.first + i);
    words(catalogue::table_of(facts)).try_emplace(address, std::uint16_t{0});
  }
}

std::vector<RegisterBank::Place> RegisterBank::matching(std::string_view pattern) const {
  std::vector<Place> found;
  for (const auto& [name, place] : places_) {
    if (glob_match(pattern, name)) found.push_back(place);
  }
  return found;
}

void RegisterBank::start_value(const Place& place, std::int64_t raw) {
  Words& all = words(place.table);
  const std::uint16_t count = catalogue::register_count(place.kind);
  for (std::uint16_t i = 0; i < count; ++i) {
    const unsigned shift = 16U * (count - 1U - i);
    all[static_cast<std::uint16_t>(place.address + i)] = low_word(raw >> shift);
  }
}

void RegisterBank::start_limits(const Place& place, std::int64_t minimum, std::int64_t maximum) {
  if (place.table != RegisterTable::holding) return;
  const auto found = writable_.find(place.address);
  if (found == writable_.end()) return;
  found->second.minimum = minimum;
  found->second.maximum = maximum;
}

void RegisterBank::add_mirrors(const catalogue::LimitFacts& facts) {
  for (std::uint32_t number = facts.from; number <= facts.to; ++number) {
    const auto found = writable_.find(static_cast<std::uint16_t>(number));
    if (found == writable_.end()) continue;
    const Limits& limits = found->second;
    holding_[static_cast<std::uint16_t>(number + facts.minimum_offset)] = low_word(limits.minimum);
    holding_[static_cast<std::uint16_t>(number + facts.maximum_offset)] = low_word(limits.maximum);
  }
}

void RegisterBank::remove(const catalogue::Area& area,
                          const std::optional<catalogue::LimitFacts>& limits) {
  for (std::uint32_t number = area.from; number <= area.to; ++number) {
    const auto address = static_cast<std::uint16_t>(number);
    words(area.table).erase(address);
    if (area.table != RegisterTable::holding || writable_.erase(address) == 0) continue;
    if (!limits || address < limits->from || address > limits->to) continue;
    holding_.erase(static_cast<std::uint16_t>(number + limits->minimum_offset));
    holding_.erase(static_cast<std::uint16_t>(number + limits->maximum_offset));
  }
}

}  // namespace spindle::sim
