#include "gen2_unit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "identity.hpp"
#include "spindle/catalogue/identity.hpp"
#include "spindle/catalogue/value.hpp"

namespace spindle::sim {
namespace {

using catalogue::EventKind;

// How long a screw turns freely before it is snug. The real time depends on the screw.
constexpr Duration free_run = std::chrono::milliseconds(900);
// The maker's own program waits so long behind a stop (HTool SequenceRunner.cs).
constexpr Duration rundown = std::chrono::milliseconds(250);
// As on older firmware; nothing says what this one does.
constexpr Duration output_expires = std::chrono::seconds(10);

constexpr std::uint16_t yes = 1;
constexpr std::uint16_t no = 0;
constexpr std::uint16_t last_preset = 31;
constexpr float hundred = 100;

std::uint16_t milliseconds_in(Duration duration) {
  constexpr std::int64_t highest = std::numeric_limits<std::uint16_t>::max();
  const auto count = std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
  return static_cast<std::uint16_t>(std::min<std::int64_t>(count, highest));
}

bool covers(const modbus::WriteMultipleRequest& request, const catalogue::Action& action) {
  const std::uint32_t at = action.address.value;
  return request.table == action.table && at >= request.first.value &&
         at < request.first.value + request.values.size();
}

bool is_at(const Place& place, const catalogue::Action& action) {
  return place.table == action.table && place.address == action.address.value;
}

/// By its product code.
std::string_view series_of(unsigned product) {
  constexpr unsigned bmt = 19;
  constexpr unsigned bmt40 = 29;
  if (product == bmt40) return "BMT40";
  return product == bmt ? "BMT" : "BM";
}

}  // namespace

bool is_gen2(const catalogue::Profile& profile) {
  const auto torque = profile.find("status.torque");
  return profile.identity && profile.identity->firmware_from != 0 && torque &&
         torque->encoding.is_float() && profile.find_action("start") &&
         profile.find_action("direction");
}

Gen2Unit::Gen2Unit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
                   std::uint8_t address, const DeviceOptions& options)
    : Unit(profile, start, address, options),
      start_(*profile.find_action("start")),
      direction_(*profile.find_action("direction")),
      faults_(options.faults),
      stopped_error_(start.stopped_error),
      screws_(word("status.screws-remaining")),
      number_(options.event_number.value_or(0)),
      barcode_("WO-1234") {
  if (const auto output = profile.find_action("auto-output")) output_ = *output;
  // What nothing is known of is there all the same: whole blocks are read.
  for (const catalogue::Area& area : profile.link.contiguous) bank().fill(area);
  begin_identity(profile, start, options);
  if (word("status.preset") == 0) bank().set("status.preset", word("control.initial-preset"));
  show_ready();
}

/// Its texts say what function 11h says.
void Gen2Unit::begin_identity(const catalogue::Profile& profile,
                              const catalogue::SimulationSpec& start,
                              const DeviceOptions& options) {
  const Bytes answer = make_identity(profile.identity, start, options);
  const auto identity = catalogue::decode_identity(*profile.identity, answer);
  const std::size_t product_at = profile.identity->product_byte;
  const auto series = series_of(product_at < answer.size() ? answer[product_at] : 0U);
  // "4002 beside V4.00.2": one digit, two, and one.
  constexpr unsigned for_major = 1000;
  constexpr unsigned for_minor = 10;
  const unsigned firmware = identity.firmware.value_or(0);
  bank().set("info.firmware-major", firmware / for_major);
  bank().set("info.firmware-minor", firmware % for_major / for_minor);
  bank().set("info.firmware-patch", firmware % for_minor);
  put_text("info.driver-model", fmt::format("{}3{:03}", series, word("info.driver-model-number")));
  put_text("info.controller-model", std::string(series));
  put_text("info.driver-serial", identity.serial);
  put_text("info.controller-serial", identity.serial);
}

