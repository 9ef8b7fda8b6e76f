#include "bm_unit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "spindle/catalogue/value.hpp"

namespace spindle::sim {
namespace {

using catalogue::EventKind;

// How long a screw turns freely before it is snug. The real time depends on the screw.
constexpr Duration free_run = std::chrono::milliseconds(900);

constexpr std::uint16_t yes = 1;
constexpr std::uint16_t no = 0;

std::uint16_t milliseconds_in(Duration duration) {
  constexpr std::int64_t highest = std::numeric_limits<std::uint16_t>::max();
  const auto count = std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
  return static_cast<std::uint16_t>(std::min<std::int64_t>(count, highest));
}

// Whether the tool does anything with this value; others are echoed and ignored.
bool accepts(const catalogue::Action& action, std::uint16_t value) {
  if (action.value) return value == action.value || value == action.stop_value;
  if (value >= action.minimum && value <= action.maximum) return true;
  return std::any_of(action.labels.begin(), action.labels.end(),
                     [value](const catalogue::Label& label) { return label.number == value; });
}

}  // namespace

BmUnit::BmUnit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
               std::uint8_t address, const DeviceOptions& options)
    : Unit(profile, start, address, options, RegisterBank::Commands::write_only),
      stopped_error_(start.stopped_error),
      screws_(word("status.screws-remaining")) {
  if (options.event_number) bank().set("event.number", *options.event_number);
  put_barcode();
  constexpr std::array<std::pair<std::string_view, Handler>, 5> handlers = {{
      {"alarm-reset", &BmUnit::reset_alarm},
      {"lock", &BmUnit::lock},
      {"start", &BmUnit::start_or_stop},
      {"select-preset", &BmUnit::select_preset},
      {"direction", &BmUnit::select_direction},
  }};
  for (const catalogue::Action& action : profile.actions) {
    const auto* const known = std::find_if(handlers.begin(), handlers.end(), [&](const auto& row) {
      return row.first == action.name;
    });
    if (known == handlers.end()) continue;
    inputs_.push_back({action, known->second});
    const bool selects = action.name == "select-preset";
    if (selects && word("status.preset") == 0) bank().set("status.preset", action.minimum);
  }
  show_ready();
}

/// Of a tool whose events have one.
void BmUnit::put_barcode() {
  const auto place = bank().find("event.plus.barcode");
  if (!place) return;
  catalogue::Parameter parameter;
  parameter.encoding = place->encoding;
  const auto registers =
      catalogue::encode(parameter, {.content = catalogue::Content::text, .text = "WO-1234"});
  if (registers) bank().put(*place, *registers);
}

// ---- remote inputs ----

void BmUnit::on_write(const Place& place, std::int64_t raw, TimePoint now) {
  const auto value = static_cast<std::uint16_t>(raw);
  for (const RemoteInput& input : inputs_) {
    const bool is_meant =
        input.action.table == place.table && input.action.address.value == place.address;
    if (is_meant && accepts(input.action, value)) (this->*input.handler)(input.action, value, now);
  }
}

void BmUnit::reset_alarm(const catalogue::Action& /*action*/, std::uint16_t /*value*/,
                         TimePoint now) {
  for (const char* name : {"status.alarm", "alarm.1", "alarm.2"}) bank().set(name, 0);
  show_ready();
  emit(EventKind::alarm_reset, {}, now);
}

void BmUnit::lock(const catalogue::Action& /*action*/, std::uint16_t value, TimePoint /*now*/) {
  lock_ = value == 0 ? Lock::off : Lock::on;
  show_ready();
}

void BmUnit::start_or_stop(const catalogue::Action& action, std::uint16_t value, TimePoint now) {
  if (value != action.stop_value) {
    operate(Rundown::ok, 1, now);
  } else if (run_) {
    finish_run(now);
  }
}

void BmUnit::select_preset(const catalogue::Action& /*action*/, std::uint16_t value,
                           TimePoint now) {
  if (run_) return;
  bank().set("status.preset", value);
  emit(EventKind::preset_change, {}, now);
}

void BmUnit::select_direction(const catalogue::Action& /*action*/, std::uint16_t value,
                              TimePoint now) {
  if (run_) return;
  bank().set("status.direction", value);
  emit(EventKind::direction_change, {}, now);
}

// ---- motion ----

bool BmUnit::can_start() const { return !run_ && lock_ == Lock::off && word("status.alarm") == 0; }

std::uint16_t BmUnit::preset_field(std::string_view field) const {
  return word(fmt::format("preset.{}.{}", word("status.preset"), field));
}

