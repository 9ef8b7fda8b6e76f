#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "register_bank.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::sim {

/// The events of a simulated device, by its profile: the block, its counter, the flag that reading
/// clears, and the clients that get frames unasked. A device whose events stand in no register
/// makes its frames itself. Keeps no reference to the profile.
class EventBlock {
 public:
  /// Who gets a frame that the device made.
  enum class Audience : std::uint8_t { armed, all };

  /// Without events nothing ever happens by itself. A tool with this firmware has the longest form
  /// of its block. `bank` must outlive it.
  EventBlock(const catalogue::Profile& profile, RegisterBank& bank, unsigned firmware = 0)
      : facts_(profile.events),
        bank_(&bank),
        count_(facts_ ? facts_->count_for(firmware) : std::uint16_t{0}) {
    if (facts_ && !facts_->first) own_.assign(facts_->count, 0);
  }

  /// Whether the product has a word for it.
  [[nodiscard]] bool knows(catalogue::EventKind kind) const;

  /// How often something has happened, as far as the device counts.
  [[nodiscard]] std::int64_t number() const { return facts_ ? get(facts_->number) : 0; }

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
  /// This client gets frames until then, or no longer.
  void arm_until(ConnectionId connection, TimePoint until) { armed_until_[connection] = until; }
  void disarm(ConnectionId connection) { armed_until_.erase(connection); }

  /// What a run-down came to, for the curves that are made up of it.
  struct Reached {
    float torque = 0;
    float angle = 0;  ///< degrees
  };
  /// Something happened of which the device made the block itself. What the block says of curves is
  /// filled in; they are there where a result is.
  void tell(Registers block, const std::optional<Reached>& result, Audience audience,
            TimePoint now);

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
  [[nodiscard]] const catalogue::Parameter* field(std::string_view name) const;
  [[nodiscard]] std::int64_t get(std::string_view name) const;
  void put(std::string_view name, std::int64_t value);
  void put_curves();
  [[nodiscard]] std::optional<Registers> block() const;
  [[nodiscard]] std::vector<modbus::Pdu> frames(bool has_curves) const;
  [[nodiscard]] std::vector<Bytes> samples(const Reached& result) const;
  void send(const modbus::Pdu& frame, Audience audience, TimePoint now);

  std::optional<catalogue::EventSpec> facts_;
  Registers own_ = {};               ///< the block where it has no place among the registers
  std::vector<Bytes> samples_ = {};  ///< of the last result, by channel
  RegisterBank* bank_;
  std::uint16_t count_;  ///< registers of the block
  std::set<ConnectionId> connected_ = {};
  std::map<ConnectionId, TimePoint> armed_until_ = {};
  std::vector<Push> pushes_ = {};
};

}  // namespace spindle::sim
