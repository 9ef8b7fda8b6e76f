#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "motor.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/catalogue/run_facts.hpp"
#include "unit.hpp"

namespace spindle::sim {

/// A simulated device of any profile. Its actions show in the parameters that confirm them, and its
/// events say what the start state has for them. With the run model start-action a run that ends by
/// itself; with command-register a motor: a ramp of one second, status and monitors in their own
/// scales.
class ProfileUnit final : public Unit {
 public:
  ProfileUnit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
              std::uint8_t address, const DeviceOptions& options);

  void raise_alarm(std::int64_t code, TimePoint now) override;
  void raise_warning(std::int64_t code, TimePoint now) override;
  /// Parameters keep what was written; all else begins anew.
  void power_cycle(TimePoint now) override;

 private:
  /// What the motor is told to do.
  enum class Motion : std::uint8_t { stop, stop_at_once, forward, reverse };

  void before_read(TimePoint now) override;
  Outcome write(ConnectionId connection, const modbus::WriteMultipleRequest& request,
                TimePoint now) override;
  void on_write(const Place& place, std::int64_t raw, TimePoint now) override;
  [[nodiscard]] std::optional<TimePoint> next_step() const override { return run_end_; }
  void step(TimePoint now) override { end_run(catalogue::EventKind::fastening_ok, now); }
  void act(const catalogue::Action& action, std::int64_t raw, TimePoint now);
  void end_run(catalogue::EventKind result, TimePoint now);

  void drive(TimePoint now);
  [[nodiscard]] bool is_enabled() const;
  [[nodiscard]] Motion commanded() const;
  [[nodiscard]] std::int64_t wanted_speed() const;
  void show_speed(const std::string& name, TimePoint now);
  [[nodiscard]] std::int64_t status(TimePoint now) const;
  [[nodiscard]] std::uint32_t number(const std::string& name) const {
    return static_cast<std::uint32_t>(bank().get(name));
  }

  catalogue::List<catalogue::Action> actions_;
  catalogue::List<std::uint8_t> busy_codes_;
  TimePoint busy_until_ = TimePoint::min();
  catalogue::Text alarm_reset_;
  catalogue::Text alarm_ = {};  ///< parameter that shows the present alarm; empty: none does
  std::optional<catalogue::CommandRegisterSpec> run_ = std::nullopt;
  catalogue::Encoding step_ = {};  ///< what 1 of the motor's speed is
  catalogue::Text start_action_ = {};
  std::optional<TimePoint> run_end_ = std::nullopt;  ///< of a run that the action began
  Tables start_ = {};
  Motor motor_ = {};
  bool reverse_ = false;  ///< the way that it turned last
  bool stopped_ = false;  ///< by another register, until the next command
};

}  // namespace spindle::sim
