#include "blv_registers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "spindle/base/text.hpp"

namespace spindle::sim {
namespace {

using catalogue::Kind;
using modbus::RegisterTable;

constexpr std::string_view commands = "command.";
constexpr std::string_view operation_data = "operation.";
constexpr std::string_view alarm_history = "alarm.history.";
// What the initialisation that keeps the line working spares (AR p.230).
constexpr std::array<std::string_view, 3> line_settings = {
    "communication.parity", "communication.stop-bits", "communication.waiting-time"};

// HM-5114 p.15: a request is refused when address and count reach 2000h together.
constexpr std::uint32_t map_end = 0x1FFF;

// Any address has room for a value of two registers.
constexpr std::size_t room = 0x10000 + 1;

constexpr Duration longest = std::chrono::hours(24);

std::optional<std::int64_t> steps_of(const std::optional<Decimal>& value, const Decimal& scale) {
  return value ? value->divided_by(scale) : std::nullopt;
}

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

std::uint32_t read_raw(const Registers& words, std::uint16_t first, Kind kind) {
  if (catalogue::register_count(kind) == 1) return words.at(first);
  return (std::uint32_t{words.at(first)} << 16U) | words.at(first + std::size_t{1});
}

void write_raw(Registers& words, std::uint16_t first, Kind kind, std::uint32_t raw) {
  const auto low = static_cast<std::uint16_t>(raw & 0xFFFFU);
  if (catalogue::register_count(kind) == 1) {
    words.at(first) = low;
  } else {
    words.at(first) = static_cast<std::uint16_t>(raw >> 16U);
    words.at(first + std::size_t{1}) = low;
  }
}

}  // namespace

BlvRegisters::BlvRegisters(const catalogue::Profile& profile,
                           const catalogue::SimulationSpec& start, Layout layout)
    : layout_(layout),
      words_{Registers(room, 0), {}},
      holding_end_(layout == Layout::one_map ? map_end : 0) {
  for (const catalogue::Parameter& parameter : profile.parameters) {
    add(parameter, profile.commands_motion(parameter));
  }
  for (const catalogue::Action& action : profile.actions) add(action, profile.link.even_pairs);
  const bool is_exact = layout == Layout::exactly_as_named;
  if (is_exact && profile.numbered) add(*profile.numbered);
  if (has_input()) words_.input.resize(room, 0);
  if (is_exact) {
    for (const catalogue::Parameter& parameter : profile.parameters) begin(parameter);
    for (const catalogue::Area& area : start.absent) {
      for (std::uint32_t at = area.from; at <= area.to; ++at) {
        named_.erase({area.table, static_cast<std::uint16_t>(at)});
      }
    }
  }
  for (const auto& value : start.values) {
    for (const auto& [name, place] : places_) {
      if (glob_match(value.pattern, name)) set_number(place, value.raw);
    }
  }
  for (const auto& [name, place] : places_) factory_[name] = number(place);
  save();
}

void BlvRegisters::add(const catalogue::Parameter& parameter, bool is_word) {
  const Decimal& scale = parameter.encoding.scale;
  const bool is_command = is_word || parameter.name.starts_with(commands);
  Place place{.table = parameter.table,
              .cell = {parameter.address.value, parameter.encoding.kind,
                       is_command || parameter.name.starts_with(operation_data)},
              .scale = scale};
  place.writable = parameter.access == catalogue::Access::read_write;
  place.stored = place.writable && !is_command;
  place.minimum = steps_of(parameter.range.minimum, scale);
  place.maximum = steps_of(parameter.range.maximum, scale);
  if (parameter.except) {
    place.except = {steps_of(parameter.except->minimum, scale).value_or(0),
                    steps_of(parameter.except->maximum, scale).value_or(0)};
  }
  if (!parameter.labels.empty() && !place.minimum && !place.maximum) {
    const auto [low, high] =
        std::minmax_element(parameter.labels.begin(), parameter.labels.end(),
                            [](const auto& a, const auto& b) { return a.number < b.number; });
    place.minimum = low->number;
    place.maximum = high->number;
  }
  reach(place);
  places_[parameter.name] = place;
  if (place.table == RegisterTable::holding) by_address_[place.cell.first] = place;
}

// Where values are pairs, the register of an action is the lower of its pair, or it is a pair by
// itself.
void BlvRegisters::add(const catalogue::Action& action, bool even_pairs) {
  if (action.motion != catalogue::Motion::none) return;
  Place place{.cell = {action.address.value, action.kind, false}, .writable = true};
  if (even_pairs && catalogue::register_count(action.kind) == 1) {
    place.cell.first = static_cast<std::uint16_t>(action.address.value & ~1U);
    place.cell.kind = Kind::u32;
  }
  const Place* known = place_at(place.cell.first);
  place.cell.operation = known != nullptr && known->cell.operation;
  place.minimum = action.value.value_or(action.minimum);
  place.maximum = action.value.value_or(action.maximum);
  const auto widen = [&](std::int64_t value) {
    place.minimum = std::min(*place.minimum, value);
    place.maximum = std::max(*place.maximum, value);
  };
  if (action.rest) widen(*action.rest);
  if (action.stop_value) widen(*action.stop_value);
  for (const catalogue::Label& label : action.labels) widen(label.number);
  reach(place);
  by_address_[place.cell.first] = place;
}

/// What has a name already keeps it.
void BlvRegisters::add(const catalogue::NumberedSpec& facts) {
  for (std::uint32_t number = facts.from; number <= facts.to; ++number) {
    Place place{.table = facts.table, .cell = {.first = static_cast<std::uint16_t>(number)}};
    place.writable = facts.access == catalogue::Access::read_write;
    place.stored = place.writable;
    reach(place);
    places_.try_emplace(fmt::format("{}{}", facts.prefix, number), place);
    const bool is_free =
        place.table == RegisterTable::holding && place_at(place.cell.first) == nullptr;
    if (is_free) by_address_[place.cell.first] = place;
  }
}

void BlvRegisters::begin(const catalogue::Parameter& parameter) {
  const Place& place = places_.at(parameter.name);
  if (place.writable && !place.stored) return;  // no command is given at first
  const auto value = steps_of(parameter.default_value, parameter.encoding.scale);
  const std::int64_t number = value.value_or(place.minimum.value_or(0));
  if (number != 0) set_number(place, number);
}

void BlvRegisters::reach(const Place& place) {
  for (unsigned i = 0; i < catalogue::register_count(place.cell.kind); ++i) {
    named_.emplace(place.table, static_cast<std::uint16_t>(place.cell.first + i));
  }
  const std::uint32_t end = place.cell.first + catalogue::register_count(place.cell.kind);
  std::uint32_t& known = place.table == RegisterTable::holding ? holding_end_ : input_end_;
  known = std::max(known, end);
}

bool BlvRegisters::exists(RegisterTable table, std::uint16_t first, std::size_t quantity) const {
  if (layout_ == Layout::one_map) return true;
  for (std::size_t i = 0; i < quantity; ++i) {
    if (!named_.contains({table, static_cast<std::uint16_t>(first + i)})) return false;
  }
  return true;
}

bool BlvRegisters::holds(std::uint16_t first, std::size_t quantity) const {
  return first + quantity <= holding_end_;
}

std::optional<Registers> BlvRegisters::read(RegisterTable table, std::uint16_t first,
                                            std::size_t quantity) const {
  const bool holding = table == RegisterTable::holding;
  if (first + quantity > (holding ? holding_end_ : input_end_)) return std::nullopt;
  if (!exists(table, first, quantity)) return std::nullopt;
  const Registers& words = holding ? words_.holding : words_.input;
  const auto begin = words.begin() + first;
  return Registers(begin, begin + static_cast<std::ptrdiff_t>(quantity));
}

const BlvRegisters::Place* BlvRegisters::place_at(std::uint16_t address) const {
  auto next = by_address_.upper_bound(address);
  if (next == by_address_.begin()) return nullptr;
  const Place& place = std::prev(next)->second;
  const unsigned end = unsigned{place.cell.first} + catalogue::register_count(place.cell.kind);
  return address < end ? &place : nullptr;
}

std::optional<BlvRegisters::Cell> BlvRegisters::cell_at(std::uint16_t address) const {
  const Place* place = place_at(address);
  const bool is_there =
      place != nullptr && place->writable && exists(RegisterTable::holding, address, 1);
  if (!is_there) return std::nullopt;
  return place->cell;
}

std::uint32_t BlvRegisters::raw(const Cell& cell) const {
  return read_raw(words_.holding, cell.first, cell.kind);
}

std::uint32_t BlvRegisters::with_words(const Cell& cell, std::uint16_t first, RegisterView values,
                                       std::size_t& next) const {
  std::uint32_t raw = this->raw(cell);
  const unsigned end = unsigned{cell.first} + catalogue::register_count(cell.kind);
  for (; next < values.size() && first + next < end; ++next) {
    const auto shift = static_cast<unsigned>(16U * (end - 1U - (first + next)));
    raw = (raw & ~(0xFFFFU << shift)) | (std::uint32_t{values[next]} << shift);
  }
  return raw;
}

void BlvRegisters::set_raw(const Cell& cell, std::uint32_t raw) {
  write_raw(words_.holding, cell.first, cell.kind, raw);
}

bool BlvRegisters::takes(const Cell& cell, std::uint32_t raw) const {
  const Place* place = place_at(cell.first);
  if (place == nullptr) return false;
  const std::int64_t wanted = number_in(raw, place->cell.kind);
  const bool excepted =
      place->except && wanted >= place->except->first && wanted <= place->except->second;
  const bool outside =
      (place->minimum && wanted < *place->minimum) || (place->maximum && wanted > *place->maximum);
  return !excepted && !outside;
}

std::int64_t BlvRegisters::number(const Place& place) const {
  const Registers& words = place.table == RegisterTable::holding ? words_.holding : words_.input;
  return number_in(read_raw(words, place.cell.first, place.cell.kind), place.cell.kind);
}

void BlvRegisters::set_number(const Place& place, std::int64_t number) {
  Registers& words = place.table == RegisterTable::holding ? words_.holding : words_.input;
  write_raw(words, place.cell.first, place.cell.kind, static_cast<std::uint32_t>(number));
}

std::int64_t BlvRegisters::get(std::string_view name) const {
  const auto place = places_.find(name);
  return place == places_.end() ? 0 : number(place->second);
}

void BlvRegisters::set(std::string_view name, std::int64_t value) {
  const auto place = places_.find(name);
  if (place != places_.end()) set_number(place->second, value);
}

Duration BlvRegisters::time(std::string_view name, Duration unit) const {
  const auto place = places_.find(name);
  if (place == places_.end()) return {};
  // What is no whole number of millionths, or too large for this, is longer than any day.
  const Decimal millionth(1, -6);
  const auto scaled = Decimal(number(place->second)).times(place->second.scale);
  const auto steps = scaled ? scaled->divided_by(millionth) : std::nullopt;
  constexpr std::int64_t parts = 1'000'000;
  const Duration step = unit / parts;
  if (!steps || *steps > longest / step) return longest;
  return std::max<std::int64_t>(*steps, 0) * step;
}

void BlvRegisters::push_history(std::string_view name, std::int64_t code) {
  int last = 1;
  while (places_.contains(fmt::format("{}.{}", name, last + 1))) ++last;
  for (int n = last; n > 1; --n) {
    set(fmt::format("{}.{}", name, n), get(fmt::format("{}.{}", name, n - 1)));
  }
  set(fmt::format("{}.1", name), code);
}

void BlvRegisters::clear_history(std::string_view name) {
  for (const auto& [known, place] : places_) {
    if (known.starts_with(fmt::format("{}.", name))) set_number(place, 0);
  }
}

BlvRegisters::Numbers BlvRegisters::stored_part() const {
  Numbers stored;
  for (const auto& [name, place] : places_) {
    if (place.stored) stored[name] = number(place);
  }
  return stored;
}

void BlvRegisters::load() {
  for (const auto& [name, value] : stored_) set(name, value);
}

void BlvRegisters::initialize(Scope scope) {
  for (const auto& [name, place] : places_) {
    const bool kept =
        scope == Scope::without_the_line &&
        std::find(line_settings.begin(), line_settings.end(), name) != line_settings.end();
    if (!place.stored || kept) continue;
    set_number(place, factory_.at(name));
    stored_[name] = factory_.at(name);
  }
}

void BlvRegisters::restart() {
  Numbers kept;
  for (const auto& [name, place] : places_) {
    kept[name] = name.starts_with(alarm_history) ? number(place) : factory_.at(name);
  }
  for (Registers* words : {&words_.holding, &words_.input}) {
    std::fill(words->begin(), words->end(), std::uint16_t{0});  // those of actions have no names
  }
  for (const auto& [name, value] : kept) set(name, value);
  load();
}

}  // namespace spindle::sim
