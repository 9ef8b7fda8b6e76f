#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spindle/catalogue/profile.hpp"

namespace spindle::catalogue {

/// What a write to a parameter may do beyond storing a value.
struct Danger {
  Hazard hazard = Hazard::none;  ///< the gravest of what its registers may do; never `none`
  std::string action = {};       ///< the action that writes one of its registers; may be empty
  bool runs_motor = false;       ///< one of its registers commands a motor
  bool is_guarded = false;       ///< what it may start is started by the profile's `run`

  /// What may happen, as half a sentence: "it may start the motor".
  [[nodiscard]] std::string effect() const;
  /// The verb that does it safely, as a whole sentence; empty where the profile has none.
  [[nodiscard]] std::string remedy() const;
};

/// All registers of a profile that are no settings: those of parameters that declare a hazard, of
/// actions that have one or that act on a change (`rest`), and those that command a motor.
class Dangers {
 public:
  explicit Dangers(const Profile& profile);

  /// Whether a parameter, be it named, numbered or raw, shares one of these registers. Such a
  /// parameter is in no backup, and neither `set` nor `restore` writes it.
  [[nodiscard]] std::optional<Danger> find(const Parameter& parameter) const;

 private:
  struct Source {
    modbus::RegisterTable table;
    unsigned first;
    unsigned end;
    Danger danger;
  };
  void add(modbus::RegisterTable table, modbus::RegisterAddress address, const Encoding& encoding,
           Danger danger);

  std::vector<Source> sources_ = {};
};

/// The same for one parameter.
std::optional<Danger> danger_of(const Parameter& parameter, const Profile& profile);

/// Whether an action begins a motion that the profile gives no way to end.
bool moves_without_end(const Action& action);

}  // namespace spindle::catalogue
