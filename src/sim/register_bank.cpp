#include "register_bank.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include "spindle/base/text.hpp"
#include "spindle/catalogue/value.hpp"

namespace spindle::sim {
namespace {

using catalogue::Access;
using catalogue::Content;
using catalogue::Encoding;
using catalogue::Integer;
using catalogue::Kind;
using catalogue::Parameter;
using catalogue::Value;
using modbus::RegisterTable;

constexpr std::string_view commands_prefix = "command.";
constexpr std::string_view pattern_characters = "*?[";
constexpr std::string_view anything = "*";
constexpr Duration longest = std::chrono::hours(24);
/// What clocks show at first: 2026-01-01 00:00:00, whenever that is.
constexpr std::int64_t first_second = 1'767'225'600;

Parameter as_parameter(const Encoding& encoding) {
  Parameter parameter;
  parameter.encoding = encoding;
  return parameter;
}

Encoding element_of(Encoding encoding) {
  encoding.count = 1;
  return encoding;
}

/// One element without scale and offset.
Encoding stored_as(const Encoding& encoding) {
  Encoding plain = element_of(encoding);
  plain.scale = Decimal(1);
  plain.divisor = 1;
  plain.offset = Decimal(0);
  return plain;
}

Decimal to_decimal(const Integer& integer) { return {integer.sign, integer.magnitude, 0}; }

/// Requires a number without decimals.
Integer to_integer(const Decimal& whole) { return {whole.sign(), whole.magnitude()}; }

Integer fitting(const Encoding& encoding, const Integer& step) {
  return std::clamp(step, to_integer(catalogue::lowest(encoding)),
                    to_integer(catalogue::highest(encoding)));
}

/// Whether elements are integers that stand in registers as they are.
bool is_plain(const Encoding& encoding) {
  return encoding.is_integer() && encoding.kind != Kind::bcd;
}

std::optional<Decimal> number_in(const Encoding& encoding, RegisterView registers) {
  const Parameter one = as_parameter(element_of(encoding));
  const auto value = decode(one, registers.first(catalogue::register_count(one.encoding)));
  if (!value || !value->is_number()) return std::nullopt;
  return value->number;
}

Registers date_of(const Encoding& encoding, const Decimal& seconds, const Registers& same) {
  const Encoding unix_time = {.kind = Kind::date, .date = catalogue::DateLayout::unix_time};
  return decode(as_parameter(unix_time), catalogue::to_registers(unix_time, seconds.magnitude()))
      .and_then([&](const Value& date) { return encode(as_parameter(encoding), date); })
      .value_or(same);
}

/// One element, none of plain integers, that is the nearest to a number, or stays as it is where
/// none is near.
Registers with_number(const Encoding& encoding, const Decimal& number, const Registers& same) {
  if (encoding.kind == Kind::date) return date_of(encoding, number, same);
  if (encoding.kind == Kind::text) {
    return encode(as_parameter(encoding), {.content = Content::text}).value_or(same);
  }
  if (encoding.is_float()) return encode(as_parameter(encoding), {number}).value_or(same);
  const auto step = catalogue::nearest_step(encoding, number);
  if (!step) return same;
  const Decimal fit = to_decimal(fitting(encoding, *step));
  return encode(as_parameter(stored_as(encoding)), {fit}).value_or(same);
}

/// `make` of each element, one behind the other. It gets what the element is and holds.
template <typename Make>
Registers of_each(const Encoding& encoding, const Registers& present, Make make) {
  if (encoding.count == 1) return make(encoding, present);
  const Encoding one = element_of(encoding);
  const auto size = static_cast<std::ptrdiff_t>(catalogue::register_count(one));
  Registers all;
  while (all.size() < present.size()) {
    const auto own = present.begin() + static_cast<std::ptrdiff_t>(all.size());
    const Registers next = make(one, Registers(own, own + size));
    all.insert(all.end(), next.begin(), next.end());
  }
  return all;
}

/// The smallest range that has all of both.
catalogue::Range hull(const catalogue::Range& a, const catalogue::Range& b) {
  catalogue::Range all;
  if (a.minimum && b.minimum) all.minimum = std::min(*a.minimum, *b.minimum);
  if (a.maximum && b.maximum) all.maximum = std::max(*a.maximum, *b.maximum);
  return all;
}

/// The range of a parameter, or of its labels where it has none. One whose steps are worth
/// something else each time has no range here.
void limit_to_range(const Parameter& parameter, Cell& cell) {
  if (!parameter.scale_by.empty()) return;
  cell.range = parameter.range;
  cell.except = parameter.except;
  if (parameter.labels.empty() || cell.range.minimum || cell.range.maximum) return;
  const auto [low, high] =
      std::minmax_element(parameter.labels.begin(), parameter.labels.end(),
                          [](const auto& a, const auto& b) { return a.number < b.number; });
  cell.range = {catalogue::scaled(parameter.encoding, Decimal(low->number)),
                catalogue::scaled(parameter.encoding, Decimal(high->number))};
}

catalogue::Range values_of(const catalogue::Action& action) {
  std::int64_t low = action.value.value_or(action.minimum);
  std::int64_t high = action.value.value_or(action.maximum);
  const auto widen = [&](std::int64_t value) {
    low = std::min(low, value);
    high = std::max(high, value);
  };
  if (action.rest) widen(*action.rest);
  if (action.stop_value) widen(*action.stop_value);
  for (const catalogue::Label& label : action.labels) widen(label.number);
  return {Decimal(low), Decimal(high)};
}

/// Whether the device tells its own limits of it.
bool is_mirrored(const Cell& cell, const catalogue::LimitSpec& facts) {
  return cell.place.table == RegisterTable::holding && cell.writable &&
         cell.place.address >= facts.from && cell.place.address <= facts.to;
}

bool needs_unlock(const std::optional<catalogue::UnlockSpec>& unlock, std::string_view name) {
  if (!unlock || unlock->parameter == name) return false;
  const auto& needed = unlock->needed_by;
  return needed.empty() || std::any_of(needed.begin(), needed.end(), [&](const auto& pattern) {
           return glob_match(pattern, name);
         });
}

/// What cells are sorted by.
std::uint32_t key_of(RegisterTable table, std::uint16_t address) {
  constexpr unsigned bits_per_address = 16;
  return (static_cast<std::uint32_t>(table) << bits_per_address) | address;
}
std::uint32_t key_of(const Place& place) { return key_of(place.table, place.written_at()); }
std::uint32_t key_of(const Cell& cell) { return key_of(cell.place); }
bool is_below(const Cell& cell, std::uint32_t key) { return key_of(cell) < key; }
bool is_before(const Cell& a, const Cell& b) { return key_of(a) < key_of(b); }

Registers words_at(const Words& words, const Place& place) {
  Registers registers;
  for (unsigned i = 0; i < place.size(); ++i) {
    registers.push_back(words.at(static_cast<std::uint16_t>(place.address + i)));
  }
  return registers;
}

void put_words(Words& words, const Place& place, RegisterView registers) {
  auto address = place.address;
  for (const std::uint16_t word : registers) words.put(address++, word);
}

/// Each element holds this integer then, as far as it has bits; those beside it stay. Requires
/// plain integers.
void put_integer(Words& words, const Place& place, const Integer& integer) {
  constexpr std::size_t most_registers = 4;
  std::array<std::uint16_t, most_registers> held = {};
  const unsigned all = place.size();
  const unsigned size = all / place.encoding.count;
  const std::span<std::uint16_t> one(held.data(), std::min<std::size_t>(size, held.size()));
  const std::uint64_t pattern = catalogue::to_pattern(place.encoding, integer);
  for (unsigned first = 0; first < all; first += size) {
    const auto at = [&](std::size_t i) {
      return static_cast<std::uint16_t>(place.address + first + i);
    };
    for (std::size_t i = 0; i < one.size(); ++i) one[i] = words.at(at(i));
    catalogue::put_pattern(place.encoding, pattern, one);
    for (std::size_t i = 0; i < one.size(); ++i) words.put(at(i), one[i]);
  }
}

/// The bits of `registers` that are the value's, and the others of `present`.
Registers merged(const Encoding& encoding, Registers registers, RegisterView present) {
  if (!encoding.is_part() || encoding.count > 1) return registers;
  return catalogue::to_registers(encoding, catalogue::to_pattern(encoding, registers),
                                 catalogue::to_pattern(encoding, present));
}

}  // namespace

void Words::add(std::uint16_t first, std::size_t count) {
  constexpr std::size_t addresses = 0x10000;
  const std::size_t end = std::min(first + count, addresses);
  if (end > words_.size()) {
    // In steps, as profiles name registers in rising order.
    constexpr std::size_t step = 1024;
    const std::size_t size = (end + step - 1) / step * step;
    words_.resize(size);
    there_.resize(size);
  }
  for (std::size_t address = first; address < end; ++address) there_[address] = true;
}

std::int64_t stored_in(const Encoding& encoding, RegisterView registers) {
  const auto number = number_in(stored_as(encoding), registers);
  const auto nearest =
      number ? catalogue::nearest_step({.kind = Kind::i64}, *number) : std::nullopt;
  return nearest ? to_decimal(*nearest).mantissa() : 0;
}

bool Cell::takes(RegisterView registers) const {
  const Kind kind = place.encoding.kind;
  const bool is_limited = range.minimum || range.maximum || except;
  if (kind == Kind::date || (!is_limited && kind != Kind::bcd)) return true;
  Parameter parameter = as_parameter(place.encoding);
  parameter.range = range;
  parameter.except = except;
  const auto value = decode(parameter, registers);
  if (!value) return false;
  const auto fits = [&](const Value& one) { return check_range(parameter, one).has_value(); };
  return fits(*value) && std::all_of(value->elements.begin(), value->elements.end(), fits);
}

template <typename Visit>
void RegisterBank::for_each_match(std::string_view pattern, Visit visit) const {
  const std::string_view head = pattern.substr(0, pattern.find_first_of(pattern_characters));
  if (head == pattern) {
    if (const auto place = find(pattern)) visit(*place);
    return;
  }
  const std::string_view rest = pattern.substr(head.size());
  for (auto at = names_from(head); at != by_name_.end(); ++at) {
    const auto& [name, place] = named_[*at];
    if (!name.starts_with(head)) break;
    if (rest == anything || glob_match(rest, name.view().substr(head.size()))) visit(place);
  }
  if (numbered_) for_each_number(pattern, visit);
}

template <typename Visit>
void RegisterBank::for_each_number(std::string_view pattern, Visit visit) const {
  const std::string_view head = pattern.substr(0, pattern.find_first_of(pattern_characters));
  const std::string_view prefix = numbered_->prefix;
  const std::size_t common = std::min(head.size(), prefix.size());
  const bool may_match = head.substr(0, common) == prefix.substr(0, common) &&
                         head.find_first_not_of("0123456789", common) == std::string_view::npos;
  if (!may_match) return;
  const bool is_each = head.size() == common && pattern.substr(common) == anything;
  std::string name(prefix);
  Place place{numbered_->table};
  for (std::uint32_t number = numbered_->from; number <= numbered_->to; ++number) {
    if (!is_each) {
      name.resize(prefix.size());
      if (!glob_match(pattern, name += std::to_string(number))) continue;
    }
    place.address = static_cast<std::uint16_t>(number);
    visit(place);
  }
}

// ---- layout ----

RegisterBank::RegisterBank(const catalogue::Profile& profile,
                           const catalogue::SimulationSpec& start, Commands commands)
    : unlock_(profile.unlock) {
  named_.reserve(profile.parameters.size());
  cells_.reserve(profile.parameters.size() + profile.actions.size());
  for (const catalogue::Parameter& parameter : profile.parameters) {
    add_parameter(parameter, profile.commands_motion(parameter));
  }
  sort_names();
  for (const catalogue::Action& action : profile.actions) {
    add_command(action, profile.link.even_pairs, commands);
  }
  if (profile.numbered) add_numbered(*profile.numbered);
  if (profile.events) add_events(*profile.events);
  for (const auto& value : start.values) {
    for_each_match(value.pattern, [&](const Place& place) { set_stored(place, value.raw); });
  }
  for (const auto& limits : start.limits) {
    auto next = cells_.begin();
    for_each_match(limits.pattern, [&](const Place& place) {
      next = limit(place, limits.minimum, limits.maximum, next);
    });
  }
  if (profile.limits) add_mirrors(*profile.limits);
  for (const catalogue::Area& area : start.absent) remove(area, profile.limits);
}

void RegisterBank::sort_names() {
  by_name_.resize(named_.size());
  std::iota(by_name_.begin(), by_name_.end(), std::uint32_t{0});
  std::sort(by_name_.begin(), by_name_.end(), [this](std::uint32_t a, std::uint32_t b) {
    return named_[a].name.view() < named_[b].name.view();
  });
}

void RegisterBank::add_registers(const Place& place) {
  tables_.of(place.table).add(place.address, place.size());
}

/// Behind those that are written by the same register.
void RegisterBank::add(const Cell& cell) {
  const auto at =
      std::upper_bound(cells_.begin(), cells_.end(), key_of(cell),
                       [](std::uint32_t key, const Cell& other) { return key < key_of(other); });
  cells_.insert(at, cell);
  longest_ = std::max(longest_, cell.place.size());
}

void RegisterBank::add_parameter(const Parameter& parameter, bool is_command) {
  Place place{parameter.table, parameter.address.value, parameter.encoding};
  if (parameter.write_address) place.write_address = parameter.write_address->value;
  named_.push_back({parameter.name, place});
  add_registers(place);
  if (parameter.reading == catalogue::Reading::consumes) consumed_.push_back(place);
  Cell cell{.place = place, .writable = parameter.access == Access::read_write};
  cell.is_parameter = cell.writable && !is_command && !parameter.name.starts_with(commands_prefix);
  cell.needs_unlock = needs_unlock(unlock_, parameter.name);
  limit_to_range(parameter, cell);
  if (!cell.writable || cell.is_parameter) begin(parameter, cell);
  add(cell);
}

// No command is given at first, and what a device measures begins at 0.
void RegisterBank::begin(const Parameter& parameter, const Cell& cell) {
  const Place& place = cell.place;
  const Decimal least = cell.is_parameter ? cell.range.minimum.value_or(Decimal(0)) : Decimal(0);
  if (place.encoding.kind == Kind::date) {
    set_stored(place, first_second);
  } else {
    set_number(place, parameter.default_value.value_or(least));
  }
  if (parameter.nulls.empty()) return;
  Parameter one = parameter;
  one.encoding.count = 1;
  for (std::size_t i = 0; i < parameter.nulls.size(); ++i) {
    const Registers all = registers(place);
    const auto value =
        decode(one, RegisterView(all).first(catalogue::register_count(one.encoding)));
    if (!value || value->content != Content::none) return;
    set_stored(place, stored(place) + 1);
  }
}

// A register that has a name already keeps what its name says of it.
void RegisterBank::add_numbered(const catalogue::NumberedSpec& facts) {
  numbered_ = facts;
  const std::size_t count = std::size_t{facts.to} - facts.from + 1;
  tables_.of(facts.table).add(facts.from, count);
  Words named;
  for (const Cell& cell : cells_) {
    if (cell.place.table == facts.table) named.add(cell.place.written_at(), cell.place.size());
  }
  const auto middle = static_cast<std::ptrdiff_t>(cells_.size());
  cells_.reserve(cells_.size() + count);
  const bool is_writable = facts.access == Access::read_write;
  Cell cell{.place = {facts.table}, .writable = is_writable, .is_parameter = is_writable};
  for (std::uint32_t number = facts.from; number <= facts.to; ++number) {
    cell.place.address = static_cast<std::uint16_t>(number);
    if (named.has(cell.place.address)) continue;
    if (unlock_) {
      cell.needs_unlock = needs_unlock(unlock_, facts.prefix.to_string() + std::to_string(number));
    }
    cells_.push_back(cell);
  }
  std::inplace_merge(cells_.begin(), cells_.begin() + middle, cells_.end(), is_before);
}

// Where values are pairs, the register of an action is the lower of its pair, or it is a pair by
// itself. A value of the same registers may be what it was, or what the action says; where others
// share them, it may be anything.
void RegisterBank::add_command(const catalogue::Action& action, bool even_pairs,
                               Commands commands) {
  if (action.motion != catalogue::Motion::none) return;
  Cell cell{.place = {action.table, action.address.value, action.encoding}, .writable = true};
  const bool is_half = even_pairs && action.table == RegisterTable::holding &&
                       cell.place.size() == 1 && !action.encoding.is_part();
  if (is_half) {
    cell.place.address = static_cast<std::uint16_t>(action.address.value & ~1U);
    cell.place.encoding.kind = Kind::u32;
  }
  if (commands == Commands::readable) {
    add_registers(cell.place);
    cell.range = values_of(action);
  }
  const auto replaces = [&](const Cell& other) {
    return key_of(other) == key_of(cell) && other.place.address == cell.place.address &&
           other.place.encoding.slice == cell.place.encoding.slice &&
           other.place.size() <= cell.place.size();
  };
  for (const Cell& other : cells_) {
    if (!replaces(other) || !other.writable) continue;
    cell.is_parameter |= other.is_parameter;
    cell.needs_unlock |= other.needs_unlock;
    cell.range = hull(cell.range, other.range);
  }
  std::erase_if(cells_, replaces);
  if (cell_at(cell.place.table, cell.place.address) != nullptr) cell.range = {};
  add(cell);
}

void RegisterBank::add_events(const catalogue::EventSpec& facts) {
  if (facts.first) tables_.of(catalogue::table_of(facts)).add(*facts.first, facts.count);
  if (!facts.arm) return;
  const Place arm{.address = facts.arm->address};
  if (cells_at(arm.table, arm.address).empty()) add({.place = arm, .writable = true});
}

void RegisterBank::fill(const catalogue::Area& area) {
  tables_.of(area.table).add(area.from, std::size_t{area.to} - area.from + 1);
}

RegisterBank::Cells::iterator RegisterBank::limit(const Place& place, std::int64_t minimum,
                                                  std::int64_t maximum, Cells::iterator next) {
  const std::uint32_t key = key_of(place);
  // Numbers come in the order of their registers.
  const bool is_next = next != cells_.end() && key_of(*next) == key;
  if (!is_next) next = std::lower_bound(cells_.begin(), cells_.end(), key, is_below);
  for (; next != cells_.end() && key_of(*next) == key; ++next) {
    const Encoding& encoding = next->place.encoding;
    if (encoding.slice != place.encoding.slice) continue;
    next->range = {catalogue::scaled(encoding, Decimal(minimum)),
                   catalogue::scaled(encoding, Decimal(maximum))};
  }
  return next;
}

void RegisterBank::add_mirrors(const catalogue::LimitSpec& facts) {
  constexpr unsigned addresses = 0x10000;
  // The limit, or where the value has none, what its bits can hold.
  const auto show = [this](Place mirror, std::uint16_t offset, const std::optional<Decimal>& limit,
                           Decimal (*extreme)(const Encoding&)) {
    const bool is_shown = limit || mirror.encoding.is_integer();
    if (!is_shown || mirror.end() + offset > addresses) return;
    mirror.address = static_cast<std::uint16_t>(mirror.address + offset);
    add_registers(mirror);
    if (limit) {
      set_number(mirror, *limit);
    } else {
      set_stored(mirror, extreme(mirror.encoding));
    }
  };
  for (const Cell& cell : cells_) {
    if (!is_mirrored(cell, facts)) continue;
    show(cell.place, facts.minimum_offset, cell.range.minimum, catalogue::lowest);
    show(cell.place, facts.maximum_offset, cell.range.maximum, catalogue::highest);
  }
}

// A hole has no mirrors either.
void RegisterBank::remove(const catalogue::Area& area,
                          const std::optional<catalogue::LimitSpec>& limits) {
  for (std::uint32_t number = area.from; number <= area.to; ++number) {
    tables_.of(area.table).erase(static_cast<std::uint16_t>(number));
  }
  std::erase_if(cells_, [&](const Cell& cell) {
    const Place& place = cell.place;
    if (place.table != area.table || place.address > area.to || place.end() <= area.from) {
      return false;
    }
    if (!limits || !is_mirrored(cell, *limits)) return true;
    for (unsigned number = place.address; number < place.end(); ++number) {
      Words& words = tables_.of(RegisterTable::holding);
      words.erase(static_cast<std::uint16_t>(number + limits->minimum_offset));
      words.erase(static_cast<std::uint16_t>(number + limits->maximum_offset));
    }
    return true;
  });
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

void RegisterBank::note_read(RegisterTable table, std::uint16_t first, std::size_t count) {
  for (const Place& place : consumed_) {
    const bool is_read =
        place.table == table && place.address < first + count && place.end() > first;
    if (is_read) set_stored(place, 0);
  }
}

bool RegisterBank::has_cells(RegisterTable table) const {
  const auto first = cells_from(table, 0);
  return first != cells_.end() && first->place.table == table;
}

RegisterBank::Cells::const_iterator RegisterBank::cells_from(RegisterTable table,
                                                             std::uint16_t address) const {
  return std::lower_bound(cells_.begin(), cells_.end(), key_of(table, address), is_below);
}

std::vector<const Cell*> RegisterBank::cells_at(RegisterTable table, std::uint16_t address) const {
  std::vector<const Cell*> found;
  const unsigned back = std::min<unsigned>(address, longest_ - 1);
  auto at = cells_from(table, static_cast<std::uint16_t>(address - back));
  for (; at != cells_.end() && key_of(*at) <= key_of(table, address); ++at) {
    const Place& place = at->place;
    if (address < place.written_at() + place.size()) found.push_back(&*at);
  }
  return found;
}

const Cell* RegisterBank::cell_at(RegisterTable table, std::uint16_t address) const {
  const auto cells = cells_at(table, address);
  const auto found =
      std::find_if(cells.begin(), cells.end(), [](const Cell* cell) { return cell->writable; });
  return found == cells.end() ? nullptr : *found;
}

Change RegisterBank::change_of(const Cell& cell, std::uint16_t first, RegisterView values) const {
  Change change{&cell, registers(cell.place)};
  for (std::size_t i = 0; i < change.registers.size(); ++i) {
    const std::size_t address = cell.place.written_at() + i;
    const bool is_written = address >= first && address - first < values.size();
    if (is_written) change.registers[i] = values[address - first];
  }
  return change;
}

// A part of a register whose bits stay is not written.
std::vector<Change> RegisterBank::changes(RegisterTable table, std::uint16_t first,
                                          RegisterView values) const {
  std::vector<Change> changes;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto address = static_cast<std::uint16_t>(first + i);
    bool is_writable = false;
    for (const Cell* cell : cells_at(table, address)) {
      if (!cell->writable) continue;
      is_writable = true;
      if (i > 0 && cell->place.written_at() != address) continue;
      Change change = change_of(*cell, first, values);
      const Registers present = registers(cell->place);
      const bool stays = cell->place.encoding.is_part() &&
                         merged(cell->place.encoding, change.registers, present) == present;
      if (!stays) changes.push_back(std::move(change));
    }
    if (!is_writable) changes.emplace_back();
  }
  return changes;
}

bool RegisterBank::is_locked(const Cell& cell) const {
  if (!cell.needs_unlock) return false;
  const auto lock = find(unlock_->parameter);
  return lock && number(*lock) != Decimal(unlock_->value);
}

Registers RegisterBank::registers(const Place& place) const {
  return words_at(tables_.of(place.table), place);
}

void RegisterBank::put(const Place& place, RegisterView registers) {
  put_words(tables_.of(place.table), place, registers);
}

std::optional<Decimal> RegisterBank::number(const Place& place) const {
  return number_in(place.encoding, registers(place));
}

void RegisterBank::set_number(const Place& place, const Decimal& number) {
  if (is_plain(place.encoding)) {
    const auto step = catalogue::nearest_step(place.encoding, number);
    if (step) put_integer(tables_.of(place.table), place, fitting(place.encoding, *step));
    return;
  }
  put(place,
      of_each(place.encoding, registers(place), [&](const Encoding& one, const Registers& same) {
        return with_number(one, number, same);
      }));
}

// A counter begins anew behind its last number.
void RegisterBank::set_stored(const Place& place, const Decimal& stored) {
  if (is_plain(place.encoding)) {
    put_integer(tables_.of(place.table), place, to_integer(stored));
    return;
  }
  put(place,
      of_each(place.encoding, registers(place), [&](const Encoding& one, const Registers& same) {
        return with_number(stored_as(one), stored, same);
      }));
}

// ---- names ----

std::vector<std::uint32_t>::const_iterator RegisterBank::names_from(std::string_view name) const {
  return std::lower_bound(by_name_.begin(), by_name_.end(), name,
                          [this](std::uint32_t index, std::string_view wanted) {
                            return named_[index].name.view() < wanted;
                          });
}

std::optional<Place> RegisterBank::find(std::string_view name) const {
  const auto named = names_from(name);
  if (named != by_name_.end() && named_[*named].name == name) return named_[*named].place;
  if (!numbered_ || !name.starts_with(numbered_->prefix)) return std::nullopt;
  const std::string_view digits = name.substr(numbered_->prefix.size());
  const auto number = parse_unsigned(digits, numbered_->to);
  const bool is_one =
      number && *number >= numbered_->from && (digits.size() == 1 || digits[0] != '0');
  if (!is_one) return std::nullopt;
  return Place{numbered_->table, static_cast<std::uint16_t>(*number)};
}

std::int64_t RegisterBank::get(std::string_view name) const {
  const auto place = find(name);
  return place ? stored(*place) : 0;
}

void RegisterBank::set(std::string_view name, std::int64_t value) {
  if (const auto place = find(name)) set_stored(*place, value);
}

Duration RegisterBank::time(std::string_view name, Duration unit) const {
  const auto place = find(name);
  if (!place) return {};
  // What is no whole number of millionths, or too large for this, is longer than any day.
  const Decimal millionth(1, -6);
  const auto value = number(*place);
  const auto steps = value ? value->divided_by(millionth) : std::nullopt;
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
      return spared && spared->table == place.table && spared->address == place.address &&
             spared->encoding.slice == place.encoding.slice;
    });
  };
  for (const Cell& cell : cells_) {
    if (!cell.is_parameter || is_spared(cell.place)) continue;
    const RegisterTable table = cell.place.table;
    put_words(into.of(table), cell.place,
              merged(cell.place.encoding, words_at(from.of(table), cell.place),
                     words_at(into.of(table), cell.place)));
  }
}

}  // namespace spindle::sim
