#include "spindle/catalogue/event_layout.hpp"

namespace spindle::catalogue {

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
  }
}

std::optional<EventKind> EventLayout::kind_of(RegisterView block) const {
  const EventKind* known = facts_->kinds.find(block[kind_at_]);
  return known == nullptr ? std::nullopt : std::optional(*known);
}

}  // namespace spindle::catalogue
