#include "spindle/catalogue/event_layout.hpp"

#include <algorithm>
#include <array>

namespace spindle::catalogue {
namespace {

/// Keys of an event's record that are no registers.
constexpr std::array<std::string_view, 15> reserved_keys = {
    "schema", "type", "time", "target", "serial",     "epoch",       "id",        "kind",
    "source", "raw",  "text", "result", "remembered", "torque_unit", "error_text"};

/// The last word of a name; the whole name where that is not clear.
void name_keys(std::vector<EventLayout::Field>& fields) {
  const auto last_word = [](const std::string& name) { return name.substr(name.rfind('.') + 1); };
  std::vector<std::string> words;
  for (const auto& field : fields) words.push_back(last_word(field.parameter->name));
  // What no block has both of may have the same key.
  const auto is_taken = [&](std::size_t index) {
    for (std::size_t other = 0; other < fields.size(); ++other) {
      const bool meet = fields[other].form == fields[index].form || fields[other].form == 0 ||
                        fields[index].form == 0;
      if (other != index && meet && words[other] == words[index]) return true;
    }
    return false;
  };
  for (std::size_t index = 0; index < fields.size(); ++index) {
    auto& field = fields[index];
    std::string key = words[index];
    std::replace(key.begin(), key.end(), '-', '_');
    const bool is_reserved =
        std::find(reserved_keys.begin(), reserved_keys.end(), key) != reserved_keys.end();
    const bool is_number = key.find_first_not_of("0123456789") == std::string::npos;
    if (is_reserved || is_number || is_taken(index)) key = field.parameter->name;
    std::replace(key.begin(), key.end(), '-', '_');
    std::replace(key.begin(), key.end(), '.', '_');
    field.key = std::move(key);
  }
}

}  // namespace

EventLayout::EventLayout(const Profile& profile) : facts_(&*profile.events) {
  if (!facts_->first) {
    for (const Parameter& field : facts_->fields) add(field, field.address.value, 0);
  } else {
    const auto table = table_of(*facts_);
    for (const Parameter& parameter : profile.parameters) {
      const std::uint16_t address = parameter.address.value;
      const EventForm* form = facts_->form_of(parameter);
      const std::size_t form_count = form == nullptr ? std::size_t{0} : form->count;
      const std::size_t count = form == nullptr ? facts_->count : form->count;
      const bool inside =
          parameter.table == table && address >= *facts_->first && address < *facts_->first + count;
      if (inside) add(parameter, static_cast<std::size_t>(address - *facts_->first), form_count);
    }
  }
  name_keys(fields_);
  if (const Field* unit = find(facts_->torque_unit)) {
    torque_unit_ = static_cast<std::size_t>(unit - fields_.data());
  }
  if (facts_->curves) note_curves(*facts_->curves);
}

void EventLayout::note_curves(const CurveSpec& curves) {
  const auto note = [this](std::string_view name) {
    if (const Field* field = find(name)) curve_registers_.push_back(field->at);
  };
  for (const CurveChannel& channel : curves.channels) {
    note(channel.type);
    note(channel.count);
  }
  note(curves.sampling);
  for (std::size_t at = 0; at < 2 * std::size_t{curves.steps}; ++at) {
    curve_registers_.push_back(curves.first_step + at);
  }
}

void EventLayout::add(const Parameter& parameter, std::size_t at, std::size_t form) {
  fields_.push_back({&parameter, at, {}, form});
  if (parameter.name == facts_->number) number_at_ = at;
  if (parameter.name == facts_->kind) kind_at_ = at;
  if (parameter.name == facts_->preset) preset_at_ = at;
  const auto& identity = facts_->identity;
  if (std::find(identity.begin(), identity.end(), parameter.name) != identity.end()) {
    identity_.emplace_back(at, register_count(parameter.encoding));
  }
}

const EventLayout::Field* EventLayout::find(std::string_view name) const {
  const auto found = std::find_if(fields_.begin(), fields_.end(), [&](const Field& field) {
    return field.parameter->name.view() == name;
  });
  return found == fields_.end() ? nullptr : &*found;
}

Registers EventLayout::key_of(RegisterView block) const {
  Registers key;
  bool says_anything = false;
  for (const auto& [first, size] : identity_) {
    const RegisterView part = block.subspan(first, size);
    says_anything |= std::any_of(part.begin(), part.end(), [](auto word) { return word != 0; });
    key.insert(key.end(), part.begin(), part.end());
  }
  if (says_anything) {
    key.push_back(number_of(block));
    return key;
  }
  key.assign(block.begin(), block.end());
  for (const std::size_t at : curve_registers_) key[at] = 0;
  return key;
}

std::string EventLayout::torque_unit_of(RegisterView block, std::string_view of_tool) const {
  if (!torque_unit_) return std::string(of_tool);
  const Field& field = fields_[*torque_unit_];
  const auto& labels = field.parameter->labels;
  const auto label = std::find_if(labels.begin(), labels.end(),
                                  [&](const Label& one) { return one.number == block[field.at]; });
  return label == labels.end() ? std::string() : label->text.to_string();
}

std::optional<EventKind> EventLayout::kind_of(RegisterView block) const {
  const EventKind* known = facts_->kinds.find(block[kind_at_]);
  return known == nullptr ? std::nullopt : std::optional(*known);
}

}  // namespace spindle::catalogue
