#include "register_bank.hpp"

#include <algorithm>
#include <iterator>

#include "spindle/base/text.hpp"

namespace spindle::sim {
namespace {

using catalogue::Access;
using catalogue::Kind;
using modbus::RegisterTable;

constexpr std::string_view commands_prefix = "command.";
constexpr std::string_view pattern_characters = "*?[";
constexpr Duration longest = std::chrono::hours(24);

std::int64_t number_in(std::uint32_t raw, Kind kind) {
  switch (kind) {
    case Kind::i16:
      return static_cast<std::int16_t>(raw & 0xFFFFU);
    case Kind::i32:
      return static_cast<std::int32_t>(raw);
    case Kind::u16:
      return raw & 0xFFFFU;
    case Kind::u32:
      break;
  }
  return raw;
}

std::uint16_t low_word(std::int64_t number) { return static_cast<std::uint16_t>(number & 0xFFFF); }

std::optional<std::int64_t> steps_of(const std::optional<Decimal>& value, const Decimal& scale) {
  return value ? value->divided_by(scale) : std::nullopt;
}

/// The range of a parameter, or of its labels where it has none.
void limit_to_range(const catalogue::Parameter& parameter, Cell& cell) {
  const Decimal& scale = parameter.encoding.scale;
  cell.minimum = steps_of(parameter.range.minimum, scale);
  cell.maximum = steps_of(parameter.range.maximum, scale);
  if (parameter.except) {
    cell.except = {steps_of(parameter.except->minimum, scale).value_or(0),
                   steps_of(parameter.except->maximum, scale).value_or(0)};
  }
  if (parameter.labels.empty() || cell.minimum || cell.maximum) return;
  const auto [low, high] =
      std::minmax_element(parameter.labels.begin(), parameter.labels.end(),
                          [](const auto& a, const auto& b) { return a.number < b.number; });
  cell.minimum = low->number;
  cell.maximum = high->number;
}

void limit_to_values(const catalogue::Action& action, Cell& cell) {
  std::int64_t low = action.value.value_or(action.minimum);
  std::int64_t high = action.value.value_or(action.maximum);
  const auto widen = [&](std::int64_t value) {
    low = std::min(low, value);
    high = std::max(high, value);
  };
  if (action.rest) widen(*action.rest);
  if (action.stop_value) widen(*action.stop_value);
  for (const catalogue::Label& label : action.labels) widen(label.number);
  cell.minimum = low;
  cell.maximum = high;
}

void put_raw(Words& words, const Place& place, std::uint32_t raw) {
  auto address = place.address;
  if (catalogue::register_count(place.kind) == 2) words.put(address++, low_word(raw >> 16U));
  words.put(address, low_word(raw));
}

std::uint32_t raw_in(const Words& words, const Place& place) {
  if (catalogue::register_count(place.kind) == 1) return words.at(place.address);
  const auto next = static_cast<std::uint16_t>(place.address + 1U);
  return (std::uint32_t{words.at(place.address)} << 16U) | words.at(next);
}

}  // namespace

void Words::add(std::uint16_t address) {
  if (has(address)) return;
  if (address >= words_.size()) {
    // In steps, as profiles name registers in rising order.
    constexpr std::size_t step = 1024;
    const std::size_t size = (std::size_t{address} / step + 1) * step;
    words_.resize(size);
    there_.resize(size);
  }
  there_[address] = true;
}

bool Cell::takes(std::uint32_t raw) const {
  const std::int64_t number = number_in(raw, place.kind);
  if (except && number >= except->first && number <= except->second) return false;
  return !(minimum && number < *minimum) && !(maximum && number > *maximum);
}

// ---- layout ----

RegisterBank::RegisterBank(const catalogue::Profile& profile,
                           const catalogue::SimulationSpec& start, Commands commands) {
  named_.reserve(profile.parameters.size());
  for (const catalogue::Parameter& parameter : profile.parameters) {
    add_parameter(parameter, profile.commands_motion(parameter));
  }
  std::sort(named_.begin(), named_.end(),
            [](const Named& a, const Named& b) { return a.name < b.name; });
  for (const catalogue::Action& action : profile.actions) {
    add_command(action, profile.link.even_pairs, commands);
  }
  if (profile.numbered) add_numbered(*profile.numbered);
  if (profile.events) add_events(*profile.events);
  for (const auto& value : start.values) {
    for (const Place& place : matching(value.pattern)) {
      set_raw(place, static_cast<std::uint32_t>(value.raw));
    }
  }
  for (const auto& limits : start.limits) {
    for (const Place& place : matching(limits.pattern)) {
      limit(place, limits.minimum, limits.maximum);
    }
  }
  if (profile.limits) add_mirrors(*profile.limits);
  for (const catalogue::Area& area : start.absent) remove(area, profile.limits);
}

void RegisterBank::add_registers(const Place& place) {
  for (unsigned address = place.address; address < place.end(); ++address) {
    tables_.of(place.table).add(static_cast<std::uint16_t>(address));
  }
}

void RegisterBank::add_parameter(const catalogue::Parameter& parameter, bool is_command) {
  const catalogue::Encoding& encoding = parameter.encoding;
  const Place place{parameter.table, parameter.address.value, encoding.kind, encoding.scale};
  named_.push_back({parameter.name, place});
  add_registers(place);
  Cell cell{.place = place, .writable = parameter.access == Access::read_write};
  cell.is_parameter = cell.writable && !is_command && !parameter.name.starts_with(commands_prefix);
  limit_to_range(parameter, cell);
  // No command is given at first, and what a device measures begins at 0.
  const auto least = cell.is_parameter ? cell.minimum.value_or(0) : 0;
  const auto value = steps_of(parameter.default_value, encoding.scale);
  if (!cell.writable || cell.is_parameter) {
    set_raw(place, static_cast<std::uint32_t>(value.value_or(least)));
  }
  add(cell);
}

// A register that has a name already keeps what its name says of it.
void RegisterBank::add_numbered(const catalogue::NumberedSpec& facts) {
  numbered_ = facts;
  for (std::uint32_t number = facts.from; number <= facts.to; ++number) {
    const Place place{facts.table, static_cast<std::uint16_t>(number)};
    tables_.of(facts.table).add(place.address);
    const bool is_writable = facts.access == Access::read_write;
    if (known_at(place) != nullptr) continue;
    add({.place = place, .writable = is_writable, .is_parameter = is_writable});
  }
}

// Where values are pairs, the register of an action is the lower of its pair, or it is a pair by
// itself.
void RegisterBank::add_command(const catalogue::Action& action, bool even_pairs,
                               Commands commands) {
  if (action.motion != catalogue::Motion::none) return;
  Cell cell{.place = {.address = action.address.value, .kind = action.kind}, .writable = true};
  if (even_pairs && catalogue::register_count(action.kind) == 1) {
    cell.place.address = static_cast<std::uint16_t>(action.address.value & ~1U);
    cell.place.kind = Kind::u32;
  }
  if (const Cell* known = known_at(cell.place)) cell.is_parameter = known->is_parameter;
  if (commands == Commands::readable) {
    add_registers(cell.place);
    limit_to_values(action, cell);
  }
  add(cell);
}

void RegisterBank::add_events(const catalogue::EventSpec& facts) {
  for (std::uint16_t i = 0; i < facts.count; ++i) {
    tables_.of(catalogue::table_of(facts)).add(static_cast<std::uint16_t>(facts.first + i));
  }
  if (!facts.arm) return;
  const Place arm{.address = facts.arm->address};
  if (known_at(arm) == nullptr) add({.place = arm, .writable = true});
}

void RegisterBank::fill(const catalogue::Area& area) {
  for (std::uint32_t address = area.from; address <= area.to; ++address) {
    tables_.of(area.table).add(static_cast<std::uint16_t>(address));
  }
}

void RegisterBank::limit(const Place& place, std::int64_t minimum, std::int64_t maximum) {
  const auto found = cells_.find({place.table, place.address});
  if (found == cells_.end()) return;
  found->second.minimum = minimum;
  found->second.maximum = maximum;
}

void RegisterBank::add_mirrors(const catalogue::LimitSpec& facts) {
  const auto add = [this](std::uint32_t address, std::int64_t limit) {
    Words& words = tables_.of(RegisterTable::holding);
    words.add(static_cast<std::uint16_t>(address));
    words.put(static_cast<std::uint16_t>(address), low_word(limit));
  };
  for (const auto& [key, cell] : cells_) {
    const auto [table, number, kind, scale] = cell.place;
    const bool is_mirrored = table == RegisterTable::holding && cell.writable &&
                             number >= facts.from && number <= facts.to;
    if (!is_mirrored) continue;
    add(number + facts.minimum_offset, cell.minimum.value_or(catalogue::lowest(kind)));
    add(number + facts.maximum_offset, cell.maximum.value_or(catalogue::highest(kind)));
  }
}

// A hole has no mirrors either.
void RegisterBank::remove(const catalogue::Area& area,
                          const std::optional<catalogue::LimitSpec>& limits) {
  for (std::uint32_t number = area.from; number <= area.to; ++number) {
    const auto address = static_cast<std::uint16_t>(number);
    tables_.of(area.table).erase(address);
    const Cell* cell = known_at(area.table, address);
    if (cell == nullptr) continue;
    const bool is_mirrored = limits && area.table == RegisterTable::holding && cell->writable &&
                             address >= limits->from && address <= limits->to;
    cells_.erase({area.table, cell->place.address});
    if (!is_mirrored) continue;
    Words& words = tables_.of(RegisterTable::holding);
    words.erase(static_cast<std::uint16_t>(number + limits->minimum_offset));
    words.erase(static_cast<std::uint16_t>(number + limits->maximum_offset));
  }
}

// ---- registers ----

bool RegisterBank::has(RegisterTable table, std::uint16_t first, std::size_t count) const {
  if (first + count > 0x10000) return false;
  for (std::size_t i = 0; i < count; ++i) {
    if (!tables_.of(table).has(static_cast<std::uint16_t>(first + i))) return false;
  }
  return true;
}

std::optional<Registers> RegisterBank::read(RegisterTable table, std::uint16_t first,
                                            std::size_t count) const {
  if (!has(table, first, count)) return std::nullopt;
  Registers registers;
  for (std::size_t i = 0; i < count; ++i) {
    registers.push_back(tables_.of(table).at(static_cast<std::uint16_t>(first + i)));
  }
  return registers;
}

const Cell* RegisterBank::known_at(RegisterTable table, std::uint16_t address) const {
  const auto next = cells_.upper_bound({table, address});
  if (next == cells_.begin()) return nullptr;
  const Cell& cell = std::prev(next)->second;
  return cell.place.table == table && cell.place.covers(address) ? &cell : nullptr;
}

const Cell* RegisterBank::cell_at(RegisterTable table, std::uint16_t address) const {
  const Cell* cell = known_at(table, address);
  return cell != nullptr && cell->writable ? cell : nullptr;
}

std::uint32_t RegisterBank::with_words(const Cell& cell, std::uint16_t first, RegisterView values,
                                       std::size_t& next) const {
  std::uint32_t raw = this->raw(cell.place);
  const unsigned end = cell.place.end();
  for (; next < values.size() && first + next < end; ++next) {
    const auto shift = static_cast<unsigned>(16U * (end - 1U - (first + next)));
    raw = (raw & ~(0xFFFFU << shift)) | (std::uint32_t{values[next]} << shift);
  }
  return raw;
}

std::uint32_t RegisterBank::raw(const Place& place) const {
  return raw_in(tables_.of(place.table), place);
}

void RegisterBank::set_raw(const Place& place, std::uint32_t raw) {
  put_raw(tables_.of(place.table), place, raw);
}

// ---- names ----

std::optional<Place> RegisterBank::find(std::string_view name) const {
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
  return Place{numbered_->table, static_cast<std::uint16_t>(*number)};
}

std::vector<Place> RegisterBank::matching(std::string_view pattern) const {
  const std::string_view head = pattern.substr(0, pattern.find_first_of(pattern_characters));
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
  const std::string_view head = pattern.substr(0, pattern.find_first_of(pattern_characters));
  const std::string_view prefix = numbered_->prefix;
  const std::size_t common = std::min(head.size(), prefix.size());
  const bool may_match = head.substr(0, common) == prefix.substr(0, common) &&
                         head.find_first_not_of("0123456789", common) == std::string_view::npos;
  if (!may_match) return;
  std::string name(prefix);
  for (std::uint32_t number = numbered_->from; number <= numbered_->to; ++number) {
    name.resize(prefix.size());
    if (!glob_match(pattern, name += std::to_string(number))) continue;
    found.push_back({numbered_->table, static_cast<std::uint16_t>(number)});
  }
}

std::int64_t RegisterBank::get(std::string_view name) const {
  const auto place = find(name);
  return place ? number_in(raw(*place), place->kind) : 0;
}

void RegisterBank::set(std::string_view name, std::int64_t value) {
  if (const auto place = find(name)) set_raw(*place, static_cast<std::uint32_t>(value));
}

Duration RegisterBank::time(std::string_view name, Duration unit) const {
  const auto place = find(name);
  if (!place) return {};
  // What is no whole number of millionths, or too large for this, is longer than any day.
  const Decimal millionth(1, -6);
  const auto scaled = Decimal(number_in(raw(*place), place->kind)).times(place->scale);
  const auto steps = scaled ? scaled->divided_by(millionth) : std::nullopt;
  constexpr std::int64_t parts = 1'000'000;
  const Duration step = unit / parts;
  if (!steps || *steps > longest / step) return longest;
  return std::max<std::int64_t>(*steps, 0) * step;
}

void RegisterBank::copy_parameters(const Tables& from, Tables& into,
                                   std::span<const std::string_view> but) const {
  const auto is_spared = [&](const Place& place) {
    return std::any_of(but.begin(), but.end(), [&](std::string_view name) {
      const auto spared = find(name);
      return spared && spared->table == place.table && spared->address == place.address;
    });
  };
  for (const auto& [key, cell] : cells_) {
    if (!cell.is_parameter || is_spared(cell.place)) continue;
    const RegisterTable table = cell.place.table;
    put_raw(into.of(table), cell.place, raw_in(from.of(table), cell.place));
  }
}

}  // namespace spindle::sim
