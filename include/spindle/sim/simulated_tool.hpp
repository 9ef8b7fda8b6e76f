#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "spindle/catalogue/profile.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/sim/raised.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::sim {

/// What `spindle simulate` and tests may change on simulated devices. What a device has no use for
/// does nothing.
struct DeviceOptions {
  std::vector<std::uint8_t> units = {1};  ///< addresses on a serial line, each once
  unsigned baud = 0;                      ///< decides the gap; 0: the profile's
  /// How long Configuration takes: a sibling's manual (AR p.257) says one second or less, and the
  /// maker's own programs go on 30 ms behind it. Commands and operation data are taken meanwhile.
  Duration configuring = std::chrono::milliseconds(200);

  std::optional<std::size_t> identity_bytes = std::nullopt;  ///< empty: the profile's
  std::optional<std::uint16_t> firmware = std::nullopt;
  std::optional<std::uint32_t> serial =
      std::nullopt;  ///< as printed, in every form of the identity
  std::optional<std::uint16_t> tool_model = std::nullopt;
  std::optional<std::uint16_t> event_number =
      std::nullopt;  ///< of the last event; empty: profile's

  /// Only those that concern the device: ignore_write, store_other, reset_neighbour. They count
  /// accepted writes from 1; zero_date and not_a_number count events.
  FaultPlan faults = {};
  /// An operator who runs down a screw at this interval, beginning one interval after the first
  /// advance(); empty: no operator.
  std::optional<Duration> rundown_every = std::nullopt;
  unsigned ng_every = 0;  ///< every so many of the operator's run-downs end NG; 0: none
  unsigned burst = 1;     ///< results that each of the operator's run-downs brings, all at once

  std::vector<Raised> alarms = {};    ///< of every unit
  std::vector<Raised> warnings = {};  ///< of every unit
};

/// How a run-down by the tool's own trigger ends: at the target, or released before it.
enum class Rundown : std::uint8_t { ok, ng };

/// Simulated devices of one profile on a serial line, or one on a network, which answers to any
/// unit. A unit that is not on the line is met with silence. All registers, scales and start values
/// come from the profile, so they share the catalogue's misreadings; independent peers are the
/// judge.
class SimulatedBus : public Server {
 public:
  /// The operator pulls the trigger of each tool.
  virtual void operator_rundown(Rundown outcome, TimePoint now) = 0;

  /// An event occurs on each device.
  virtual void happen(catalogue::EventKind kind, TimePoint now) = 0;

  /// An alarm occurs: what moves comes to a stop, and starts are ignored until the reset.
  virtual void raise_alarm(std::uint8_t unit, std::uint16_t code, TimePoint now) = 0;

  /// A warning begins; 0 ends it.
  virtual void raise_warning(std::uint8_t unit, std::uint16_t code, TimePoint now) = 0;

  /// A user works with the hand-held setter: writes are refused until then.
  virtual void use_setter(std::uint8_t unit, TimePoint until) = 0;

  /// Power off and on: what is not stored begins anew.
  virtual void power_cycle(std::uint8_t unit, TimePoint now) = 0;

  /// All units are switched off and on.
  void reboot(TimePoint now) override = 0;
};

/// What the simulated tool of a profile can do. An option that asks for more would do nothing.
struct Abilities {
  bool identity = false;       ///< it answers what it is
  bool operated = false;       ///< an operator drives screws, and it may spoil what is written
  bool pushes = false;         ///< it sends frames unasked
  bool dated = false;          ///< its events have a date, and torques that are floating-point
  bool configuration = false;  ///< it configures itself, and is busy with that
  bool alarms = false;
  bool warnings = false;
};
Abilities abilities_of(const catalogue::Profile& profile);

/// The devices that a profile describes: drivers that follow a command word, screwdrivers that are
/// started by an action and send their results, or else what registers, events and the motor of a
/// command register make of it.
std::unique_ptr<SimulatedBus> make_simulated_bus(const catalogue::Profile& profile,
                                                 const catalogue::SimulationSpec& start,
                                                 const DeviceOptions& options);

}  // namespace spindle::sim
