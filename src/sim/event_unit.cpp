#include "event_unit.hpp"

#include <algorithm>
#include <iterator>

#include "spindle/modbus/pdu.hpp"

namespace spindle::sim {

bool EventUnit::knows(catalogue::EventKind kind) const {
  return facts_ && std::any_of(facts_->kinds.begin(), facts_->kinds.end(),
                               [kind](const auto& entry) { return entry.value == kind; });
}

std::uint16_t EventUnit::number(const RegisterBank& bank) const {
  return facts_ ? bank.get(facts_->number) : std::uint16_t{0};
}

void EventUnit::emit(catalogue::EventKind kind, const Values& values, RegisterBank& bank,
                     TimePoint now) {
  if (!facts_) return;
  const auto row = std::find_if(facts_->kinds.begin(), facts_->kinds.end(),
                                [kind](const auto& entry) { return entry.value == kind; });
  const std::int64_t value = row == facts_->kinds.end() ? 0 : row->key;
  for (const auto& [name, word] : values) bank.set(name, word);
  bank.set(facts_->number, static_cast<std::uint16_t>(number(bank) + 1U));
  bank.set(facts_->kind, static_cast<std::uint16_t>(value));
  bank.set(facts_->flag, 1);
  const auto pushed = frame(bank);
  if (!pushed) return;
  for (const auto& [connection, until] : armed_until_) {
    if (now < until) pushes_.push_back({connection, *pushed});
  }
}

void EventUnit::note_read(const modbus::ReadRequest& wanted, RegisterBank& bank) const {
  if (!facts_ || facts_->flag.empty()) return;
  const auto flag = bank.place_of(facts_->flag);
  if (!flag || flag->first != wanted.table) return;
  const std::uint16_t address = flag->second;
  if (address >= wanted.first.value && address - wanted.first.value < wanted.count) {
    bank.set(facts_->flag, 0);
  }
}

void EventUnit::arm(ConnectionId connection, std::uint16_t value, TimePoint now) {
  const catalogue::Arming& arming = *facts_->arm;
  if (value == arming.value) {
    const bool expires = arming.expires > Duration::zero();
    armed_until_[connection] = expires ? now + arming.expires : TimePoint::max();
  } else if (value == arming.disarm) {
    armed_until_.erase(connection);
  }
}

std::optional<modbus::Pdu> EventUnit::frame(const RegisterBank& bank) const {
  if (!facts_ || facts_->model != catalogue::EventModel::push) return std::nullopt;
  const auto table = catalogue::table_of(*facts_);
  const auto block = bank.read(table, facts_->first, facts_->count);
  if (!block) return std::nullopt;
  return modbus::read_response(table, *block);
}

std::vector<Push> EventUnit::take_pushes(ConnectionId connection) {
  const auto others = std::stable_partition(
      pushes_.begin(), pushes_.end(),
      [connection](const Push& push) { return push.connection == connection; });
  std::vector<Push> taken(std::make_move_iterator(pushes_.begin()),
                          std::make_move_iterator(others));
  pushes_.erase(pushes_.begin(), others);
  return taken;
}

void EventUnit::connected(ConnectionId connection) {
  disconnected(connection);
  if (facts_ && !facts_->arm) armed_until_[connection] = TimePoint::max();
}

void EventUnit::disconnected(ConnectionId connection) {
  armed_until_.erase(connection);
  static_cast<void>(take_pushes(connection));
}

void EventUnit::reboot(RegisterBank& bank) {
  armed_until_.clear();
  pushes_.clear();
  if (facts_) bank.set(facts_->number, 0);
}

}  // namespace spindle::sim
