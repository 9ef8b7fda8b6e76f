#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "motor.hpp"
#include "spindle/catalogue/profile.hpp"
#include "unit.hpp"

namespace spindle::sim {

/// A simulated BLV driver: registers 0000h-1FFFh as pairs, edges of maintenance commands, RAM and
/// non-volatile memory with S-BSY, ramps, watchdog 85h, bad frames 84h, histories, settings that
/// wait for Configuration.
class BlvUnit final : public Unit {
 public:
  BlvUnit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
          std::uint8_t address, const DeviceOptions& options);

  [[nodiscard]] std::int64_t group() const override;
  [[nodiscard]] Duration waiting_time() const override { return waiting_time_; }

  modbus::Pdu answer(ConnectionId connection, const modbus::Pdu& request, TimePoint now) override;
  void hear_good_frame() override;
  void hear_bad_frame(TimePoint now) override;

  void raise_alarm(std::int64_t code, TimePoint now) override;
  void raise_warning(std::int64_t code, TimePoint now) override;
  void use_setter(TimePoint until) override { setter_until_ = until; }
  void power_cycle(TimePoint now) override;

 private:
  using Handler = Outcome (BlvUnit::*)(TimePoint);
  /// A command that acts when its register changes to its value.
  struct EdgeCommand {
    std::uint16_t address;
    std::int64_t value;
    Handler handler;
  };
  /// What the bits of the command word ask of the motor.
  enum class Motion : std::uint8_t { forward, reverse, decelerate, brake };

  Outcome write(ConnectionId connection, const modbus::WriteMultipleRequest& request,
                TimePoint now) override;
  void on_write(const Place& place, std::int64_t raw, TimePoint now) override;
  void on_refusal(const Refusal& refused) override;
  void before_read(TimePoint now) override;
  [[nodiscard]] std::optional<TimePoint> next_step() const override;
  void step(TimePoint now) override;

  Outcome write_value(const Change& change, TimePoint now);
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

  void drive(TimePoint now);
  /// The command word in the bits of the default assignment. What an unknown function does is not
  /// simulated.
  [[nodiscard]] std::uint16_t standard_word() const;
  [[nodiscard]] Motion motion_of(std::uint32_t word) const;
  [[nodiscard]] std::int64_t speed_of(std::uint16_t operation) const;
  [[nodiscard]] Duration time_of(const std::string& pattern, std::uint16_t operation) const;
  void make_effective();
  void note_error(std::int64_t code);
  void push_history(std::string_view name, std::int64_t code);
  void clear_history(std::string_view name);
  [[nodiscard]] std::uint32_t status_word(TimePoint now) const;
  [[nodiscard]] std::uint32_t mask_of(const std::string& parameter, std::string_view bit,
                                      std::optional<std::int64_t> mode) const;
  [[nodiscard]] std::optional<TimePoint> watchdog_due() const;

  catalogue::CommandWordSpec run_;
  catalogue::ExtendedErrorSpec refusals_;
  std::vector<catalogue::Parameter> words_ = {};  ///< with the names of bits
  std::vector<EdgeCommand> commands_ = {};
  std::set<std::uint16_t> operation_ = {};  ///< where commands and operation data stand
  Tables factory_ = {};
  Tables stored_ = {};     ///< what the non-volatile memory holds
  std::int64_t load_ = 0;  ///< per cent, while the motor turns

  Duration configuring_;
  Motor motor_ = {};
  std::int64_t mode_ = 0;    ///< in effect, whatever the register says by now
  std::int64_t analog_ = 0;  ///< likewise
  Duration waiting_time_ = {};
  std::int64_t bad_frames_ = 0;                            ///< in a row
  TimePoint memory_until_ = TimePoint::min();              ///< works on the stored values
  std::optional<TimePoint> configured_at_ = std::nullopt;  ///< when Configuration will be done
  TimePoint setter_until_ = TimePoint::min();
  std::optional<TimePoint> last_query_ = std::nullopt;
};

}  // namespace spindle::sim