void Gen2Unit::put_text(std::string_view name, std::string text) {
  const auto place = bank().find(name);
  if (!place) return;
  catalogue::Parameter parameter;
  parameter.encoding = place->encoding;
  const auto registers =
      catalogue::encode(parameter, {.content = catalogue::Content::text, .text = std::move(text)});
  if (registers) bank().put(*place, *registers);
}

// ---- writes ----

Unit::Outcome Gen2Unit::write(ConnectionId connection, const modbus::WriteMultipleRequest& request,
                              TimePoint now) {
  if (!switched_on_) switched_on_ = now;
  const bool turns = run_ || now < still_from_;
  if (turns && covers(request, direction_)) return std::nullopt;
  if (Outcome refused = Unit::write(connection, request, now)) return refused;
  if (output_ && covers(request, *output_)) {
    const std::uint16_t value = request.values[output_->address.value - request.first.value];
    if (value == 0) {
      events().disarm(connection);
    } else {
      events().arm_until(connection, now + output_expires);
    }
  }
  return std::nullopt;
}

void Gen2Unit::on_write(const Place& place, std::int64_t raw, TimePoint now) {
  if (is_at(place, start_)) {
    if (raw != 0) {
      operate(Rundown::ok, 1, now);
    } else if (run_) {
      finish_run(now);
    }
  } else if (is_at(place, direction_) && word("status.direction") != raw) {
    bank().set("status.direction", raw);
    emit(Status::direction_change, {}, now);
  }
}

// ---- motion ----

bool Gen2Unit::can_start() const {
  const std::uint16_t preset = word("status.preset");
  return !run_ && preset > 0 && preset <= last_preset && word("status.alarm") == 0 &&
         word("status.lock") == 0;
}

std::string Gen2Unit::preset_name(std::string_view field) const {
  return fmt::format("preset.{}.{}", word("status.preset"), field);
}

std::uint16_t Gen2Unit::hundredths(std::string_view name) const {
  const auto place = bank().find(name);
  const auto number = place ? bank().number(*place) : std::nullopt;
  const auto steps = number ? catalogue::nearest_step(
                                  {.kind = catalogue::Kind::i64, .scale = Decimal(1, -2)}, *number)
                            : std::nullopt;
  if (!steps || steps->sign == Sign::minus) return 0;
  constexpr std::uint64_t highest = std::numeric_limits<std::int16_t>::max();
  return static_cast<std::uint16_t>(std::min(steps->magnitude, highest));
}

float Gen2Unit::real(std::string_view name) const {
  return static_cast<float>(hundredths(name)) / hundred;
}

RunPlan Gen2Unit::plan_run() const {
  const auto time = [this](std::string_view field) {
    return Duration(std::chrono::milliseconds(word(preset_name(field))));
  };
  RunPlan plan{.target_torque = hundredths(preset_name("target-torque")),
               .speed = word(preset_name("speed")),
               .ramp = time("soft-start"),
               .free_run = free_run};
  if (word("status.direction") != 0) {
    plan.turning = Turning::loosening;
    if (const std::uint16_t speed = word("control.loosening-speed"); speed != 0) plan.speed = speed;
    return plan;
  }
  plan.rise = time("torque-rising-time");
  // Screws differ by up to two per cent, the same screws in every simulation.
  constexpr std::uint32_t spread = 20;
  constexpr std::uint32_t stride = 7;
  constexpr std::uint32_t per_mille = 1000;
  const std::uint32_t above = std::uint32_t{number_} * stride % spread;
  const std::uint32_t reached = plan.target_torque * (per_mille + above) / per_mille;
  plan.final_torque = static_cast<std::uint16_t>(
      std::min<std::uint32_t>(reached, std::numeric_limits<int16_t>::max()));
  return plan;
}

