#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "bm_motion.hpp"
#include "gen2_event.hpp"
#include "spindle/catalogue/profile.hpp"
#include "unit.hpp"

namespace spindle::sim {

/// Whether a profile is of screwdrivers with firmware 4000 or later.
bool is_gen2(const catalogue::Profile& profile);

/// A simulated screwdriver with firmware 4000 or later: its identity in texts, live status in
/// floating-point numbers, a run-down with ramping torque, and events that are pushed as 107
/// registers. Answers as unit 1 whatever unit is asked. A direction that is written while the
/// spindle turns, or runs down, is echoed and not taken.
class Gen2Unit final : public Unit {
 public:
  /// Requires a profile that is_gen2().
  Gen2Unit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
           std::uint8_t address, const DeviceOptions& options);

  [[nodiscard]] modbus::UnitId answers_as(modbus::UnitId /*asked*/) const override { return {1}; }

  /// The operator pulls the trigger. Ignored while the tool runs, is locked, has an alarm or no
  /// preset.
  bool operate(Rundown outcome, unsigned results, TimePoint now) override;
  /// Of a barcode: the operator scans another one.
  void happen(catalogue::EventKind kind, TimePoint now) override;
  /// A run ends, and starts are ignored until the tool is switched off and on.
  void raise_alarm(std::int64_t code, TimePoint now) override;
  void raise_warning(std::int64_t /*code*/, TimePoint /*now*/) override {}
  /// No motion, alarm or armed output; events count from 0 again. Settings stay.
  void power_cycle(TimePoint now) override;

 private:
  /// What an event is of, by the number that the tool has for it.
  enum class Status : std::uint16_t {
    other = 0,
    fastening_ok = 1,
    fastening_ng = 2,
    direction_change = 3,
    preset_change = 4,
    alarm_reset = 5,
    error = 6,
    barcode = 7,
    screw_count = 8,
  };
  struct Run {
    RunPlan plan;
    TimePoint begin;
    TimePoint end;
    unsigned results;  ///< events that its end brings
  };
  /// What of an event is not the tool's present state.
  struct Result {
    std::uint16_t time = 0;  ///< ms
    Motion motion = {};
    std::uint16_t speed = 0;
    std::uint16_t error = 0;
  };

  void before_read(TimePoint now) override;
  Outcome write(ConnectionId connection, const modbus::WriteMultipleRequest& request,
                TimePoint now) override;
  void on_write(const Place& place, std::int64_t raw, TimePoint now) override;
  [[nodiscard]] std::optional<TimePoint> next_step() const override;
  void step(TimePoint now) override { finish_run(now); }

  void begin_identity(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
                      const DeviceOptions& options);
  [[nodiscard]] bool can_start() const;
  [[nodiscard]] RunPlan plan_run() const;
  void finish_run(TimePoint now);
  void count_screw();
  void show_ready();
  void emit(Status status, const Result& result, TimePoint now);
  [[nodiscard]] Gen2Event::Date date_at(TimePoint now);
  [[nodiscard]] const Fault* struck(FaultKind kind) const;

  [[nodiscard]] std::uint16_t word(std::string_view name) const {
    return static_cast<std::uint16_t>(bank().get(name));
  }
  [[nodiscard]] std::string preset_name(std::string_view field) const;
  /// A floating-point number in hundredths.
  [[nodiscard]] std::uint16_t hundredths(std::string_view name) const;
  [[nodiscard]] float real(std::string_view name) const;
  /// A floating-point number of so many hundredths.
  void show(std::string_view name, std::uint16_t steps);
  void put_text(std::string_view name, std::string text);

  catalogue::Action start_;
  catalogue::Action direction_;
  std::optional<catalogue::Action> output_ = std::nullopt;
  FaultPlan faults_;
  std::uint16_t stopped_error_;
  std::uint16_t screws_;  ///< in a new batch
  std::uint16_t number_;  ///< of the last event
  std::uint32_t events_told_ = 0;
  unsigned scans_ = 0;
  std::string barcode_;
  std::optional<TimePoint> switched_on_ = std::nullopt;
  std::optional<Run> run_ = std::nullopt;
  TimePoint still_from_ = TimePoint::min();  ///< the spindle runs down until then
  bool torque_is_no_number_ = false;
};

}  // namespace spindle::sim
