#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "spindle/catalogue/profile.hpp"
#include "spindle/sim/raised.hpp"
#include "spindle/sim/server.hpp"

namespace spindle::sim {

/// Whether a driver stays silent when the line was not silent for long enough before a query.
enum class Gaps : std::uint8_t { enforced, ignored };

/// What `spindle simulate` and tests may change on simulated BLV drivers.
struct BlvOptions {
  std::vector<std::uint8_t> units = {1};  ///< addresses on the bus, 1–31, each once
  unsigned baud = 0;                      ///< decides the gap; 0: the profile's
  Gaps gaps = Gaps::enforced;
  /// How long Configuration takes: a sibling's manual (AR p.257) says one second or less, and the
  /// maker's own programs go on 30 ms behind it. Commands and operation data are taken meanwhile.
  Duration configuring = std::chrono::milliseconds(200);
  std::vector<Raised> alarms = {};    ///< of every unit
  std::vector<Raised> warnings = {};  ///< of every unit
};

/// Several simulated BLV motor drivers on one RS-485 line: registers 0000h–1FFFh as pairs, edges of
/// maintenance commands, RAM and non-volatile memory with S-BSY, ramps, watchdog 85h, bad frames
/// 84h, histories, broadcast and groups, settings that wait for Configuration. All registers, words
/// and start values come from the profile, so it shares the catalogue's misreadings; independent
/// peers are the judge. A unit that is not on the bus is met with silence.
class BlvBus : public Server {
 public:
  /// An alarm occurs: the motor coasts, and run commands are ignored until the reset.
  virtual void raise_alarm(std::uint8_t unit, std::uint8_t code, TimePoint now) = 0;

  /// A warning begins; 0 ends it.
  virtual void raise_warning(std::uint8_t unit, std::uint8_t code, TimePoint now) = 0;

  /// A user works with the hand-held setter: writes are refused with 89h until then.
  virtual void use_setter(std::uint8_t unit, TimePoint until) = 0;

  /// All units are switched off and on.
  void reboot(TimePoint now) override = 0;

  /// Power off and on: RAM is what the non-volatile memory holds, the rest begins anew; the alarm
  /// history stays.
  virtual void power_cycle(std::uint8_t unit, TimePoint now) = 0;
};

/// Devices of any profile: registers with limits, exceptions and start values; with the run model
/// command-register also their motor. Over TCP there is one, which answers to any unit.
std::unique_ptr<BlvBus> make_profile_bus(const catalogue::Profile& profile,
                                         const catalogue::SimulationSpec& start,
                                         const BlvOptions& options, const Bytes& identity);

/// Requires a profile with the run model command-word.
std::unique_ptr<BlvBus> make_blv_bus(const catalogue::Profile& profile,
                                     const catalogue::SimulationSpec& start,
                                     const BlvOptions& options);

}  // namespace spindle::sim