bool Gen2Unit::operate(Rundown outcome, unsigned results, TimePoint now) {
  if (!switched_on_) switched_on_ = now;
  if (!can_start()) return false;
  const RunPlan plan = plan_run();
  const Duration planned = plan.duration();
  // A trigger that is released too early, whether the torque rises at once or not.
  const Duration missing = (plan.rise > Duration::zero() ? plan.rise : plan.free_run) / 2;
  run_ = Run{plan, now, now + (outcome == Rundown::ok ? planned : planned - missing), results};
  torque_is_no_number_ = false;
  bank().set("status.running", yes);
  bank().set("status.torque-up", no);
  bank().set("status.fastening-ok", no);
  show_ready();
  return true;
}

/// At its planned end or before.
void Gen2Unit::finish_run(TimePoint now) {
  const Run run = *std::exchange(run_, std::nullopt);
  const Duration elapsed = now - run.begin;
  const bool fastening = run.plan.turning == Turning::fastening;
  const bool reached = fastening && elapsed >= run.plan.duration();
  still_from_ = now + rundown;
  bank().put(start_.table, start_.address.value, 0);
  bank().set("status.running", no);
  bank().set("status.torque-up", reached ? yes : no);
  bank().set("status.fastening-ok", reached ? yes : no);
  if (reached) count_screw();
  show_ready();
  Result result{.time = milliseconds_in(elapsed),
                .motion = motion_at(run.plan, elapsed),
                .speed = run.plan.speed};
  if (fastening && !reached) result.error = stopped_error_;
  const Status status = reached ? Status::fastening_ok : Status::fastening_ng;
  for (unsigned told = 0; told < run.results; ++told) {
    emit(fastening ? status : Status::other, result, now);
  }
}

// A batch that is complete is followed by the next one.
void Gen2Unit::count_screw() {
  const std::uint16_t left = word("status.screws-remaining");
  if (left == 0) return;
  bank().set("status.screws-remaining", left == 1 ? screws_ : static_cast<std::uint16_t>(left - 1));
}

void Gen2Unit::show(std::string_view name, std::uint16_t steps) {
  if (const auto place = bank().find(name)) bank().set_number(*place, Decimal(steps, -2));
}

void Gen2Unit::before_read(TimePoint now) {
  if (!switched_on_) switched_on_ = now;
  const Motion motion = run_ ? motion_at(run_->plan, now - run_->begin) : Motion{};
  constexpr std::uint16_t amperes = 150;  // in hundredths
  bank().set("status.speed", motion.speed);
  show("status.torque", motion.torque);
  show("status.current", run_ ? amperes : no);
  const auto torque = bank().find("status.torque");
  if (torque_is_no_number_ && torque) bank().put(*torque, Registers{0x7FC0, 0});
}

void Gen2Unit::show_ready() { bank().set("status.ready", can_start() ? yes : no); }

std::optional<TimePoint> Gen2Unit::next_step() const {
  return run_ ? std::optional(run_->end) : std::nullopt;
}

// ---- events ----

const Fault* Gen2Unit::struck(FaultKind kind) const {
  const auto found = std::find_if(faults_.begin(), faults_.end(), [&](const Fault& fault) {
    return fault.kind == kind && fault.applies_to(events_told_);
  });
  return found == faults_.end() ? nullptr : &*found;
}

/// Its clock begins at the same moment in every simulation.
Gen2Event::Date Gen2Unit::date_at(TimePoint now) {
  if (!switched_on_) switched_on_ = now;
  constexpr std::chrono::sys_days first = std::chrono::year{2026} / 1 / 1;
  const auto since = std::chrono::duration_cast<std::chrono::milliseconds>(now - *switched_on_);
  const auto moment = first + since;
  const auto day = std::chrono::floor<std::chrono::days>(moment);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss time(moment - day);
  constexpr int tens = 10;
  return {.year = static_cast<std::uint16_t>(static_cast<int>(date.year())),
          .month = static_cast<std::uint8_t>(static_cast<unsigned>(date.month())),
          .day = static_cast<std::uint8_t>(static_cast<unsigned>(date.day())),
          .hour = static_cast<std::uint8_t>(time.hours().count()),
          .minute = static_cast<std::uint8_t>(time.minutes().count()),
          .second = static_cast<std::uint8_t>(time.seconds().count()),
          .fraction = static_cast<std::uint8_t>(time.subseconds().count() / tens)};
}

