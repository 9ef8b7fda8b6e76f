#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "blv_motor.hpp"
#include "blv_registers.hpp"
#include "bus_unit.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/catalogue/run_facts.hpp"

namespace spindle::sim {

/// A simulated device of any profile: its registers with their limits, exceptions and start values
/// (those of the profile's simulation, else the default, the least value or 0). With the run model
/// command-register also a motor: a ramp of one second, status and monitors in their own scales.
class ProfileUnit final : public BusUnit {
 public:
  /// `identity`: the bytes of its answer to FC 11h; empty: it has none.
  ProfileUnit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
              std::uint8_t address, Bytes identity);

  [[nodiscard]] std::uint8_t address() const override { return address_; }
  void advance(TimePoint /*now*/) override {}
  [[nodiscard]] std::optional<TimePoint> next_change() const override { return std::nullopt; }
  modbus::Pdu answer(const modbus::Pdu& request, TimePoint now) override;
  void raise_alarm(std::int64_t code, TimePoint now) override;
  void raise_warning(std::int64_t code, TimePoint now) override;
  void power_cycle(TimePoint now) override;

 private:
  using Refusal = std::optional<std::uint8_t>;  ///< exception code; empty: it is done
  /// What the motor is told to do.
  enum class Wish : std::uint8_t { stop, stop_at_once, forward, reverse };

  modbus::Pdu respond(const modbus::Pdu& request, TimePoint now);
  modbus::Pdu read(const modbus::Pdu& request, const modbus::ReadRequest& wanted, TimePoint now);
  Refusal write(std::uint16_t first, RegisterView values, TimePoint now);
  void act_on(const BlvRegisters::Cell& cell, std::uint32_t raw, TimePoint now);

  void begin_stopped();
  [[nodiscard]] bool is_enabled() const;
  [[nodiscard]] Wish wish() const;
  [[nodiscard]] std::int64_t wanted_speed() const;
  void obey(TimePoint now);
  void show(TimePoint now);
  void show_speed(const std::string& name, TimePoint now);
  [[nodiscard]] std::int64_t status(TimePoint now) const;
  [[nodiscard]] const catalogue::Parameter* find(const std::string& name) const;
  [[nodiscard]] std::uint32_t number(const std::string& name) const;

  std::uint8_t address_;
  std::vector<catalogue::Parameter> parameters_;  ///< those that `run` names
  std::optional<catalogue::CommandRegisterSpec> run_ = std::nullopt;
  std::optional<catalogue::Action> alarm_reset_ = std::nullopt;
  catalogue::List<std::int64_t> permanent_alarms_;
  std::uint8_t limit_exception_;
  std::uint16_t max_read_;
  std::uint16_t max_write_;
  bool loopback_;
  Bytes identity_;
  BlvRegisters registers_;
  BlvMotor motor_ = {};
  bool reverse_ = false;  ///< the way that it turned last
  bool stopped_ = false;  ///< by another register, until the next command
};

}  // namespace spindle::sim
