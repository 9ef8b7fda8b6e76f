#include "register_bank.hpp"

#include <algorithm>
#include <array>
#include <iterator>

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
                           const catalogue::SimulationSpec& start) {
  named_.reserve(profile.parameters.size());
  for (const catalogue::Parameter& parameter : profile.parameters) add_parameter(parameter);
  std::sort(named_.begin(), named_.end(),
            [](const Named& a, const Named& b) { return a.name < b.name; });
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
  for (; registers.size() < count; ++address) {
    const auto narrow = static_cast<std::uint16_t>(address);
    if (narrow != address || !all.has(narrow)) return std::nullopt;
    registers.push_back(all.at(narrow));
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
  holding_.put_if_there(address, value);
}

std::uint16_t RegisterBank::get(std::string_view name) const {
  const auto place = find(name);
  if (!place) return 0;
  const Words& all = words(place->table);
  return all.has(place->address) ? all.at(place->address) : std::uint16_t{0};
}

void RegisterBank::set(std::string_view name, std::uint16_t value) {
  if (const auto place = find(name)) words(place->table).put_if_there(place->address, value);
}

void RegisterBank::set_raw(std::string_view name, std::int64_t raw) {
  if (const auto place = find(name)) start_value(*place, raw);
}

std::optional<std::pair<RegisterTable, std::uint16_t>> RegisterBank::place_of(
    std::string_view name) const {
  const auto place = find(name);
  if (!place) return std::nullopt;
  return std::pair(place->table, place->address);
}

std::optional<RegisterBank::Place> RegisterBank::find(std::string_view name) const {
  const auto named = std::lower_bound(
      named_.begin(), named_.end(), name,
      [](const Named& entry, std::string_view wanted) { return entry.name < wanted; });
  if (named != named_.end() && named->name == name) return named->place;
  if (!numbered_ || !name.starts_with(numbered_->prefix)) return std::nullopt;
  const std::string_view digits = name.substr(numbered_->prefix.size());
  const auto number = parse_unsigned(digits, numbered_->to);
  const bool is_one =
      number && *number >= numbered_->from && (digits.size() == 1 || digits[0] != '0');
  if (!is_one) return std::nullopt;
  return Place{numbered_->table, static_cast<std::uint16_t>(*number), Kind::u16};
}

void RegisterBank::Words::put(std::uint16_t address, std::uint16_t word) {
  if (address >= words_.size()) {
    // In steps, as profiles name registers in rising order.
    constexpr std::size_t step = 1024;
    const std::size_t size = (std::size_t{address} / step + 1) * step;
    words_.resize(size);
    there_.resize(size);
  }
  words_[address] = word;
  there_[address] = true;
}

const RegisterBank::Words& RegisterBank::words(RegisterTable table) const {
  return table == RegisterTable::holding ? holding_ : input_;
}

RegisterBank::Words& RegisterBank::words(RegisterTable table) {
  return table == RegisterTable::holding ? holding_ : input_;
}

void RegisterBank::add_parameter(const catalogue::Parameter& parameter) {
  const Place place{parameter.table, parameter.address.value, parameter.encoding.kind};
  named_.push_back({parameter.name, place});
  const Kind kind = word_kind(place.kind);
  for (std::uint16_t i = 0; i < catalogue::register_count(place.kind); ++i) {
    const auto address = static_cast<std::uint16_t>(place.address + i);
    words(place.table).put(address, 0);
    if (parameter.table == RegisterTable::holding && parameter.access == Access::read_write) {
      writable_[address] = {catalogue::lowest(kind), catalogue::highest(kind), kind};
    }
  }
}

// A register that has a name already keeps what its name says of it.
void RegisterBank::add_numbered(const catalogue::NumberedSpec& facts) {
  numbered_ = facts;
  for (std::uint32_t number = facts.from; number <= facts.to; ++number) {
    const auto address = static_cast<std::uint16_t>(number);
    words(facts.table).put_if_absent(address, 0);
    if (facts.table == RegisterTable::holding && facts.access == Access::read_write) {
      writable_.try_emplace(
          address, Limits{catalogue::lowest(Kind::u16), catalogue::highest(Kind::u16), Kind::u16});
    }
  }
}

void RegisterBank::add_event_block(const catalogue::EventSpec& facts) {
  for (std::uint16_t i = 0; i < facts.count; ++i) {
    const auto address = static_cast<std::uint16_t>(facts.first + i);
    words(catalogue::table_of(facts)).put_if_absent(address, 0);
  }
}

std::vector<RegisterBank::Place> RegisterBank::matching(std::string_view pattern) const {
  const std::string_view head = pattern.substr(0, pattern.find_first_of("*?["));
  std::vector<Place> found;
  if (head == pattern) {
    if (const auto place = find(pattern)) found.push_back(*place);
    return found;
  }
  auto named = std::lower_bound(
      named_.begin(), named_.end(), head,
      [](const Named& entry, std::string_view wanted) { return entry.name < wanted; });
  for (; named != named_.end() && named->name.starts_with(head); ++named) {
    if (glob_match(pattern, named->name)) found.push_back(named->place);
  }
  add_numbered_matching(pattern, found);
  return found;
}

void RegisterBank::add_numbered_matching(std::string_view pattern,
                                         std::vector<Place>& found) const {
  if (!numbered_) return;
  const std::string_view head = pattern.substr(0, pattern.find_first_of("*?["));
  const std::string_view prefix = numbered_->prefix;
  const std::size_t common = std::min(head.size(), prefix.size());
  const bool may_match = head.substr(0, common) == prefix.substr(0, common) &&
                         head.find_first_not_of("0123456789", common) == std::string_view::npos;
  if (!may_match) return;
  std::string name(prefix);
  for (std::uint32_t number = numbered_->from; number <= numbered_->to; ++number) {
    const auto place = Place{numbered_->table, static_cast<std::uint16_t>(number), Kind::u16};
    name.resize(prefix.size());
    if (glob_match(pattern, name += std::to_string(number))) found.push_back(place);
  }
}

void RegisterBank::start_value(const Place& place, std::int64_t raw) {
  Words& all = words(place.table);
  const std::uint16_t count = catalogue::register_count(place.kind);
  for (std::uint16_t i = 0; i < count; ++i) {
    const unsigned shift = 16U * (count - 1U - i);
    all.put(static_cast<std::uint16_t>(place.address + i), low_word(raw >> shift));
  }
}

void RegisterBank::start_limits(const Place& place, std::int64_t minimum, std::int64_t maximum) {
  if (place.table != RegisterTable::holding) return;
  const auto found = writable_.find(place.address);
  if (found == writable_.end()) return;
  found->second.minimum = minimum;
  found->second.maximum = maximum;
}

void RegisterBank::add_mirrors(const catalogue::LimitSpec& facts) {
  for (std::uint32_t number = facts.from; number <= facts.to; ++number) {
    const auto found = writable_.find(static_cast<std::uint16_t>(number));
    if (found == writable_.end()) continue;
    const Limits& limits = found->second;
    holding_.put(static_cast<std::uint16_t>(number + facts.minimum_offset),
                 low_word(limits.minimum));
    holding_.put(static_cast<std::uint16_t>(number + facts.maximum_offset),
                 low_word(limits.maximum));
  }
}

void RegisterBank::remove(const catalogue::Area& area,
                          const std::optional<catalogue::LimitSpec>& limits) {
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
