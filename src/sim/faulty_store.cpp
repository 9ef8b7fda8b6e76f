#include "faulty_store.hpp"

#include <algorithm>

namespace spindle::sim {

bool FaultyStore::accept() {
  ++writes_;
  return struck(FaultKind::ignore_write) == nullptr;
}

void FaultyStore::store(const Place& place, RegisterView registers, RegisterBank& bank) const {
  bank.put(place, registers);
  if (const Fault* other = struck(FaultKind::store_other)) {
    bank.set_stored(place, bank.stored(place) + number_of(*other));
  }
  if (const Fault* reset = struck(FaultKind::reset_neighbour)) {
    bank.put(place.table, static_cast<std::uint16_t>(place.address + number_of(*reset)), 0);
  }
}

const Fault* FaultyStore::struck(FaultKind kind) const {
  const auto found = std::find_if(faults_.begin(), faults_.end(), [&](const Fault& fault) {
    return fault.kind == kind && fault.applies_to(writes_);
  });
  return found == faults_.end() ? nullptr : &*found;
}

}  // namespace spindle::sim