/// Of those only that the tool is set to keep.
void Gen2Unit::emit(Status status, const Result& result, TimePoint now) {
  const auto bit = static_cast<unsigned>(status);
  if (bank().find("control.event-select")) {
    const unsigned kept = word("control.event-select");
    if (((kept >> bit) & 1U) == 0) return;
  }
  ++number_;
  ++events_told_;
  Gen2Event event{.number = number_,
                  .date = date_at(now),
                  .fastening_time = result.time,
                  .preset = word("status.preset"),
                  .torque_unit = word("control.torque-unit"),
                  .screws_remaining = word("status.screws-remaining"),
                  .direction = word("status.direction"),
                  .error = result.error,
                  .status = static_cast<std::uint16_t>(status),
                  .target_torque = real(preset_name("target-torque")),
                  .torque = static_cast<float>(result.motion.torque) / hundred,
                  .speed = result.speed,
                  .a1 = result.motion.angle_before_snug,
                  .a2 = result.motion.angle_after_snug,
                  .a3 = result.motion.angle,
                  .barcode = barcode_};
  if (struck(FaultKind::zero_date) != nullptr) event.date = {};
  if (struck(FaultKind::not_a_number) != nullptr) {
    event.torque = std::numeric_limits<float>::quiet_NaN();
    torque_is_no_number_ = true;
  }
  const bool for_all = word("control.auto-output") != 0;
  std::optional<EventBlock::Reached> reached;
  if (status == Status::fastening_ok || status == Status::fastening_ng) {
    reached = {.torque = static_cast<float>(result.motion.torque) / hundred,
               .angle = static_cast<float>(result.motion.angle)};
  }
  events().tell(block_of(event), reached,
                for_all ? EventBlock::Audience::all : EventBlock::Audience::armed, now);
}

void Gen2Unit::happen(EventKind kind, TimePoint now) {
  switch (kind) {
    case EventKind::fastening_ok:
      return emit(Status::fastening_ok, {}, now);
    case EventKind::fastening_ng:
      return emit(Status::fastening_ng, {.error = stopped_error_}, now);
    case EventKind::direction_change:
      return emit(Status::direction_change, {}, now);
    case EventKind::preset_change:
      return emit(Status::preset_change, {}, now);
    case EventKind::alarm_reset:
      return emit(Status::alarm_reset, {}, now);
    case EventKind::error:
      return emit(Status::error, {.error = word("status.alarm")}, now);
    case EventKind::barcode:
      barcode_ = fmt::format("WO-{}", 1235 + scans_++);
      return emit(Status::barcode, {}, now);
    case EventKind::screw_count:
      return emit(Status::screw_count, {}, now);
    default:
      return emit(Status::other, {}, now);
  }
}

// ---- what happens to the tool ----

void Gen2Unit::raise_alarm(std::int64_t code, TimePoint now) {
  run_.reset();
  bank().put(start_.table, start_.address.value, 0);
  bank().set("status.running", no);
  bank().set("status.alarm", code);
  show_ready();
  emit(Status::error, {.error = static_cast<std::uint16_t>(code)}, now);
}

void Gen2Unit::power_cycle(TimePoint now) {
  run_.reset();
  number_ = 0;
  torque_is_no_number_ = false;
  switched_on_ = now;
  still_from_ = TimePoint::min();
  events().restart();
  for (const char* name : {"status.running", "status.torque-up", "status.fastening-ok",
                           "status.alarm", "status.direction"}) {
    bank().set(name, 0);
  }
  for (const catalogue::Action& action : {start_, direction_}) {
    bank().put(action.table, action.address.value, 0);
  }
  bank().set("status.preset", word("control.initial-preset"));
  show_ready();
}

}  // namespace spindle::sim
