#include "spindle/catalogue/event_layout.hpp"

#include <algorithm>
#include <array>
#include <map>

namespace spindle::catalogue {
namespace {

/// Keys of an event's record that are no registers.
constexpr std::array<std::string_view, 15> reserved_keys = {
    "schema", "type", "time", "target", "serial",     "epoch",       "id",        "kind",
    "source", "raw",  "text", "result", "remembered", "torque_unit", "error_text"};

/// The last word of a name; the whole name where that is not clear.
void name_keys(std::vector<EventLayout::Field>& fields) {
  std::map<std::string, std::size_t> taken;
  const auto last_word = [](const std::string& name) { return name.substr(name.rfind('.') + 1); };
  for (const auto& field : fields) ++taken[last_word(field.parameter->name)];
  for (auto& field : fields) {
    std::string key = last_word(field.parameter->name);
    const bool is_reserved =
        std::find(reserved_keys.begin(), reserved_keys.end(), key) != reserved_keys.end();
    const bool is_number = key.find_first_not_of("0123456789") == std::string::npos;
    if (is_reserved || is_number || taken[key] > 1) key = field.parameter->name;
    std::replace(key.begin(), key.end(), '-', '_');
    std::replace(key.begin(), key.end(), '.', '_');
    field.key = std::move(key);
  }
}

}  // namespace

EventLayout::EventLayout(const Profile& profile) : facts_(&*profile.events) {
  const auto table = table_of(*facts_);
  for (const Parameter& parameter : profile.parameters) {
    const std::uint16_t address = parameter.address.value;
    const bool inside = parameter.table == table && address >= facts_->first &&
                        address < facts_->first + facts_->count;
    if (!inside) continue;
    const auto at = static_cast<std::size_t>(address - facts_->first);
    fields_.push_back({&parameter, at});
    if (parameter.name == facts_->number) number_at_ = at;
    if (parameter.name == facts_->kind) kind_at_ = at;
    if (parameter.name == facts_->preset) preset_at_ = at;
  }
  name_keys(fields_);
}

std::optional<EventKind> EventLayout::kind_of(RegisterView block) const {
  const EventKind* known = facts_->kinds.find(block[kind_at_]);
  return known == nullptr ? std::nullopt : std::optional(*known);
}

}  // namespace spindle::catalogue
