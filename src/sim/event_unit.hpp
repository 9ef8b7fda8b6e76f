#pragma once

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

/// The events of a simulated tool, by its profile: the block, its counter, the flag that reading
/// clears, and the clients that get frames unasked. Keeps no reference to the profile.
class EventUnit {
 public:
  /// Without events nothing ever happens.
  explicit EventUnit(const catalogue::Profile& profile) : facts_(profile.events) {}

  [[nodiscard]] const std::optional<catalogue::EventSpec>& facts() const { return facts_; }

  /// Whether the product has a word for it.
  [[nodiscard]] bool knows(catalogue::EventKind kind) const;

  /// How often something has happened, as far as the tool counts.
  [[nodiscard]] std::uint16_t number(const RegisterBank& bank) const;

  using Values = std::vector<std::pair<std::string, std::uint16_t>>;
  /// Something happens: it is counted, stands in the block, and is sent to those who are armed.
  void emit(catalogue::EventKind kind, const Values& values, RegisterBank& bank, TimePoint now);

  /// These registers were read: a flag among them is cleared.
  void note_read(const modbus::ReadRequest& wanted, RegisterBank& bank) const;

  /// Whether this holding register arms the output.
  [[nodiscard]] bool is_arming(std::uint16_t address) const {
    return facts_ && facts_->arm && facts_->arm->address == address;
  }
  /// Requires a register that arms. Other values than those for on and off do nothing.
  void arm(ConnectionId connection, std::uint16_t value, TimePoint now);

  /// The last event as a frame; empty when the product sends none.
  [[nodiscard]] std::optional<modbus::Pdu> frame(const RegisterBank& bank) const;

  std::vector<Push> take_pushes() { return std::exchange(pushes_, {}); }
  std::vector<Push> take_pushes(ConnectionId connection);
  /// A client is there. It gets frames from now on where nothing arms them.
  void connected(ConnectionId connection);
  void disconnected(ConnectionId connection);
  /// Nothing is armed any more, and events count from 0 again.
  void reboot(RegisterBank& bank);

 private:
  std::optional<catalogue::EventSpec> facts_;
  std::map<ConnectionId, TimePoint> armed_until_ = {};
  std::vector<Push> pushes_ = {};
};

}  // namespace spindle::sim
