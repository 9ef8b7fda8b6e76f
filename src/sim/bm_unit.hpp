#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "bm_motion.hpp"
#include "spindle/catalogue/profile.hpp"
#include "unit.hpp"

namespace spindle::sim {

/// A simulated BM/BMT screwdriver: live status, remote inputs with the sibling's mapping, a
/// run-down with ramping torque, alarms. Its remote inputs are echoed whatever is written to them,
/// and cannot be read.
class BmUnit final : public Unit {
 public:
  /// Requires a profile with events.
  BmUnit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
         std::uint8_t address, const DeviceOptions& options);

  /// The operator pulls the trigger. Ignored while the tool runs, is locked or has an alarm.
  bool operate(Rundown outcome, unsigned results, TimePoint now) override;
  /// A run ends, `error` is sent as event, starts are ignored until the reset.
  void raise_alarm(std::int64_t code, TimePoint now) override;
  void raise_warning(std::int64_t /*code*/, TimePoint /*now*/) override {}
  /// No motion, alarm, lock or armed output; events count from 0 again. Parameters stay.
  void power_cycle(TimePoint now) override;

 private:
  using Handler = void (BmUnit::*)(const catalogue::Action&, std::uint16_t, TimePoint);
  struct RemoteInput {
    catalogue::Action action;
    Handler handler;
  };
  struct Run {
    RunPlan plan;
    TimePoint begin;
    TimePoint end;
    unsigned results;  ///< events that its end brings
  };
  /// Fields of an event that are not the tool's present state.
  struct EventData {
    std::uint16_t fastening_time = 0;
    Motion motion = {};
    std::uint16_t speed = 0;
    std::uint16_t error = 0;
  };

  void before_read(TimePoint now) override;
  void on_write(const Place& place, std::int64_t raw, TimePoint now) override;
  [[nodiscard]] std::optional<TimePoint> next_step() const override;
  void step(TimePoint now) override { finish_run(now); }

  void put_barcode();
  void reset_alarm(const catalogue::Action& action, std::uint16_t value, TimePoint now);
  void lock(const catalogue::Action& action, std::uint16_t value, TimePoint now);
  void start_or_stop(const catalogue::Action& action, std::uint16_t value, TimePoint now);
  void select_preset(const catalogue::Action& action, std::uint16_t value, TimePoint now);
  void select_direction(const catalogue::Action& action, std::uint16_t value, TimePoint now);

  [[nodiscard]] bool can_start() const;
  [[nodiscard]] std::uint16_t word(std::string_view name) const {
    return static_cast<std::uint16_t>(bank().get(name));
  }
  [[nodiscard]] std::uint16_t preset_field(std::string_view field) const;
  [[nodiscard]] RunPlan plan_run() const;
  void finish_run(TimePoint now);
  void count_screw();
  void show_ready();
  void emit(catalogue::EventKind kind, const EventData& data, TimePoint now);

  std::vector<RemoteInput> inputs_ = {};
  std::uint16_t stopped_error_;
  std::uint16_t screws_;  ///< in a new batch
  enum class Lock : std::uint8_t { off, on } lock_ = Lock::off;
  std::optional<Run> run_ = std::nullopt;
};

}  // namespace spindle::sim
