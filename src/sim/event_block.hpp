#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "register_bank.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::sim {

/// The events of a simulated device, by its profile: the block, its counter, the flag that reading
/// clears, and the clients that get frames unasked. Keeps no reference to the profile.
class EventBlock {
 public:
  /// Without events nothing ever happens. `bank` must outlive it.
  EventBlock(const catalogue::Profile& profile, RegisterBank& bank)
      : facts_(profile.events), bank_(&bank) {}

  /// Whether the product has a word for it.
  [[nodiscard]] bool knows(catalogue::EventKind kind) const;

  /// How often something has happened, as far as the device counts.
  [[nodiscard]] std::int64_t number() const { return facts_ ? bank_->get(facts_->number) : 0; }

  using Values = std::vector<std::pair<std::string, std::int64_t>>;
  /// Something happens: it is counted, stands in the block, and is sent to those who are armed.
  void emit(catalogue::EventKind kind, const Values& values, TimePoint now);

  /// Whether this value arms the output.
  [[nodiscard]] bool is_arming(const Place& place) const {
    return facts_ && facts_->arm && place.table == modbus::RegisterTable::holding &&
           facts_->arm->address == place.address;
  }
  /// Requires a register that arms. Other values than those for on and off do nothing.
  void arm(ConnectionId connection, std::int64_t value, TimePoint now);

  /// The last event as a frame; empty when the product sends none.
  [[nodiscard]] std::optional<modbus::Pdu> frame() const;

  std::vector<Push> take_pushes() { return std::exchange(pushes_, {}); }
  std::vector<Push> take_pushes(ConnectionId connection);
  /// A client is there. It gets frames from now on where nothing arms them.
  void connected(ConnectionId connection);
  void disconnected(ConnectionId connection);
  /// Nothing is armed any more, and events count from 0 again.
  void restart();

 private:
  std::optional<catalogue::EventSpec> facts_;
  RegisterBank* bank_;
  std::map<ConnectionId, TimePoint> armed_until_ = {};
  std::vector<Push> pushes_ = {};
};

}  // namespace spindle::sim
