#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "blv_motor.hpp"
#include "blv_registers.hpp"
#include "bus_unit.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/modbus/pdu.hpp"

namespace spindle::sim {

/// One simulated BLV driver.
class BlvUnit final : public BusUnit {
 public:
  /// `configuring`: how long Configuration takes.
  BlvUnit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
          std::uint8_t address, Duration configuring);

  [[nodiscard]] std::uint8_t address() const override { return address_; }
  [[nodiscard]] std::int64_t group() const override;
  [[nodiscard]] Duration waiting_time() const override { return waiting_time_; }

  void advance(TimePoint now) override;
  [[nodiscard]] std::optional<TimePoint> next_change() const override;

  modbus::Pdu answer(const modbus::Pdu& request, TimePoint now) override;
  void hear_good_frame() override;
  void hear_bad_frame(TimePoint now) override;

  void raise_alarm(std::int64_t code, TimePoint now) override;
  void raise_warning(std::int64_t code, TimePoint now) override;
  void use_setter(TimePoint until) override { setter_until_ = until; }
  void power_cycle(TimePoint now) override;

 private:
  /// What refuses a request: the exception, and the code in the driver's own register.
  struct Refusal {
    modbus::ExceptionCode exception;
    std::int64_t code;
  };
  using Outcome = std::optional<Refusal>;
  using Handler = Outcome (BlvUnit::*)(TimePoint);
  struct Deed {
    std::uint16_t first;  ///< register of its value
    std::uint32_t value;
    Handler handler;
  };
  enum class Wish : std::uint8_t { forward, reverse, decelerate, brake };

  modbus::Pdu respond(const modbus::Pdu& request, TimePoint now);
  modbus::Pdu refuse(const modbus::Pdu& request, const Refusal& refusal);
  modbus::Pdu read(const modbus::Pdu& request, const modbus::ReadRequest& wanted, TimePoint now);
  Outcome write(std::uint16_t first, RegisterView values, TimePoint now);
  Outcome write_cell(const BlvRegisters::Cell& cell, std::uint32_t raw, TimePoint now);
  Outcome use(const Deed& deed, std::uint32_t before, std::uint32_t raw, TimePoint now);
  [[nodiscard]] Outcome check_busy(TimePoint now) const;
  void finish_configuration(TimePoint now);

  Outcome reset_alarm(TimePoint now);
  Outcome clear_alarm_history(TimePoint now);
  Outcome clear_warning_history(TimePoint now);
  Outcome clear_communication_history(TimePoint now);
  Outcome configure(TimePoint now);
  Outcome initialize(TimePoint now);
  Outcome initialize_all(TimePoint now);
  Outcome load(TimePoint now);
  Outcome save(TimePoint now);
  [[nodiscard]] Outcome check_at_rest(TimePoint now) const;
  [[nodiscard]] Outcome check_memory() const;
  void work(Duration time, TimePoint now) { memory_until_ = now + time; }
  [[nodiscard]] bool busy(TimePoint now) const {
    return now < memory_until_ || configured_at_.has_value();
  }

  void obey(TimePoint now);
  /// The command word in the bits of the default assignment. What an unknown function does is not
  /// simulated.
  [[nodiscard]] std::uint16_t standard_word() const;
  [[nodiscard]] Wish wish_of(std::uint32_t word) const;
  [[nodiscard]] std::int64_t speed_of(std::uint16_t operation) const;
  [[nodiscard]] Duration time_of(const std::string& pattern, std::uint16_t operation) const;
  void make_effective();
  void note_error(std::int64_t code);
  void show(TimePoint now);
  [[nodiscard]] std::uint32_t status_word(TimePoint now) const;
  [[nodiscard]] std::uint32_t mask_of(const std::string& parameter, std::string_view bit,
                                      std::optional<std::int64_t> mode) const;
  [[nodiscard]] std::optional<TimePoint> watchdog_due() const;

  std::uint8_t address_;
  catalogue::CommandWordSpec run_;
  catalogue::ExtendedErrorSpec refusals_;
  std::vector<catalogue::Parameter> words_;  ///< with the names of bits
  std::vector<std::int64_t> permanent_alarms_;
  std::uint16_t max_read_;
  std::uint16_t max_write_;
  BlvRegisters registers_;
  std::vector<Deed> deeds_ = {};
  std::int64_t load_ = 0;  ///< per cent, while the motor turns

  BlvMotor motor_ = {};
  std::int64_t mode_ = 0;    ///< in effect, whatever the register says by now
  std::int64_t analog_ = 0;  ///< likewise
  Duration waiting_time_ = {};
  std::int64_t bad_frames_ = 0;  ///< in a row
  Duration configuring_;
  TimePoint memory_until_ = TimePoint::min();              ///< works on the stored values
  std::optional<TimePoint> configured_at_ = std::nullopt;  ///< when Configuration will be done
  TimePoint setter_until_ = TimePoint::min();
  std::optional<TimePoint> last_query_ = std::nullopt;
};

}  // namespace spindle::sim
