#include "event_block.hpp"

#include <algorithm>
#include <iterator>

#include "spindle/modbus/pdu.hpp"

namespace spindle::sim {

bool EventBlock::knows(catalogue::EventKind kind) const {
  return facts_ && std::any_of(facts_->kinds.begin(), facts_->kinds.end(),
                               [kind](const auto& entry) { return entry.value == kind; });
}

void EventBlock::emit(catalogue::EventKind kind, const Values& values, TimePoint now) {
  if (!facts_) return;
  const auto row = std::find_if(facts_->kinds.begin(), facts_->kinds.end(),
                                [kind](const auto& entry) { return entry.value == kind; });
  for (const auto& [name, value] : values) bank_->set(name, value);
  bank_->set(facts_->number, number() + 1);
  bank_->set(facts_->kind, row == facts_->kinds.end() ? 0 : row->key);
  bank_->set(facts_->flag, 1);
  const auto pushed = frame();
  if (!pushed) return;
  for (const auto& [connection, until] : armed_until_) {
    if (now < until) pushes_.push_back({connection, *pushed});
  }
}

void EventBlock::arm(ConnectionId connection, std::int64_t value, TimePoint now) {
  const catalogue::Arming& arming = *facts_->arm;
  if (value == arming.value) {
    const bool expires = arming.expires > Duration::zero();
    armed_until_[connection] = expires ? now + arming.expires : TimePoint::max();
  } else if (value == arming.disarm) {
    armed_until_.erase(connection);
  }
}

std::optional<modbus::Pdu> EventBlock::frame() const {
  if (!facts_ || facts_->model != catalogue::EventModel::push) return std::nullopt;
  const auto table = catalogue::table_of(*facts_);
  const auto block = bank_->read(table, facts_->first, facts_->count);
  if (!block) return std::nullopt;
  return modbus::read_response(table, *block);
}

std::vector<Push> EventBlock::take_pushes(ConnectionId connection) {
  const auto others = std::stable_partition(
      pushes_.begin(), pushes_.end(),
      [connection](const Push& push) { return push.connection == connection; });
  std::vector<Push> taken(std::make_move_iterator(pushes_.begin()),
                          std::make_move_iterator(others));
  pushes_.erase(pushes_.begin(), others);
  return taken;
}

void EventBlock::connected(ConnectionId connection) {
  disconnected(connection);
  if (facts_ && !facts_->arm) armed_until_[connection] = TimePoint::max();
}

void EventBlock::disconnected(ConnectionId connection) {
  armed_until_.erase(connection);
  static_cast<void>(take_pushes(connection));
}

void EventBlock::restart() {
  armed_until_.clear();
  pushes_.clear();
  if (facts_) bank_->set(facts_->number, 0);
}

}  // namespace spindle::sim
