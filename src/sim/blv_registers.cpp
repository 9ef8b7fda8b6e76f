#include "blv_registers.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "spindle/base/text.hpp"

namespace spindle::sim {
namespace {

using catalogue::Kind;

constexpr std::string_view commands = "command.";
constexpr std::string_view communication = "communication.";
constexpr std::string_view alarm_history = "alarm.history.";

std::optional<std::int64_t> steps_of(const std::optional<Decimal>& value, const Decimal& scale) {
  return value ? value->divided_by(scale) : std::nullopt;
}

std::int64_t number_in(std::uint32_t raw, Kind kind) {
  return kind == Kind::i32 ? std::int64_t{static_cast<std::int32_t>(raw)} : std::int64_t{raw};
}

std::uint16_t even_part(std::uint16_t address) { return static_cast<std::uint16_t>(address & ~1U); }

}  // namespace

BlvRegisters::BlvRegisters(const catalogue::Profile& profile,
                           const catalogue::SimulationFacts& start) {
  for (const catalogue::Parameter& parameter : profile.parameters) add(parameter);
  for (const catalogue::Action& action : profile.actions) add(action);
  for (const auto& value : start.values) {
    for (const auto& [name, place] : places_) {
      if (glob_match(value.pattern, name)) {
        set_pair(place.address, static_cast<std::uint32_t>(value.raw));
      }
    }
  }
  factory_ = words_;
  save();
}

void BlvRegisters::add(const catalogue::Parameter& parameter) {
  const Decimal& scale = parameter.encoding.scale;
  Place place{.address = parameter.address.value, .kind = parameter.encoding.kind};
  place.writable = parameter.access == catalogue::Access::read_write;
  place.stored = place.writable && !parameter.name.starts_with(commands);
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
  places_[parameter.name] = place;
  by_address_[place.address] = place;
}

// The register of an action is the lower of its pair, or it is a pair by itself.
void BlvRegisters::add(const catalogue::Action& action) {
  if (action.motion != catalogue::Motion::none) return;
  Place place{.address = even_part(action.address.value), .kind = action.kind, .writable = true};
  place.minimum = action.rest ? std::min(*action.rest, *action.value) : action.minimum;
  place.maximum = action.rest ? std::max(*action.rest, *action.value) : action.maximum;
  for (const catalogue::Label& label : action.labels) {
    place.minimum = std::min(*place.minimum, label.number);
    place.maximum = std::max(*place.maximum, label.number);
  }
  by_address_[place.address] = place;
}

Registers BlvRegisters::read(std::uint16_t first, std::uint16_t quantity) const {
  const auto begin = words_.begin() + first;
  return {begin, begin + quantity};
}

std::uint32_t BlvRegisters::pair(std::uint16_t even) const {
  return (std::uint32_t{words_[even]} << 16U) | words_[even + 1U];
}

void BlvRegisters::set_pair(std::uint16_t even, std::uint32_t raw) {
  words_[even] = static_cast<std::uint16_t>(raw >> 16U);
  words_[even + 1U] = static_cast<std::uint16_t>(raw & 0xFFFFU);
}

BlvRegisters::Verdict BlvRegisters::check(std::uint16_t even, std::uint32_t raw) const {
  const auto found = by_address_.find(even);
  if (found == by_address_.end() || !found->second.writable) return Verdict::not_writable;
  const Place& place = found->second;
  const std::int64_t number = number_in(raw, place.kind);
  const bool excepted =
      place.except && number >= place.except->first && number <= place.except->second;
  const bool outside =
      (place.minimum && number < *place.minimum) || (place.maximum && number > *place.maximum);
  return excepted || outside ? Verdict::outside : Verdict::allowed;
}

std::int64_t BlvRegisters::get(std::string_view name) const {
  const auto place = places_.find(name);
  return place == places_.end() ? 0 : number_in(pair(place->second.address), place->second.kind);
}

void BlvRegisters::set(std::string_view name, std::int64_t value) {
  const auto place = places_.find(name);
  if (place != places_.end()) {
    set_pair(place->second.address, static_cast<std::uint32_t>(value));
  }
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
    if (known.starts_with(fmt::format("{}.", name))) set_pair(place.address, 0);
  }
}

BlvRegisters::Pairs BlvRegisters::stored_part() const {
  Pairs stored;
  for (const auto& [name, place] : places_) {
    if (place.stored) stored[place.address] = pair(place.address);
  }
  return stored;
}

void BlvRegisters::load() {
  for (const auto& [address, raw] : stored_) set_pair(address, raw);
}

void BlvRegisters::initialize(Scope scope) {
  for (const auto& [name, place] : places_) {
    const bool kept = scope == Scope::without_communication && name.starts_with(communication);
    if (!place.stored || kept) continue;
    const std::uint32_t raw =
        (std::uint32_t{factory_[place.address]} << 16U) | factory_[place.address + 1U];
    set_pair(place.address, raw);
    stored_[place.address] = raw;
  }
}

void BlvRegisters::restart() {
  const Registers before = std::exchange(words_, factory_);
  load();
  for (const auto& [name, place] : places_) {
    if (!name.starts_with(alarm_history)) continue;
    words_[place.address] = before[place.address];
    words_[place.address + 1U] = before[place.address + 1U];
  }
}

}  // namespace spindle::sim