RunPlan BmUnit::plan_run() const {
  const auto time = [this](std::string_view field) {
    return Duration(std::chrono::milliseconds(preset_field(field)));
  };
  RunPlan plan{.target_torque = preset_field("target-torque"),
               .speed = preset_field("speed"),
               .ramp = time("soft-start"),
               .free_run = free_run};
  if (word("status.direction") != 0) {
    plan.turning = Turning::loosening;
    return plan;
  }
  plan.rise = time("torque-rising-time");
  // Screws differ by up to two per cent, the same screws in every simulation.
  constexpr std::uint64_t spread = 20;
  constexpr std::uint64_t stride = 7;
  constexpr std::uint64_t per_mille = 1000;
  constexpr std::uint64_t highest = std::numeric_limits<std::int16_t>::max();
  const std::uint64_t above = static_cast<std::uint64_t>(events().number()) * stride % spread;
  const std::uint64_t reached = plan.target_torque * (per_mille + above) / per_mille;
  plan.final_torque = static_cast<std::uint16_t>(std::min<std::uint64_t>(reached, highest));
  return plan;
}

bool BmUnit::operate(Rundown outcome, unsigned results, TimePoint now) {
  if (!can_start()) return false;
  const RunPlan plan = plan_run();
  const Duration planned = plan.duration();
  // A trigger that is released too early, whether the torque rises at once or not.
  const Duration missing = (plan.rise > Duration::zero() ? plan.rise : plan.free_run) / 2;
  run_ = Run{plan, now, now + (outcome == Rundown::ok ? planned : planned - missing), results};
  bank().set("status.running", yes);
  bank().set("status.torque-up", no);
  bank().set("status.fastening-ok", no);
  show_ready();
  return true;
}

// At its planned end or before.
void BmUnit::finish_run(TimePoint now) {
  const Run run = *std::exchange(run_, std::nullopt);
  const Duration elapsed = now - run.begin;
  const bool fastening = run.plan.turning == Turning::fastening;
  const bool reached = fastening && elapsed >= run.plan.duration();

  bank().set("status.running", no);
  bank().set("status.torque-up", reached ? yes : no);
  bank().set("status.fastening-ok", reached ? yes : no);
  if (reached) count_screw();
  before_read(now);
  show_ready();
  EventData data{.fastening_time = milliseconds_in(elapsed),
                 .motion = motion_at(run.plan, elapsed),
                 .speed = run.plan.speed};
  if (fastening && !reached) data.error = stopped_error_;
  const EventKind result = reached ? EventKind::fastening_ok : EventKind::fastening_ng;
  for (unsigned told = 0; told < run.results; ++told) {
    emit(fastening ? result : EventKind::other, data, now);
  }
}

// A batch that is complete is followed by the next one.
void BmUnit::count_screw() {
  const std::uint16_t left = word("status.screws-remaining");
  if (left == 0) return;
  bank().set("status.screws-remaining", left == 1 ? screws_ : static_cast<std::uint16_t>(left - 1));
}

void BmUnit::before_read(TimePoint now) {
  const Motion motion = run_ ? motion_at(run_->plan, now - run_->begin) : Motion{};
  bank().set("status.speed", motion.speed);
  bank().set("status.torque", motion.torque);
}

void BmUnit::show_ready() { bank().set("status.ready", can_start() ? yes : no); }

std::optional<TimePoint> BmUnit::next_step() const {
  return run_ ? std::optional(run_->end) : std::nullopt;
}

// ---- events ----

void BmUnit::emit(EventKind kind, const EventData& data, TimePoint now) {
  const bool has_snug = preset_field("snug-torque") != 0;
  const EventBlock::Values values = {
      {"event.fastening-time", data.fastening_time},
      {"event.preset", word("status.preset")},
      {"event.target-torque", preset_field("target-torque")},
      {"event.torque", data.motion.torque},
      {"event.speed", data.speed},
      {"event.a1", data.motion.angle_before_snug},
      {"event.a2", data.motion.angle_after_snug},
      {"event.a3", data.motion.angle},
      {"event.screw-count", word("status.screws-remaining")},
      {"event.error", data.error},
      {"event.direction", word("status.direction")},
      {"event.snug-angle", has_snug ? data.motion.angle_after_snug : std::uint16_t{0}}};
  events().emit(kind, values, now);
}

// ---- what happens to the tool ----

void BmUnit::raise_alarm(std::int64_t code, TimePoint now) {
  run_.reset();
  bank().set("status.running", no);
  bank().set("status.alarm", code);
  bank().set("alarm.1", code);
  before_read(now);
  show_ready();
  emit(EventKind::error, {.error = static_cast<std::uint16_t>(code)}, now);
}

void BmUnit::power_cycle(TimePoint now) {
  run_.reset();
  lock_ = Lock::off;
  events().restart();
  for (const char* name : {"status.running", "status.torque-up", "status.fastening-ok",
                           "status.alarm", "alarm.1", "alarm.2"}) {
    bank().set(name, 0);
  }
  before_read(now);
  show_ready();
}

}  // namespace spindle::sim
