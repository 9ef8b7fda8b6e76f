#include "spindle/sim/bm_tool.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "bm_identity.hpp"
#include "bm_motion.hpp"
#include "event_unit.hpp"
#include "faulty_store.hpp"
#include "register_bank.hpp"
#include "spindle/modbus/pdu.hpp"

namespace spindle::sim {
namespace {

using catalogue::EventKind;
using modbus::ExceptionCode;
using modbus::Pdu;

// How long a screw turns freely before it is snug. The real time depends on the screw.
constexpr Duration free_run = std::chrono::milliseconds(900);

constexpr std::uint16_t yes = 1;
constexpr std::uint16_t no = 0;

Pdu refusal(const Pdu& request, ExceptionCode code) {
  return modbus::exception_response(request.function, static_cast<std::uint8_t>(code));
}

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

class SimulatedBm final : public BmTool {
 public:
  SimulatedBm(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
              const BmOptions& options);

  std::optional<Pdu> answer(ConnectionId connection, modbus::UnitId unit, const Pdu& request,
                            TimePoint now) override;
  void advance(TimePoint now) override;
  [[nodiscard]] std::optional<TimePoint> next_change() const override;
  std::vector<Push> take_pushes() override { return events_.take_pushes(); }
  std::vector<Push> take_pushes(ConnectionId connection) override {
    return events_.take_pushes(connection);
  }
  [[nodiscard]] std::optional<Pdu> event_frame() const override {
    return events_.frame(registers_);
  }
  void connected(ConnectionId connection) override { events_.connected(connection); }
  void disconnected(ConnectionId connection) override { events_.disconnected(connection); }

  void operator_rundown(Rundown outcome, TimePoint now) override;
  void raise_alarm(std::uint16_t code, TimePoint now) override;
  void reboot(TimePoint now) override;

 private:
  using Handler = void (SimulatedBm::*)(const catalogue::Action&, std::uint16_t, TimePoint);
  struct Deed {
    catalogue::Action action;
    Handler handler;
  };
  struct Run {
    RunPlan plan;
    TimePoint begin;
    TimePoint end;
    unsigned results = 1;  // events that its end brings
  };
  // Fields of an event that are not the tool's present state.
  struct EventData {
    std::uint16_t fastening_time = 0;
    Motion motion = {};
    std::uint16_t speed = 0;
    std::uint16_t error = 0;
  };

  [[nodiscard]] Pdu read(const Pdu& request, const modbus::ReadRequest& wanted, TimePoint now);
  [[nodiscard]] Pdu write(ConnectionId connection, const Pdu& request,
                          const modbus::WriteSingleRequest& wanted, TimePoint now);
  [[nodiscard]] bool is_remote_input(std::uint16_t address) const;
  void use_remote_input(ConnectionId connection, const modbus::WriteSingleRequest& wanted,
                        TimePoint now);

  void reset_alarm(const catalogue::Action& action, std::uint16_t value, TimePoint now);
  void lock(const catalogue::Action& action, std::uint16_t value, TimePoint now);
  void start_or_stop(const catalogue::Action& action, std::uint16_t value, TimePoint now);
  void select_preset(const catalogue::Action& action, std::uint16_t value, TimePoint now);
  void turn_round(const catalogue::Action& action, std::uint16_t value, TimePoint now);

  [[nodiscard]] bool can_start() const;
  [[nodiscard]] std::uint16_t preset_field(std::string_view field) const;
  [[nodiscard]] RunPlan plan_run() const;
  void begin_run(Rundown outcome, TimePoint now);
  void finish_run(TimePoint now);
  void count_screw();
  void step(TimePoint now);
  void pull_trigger(TimePoint now);
  void show_alarm(std::uint16_t code, TimePoint now);
  void show_motion(TimePoint now);
  void show_ready();
  void emit(EventKind kind, const EventData& data, TimePoint now);

  RegisterBank registers_;
  EventUnit events_;
  std::vector<Deed> deeds_ = {};
  std::uint16_t max_read_;
  std::uint8_t limit_exception_;
  std::uint16_t stopped_error_;
  std::uint16_t screws_;  // in a new batch
  Bytes identity_;
  FaultyStore store_;
  std::optional<Duration> rundown_every_;
  unsigned ng_every_;
  unsigned burst_;

  enum class Lock : std::uint8_t { off, on } lock_ = Lock::off;
  std::optional<Run> run_ = std::nullopt;
  std::optional<TimePoint> next_trigger_ = std::nullopt;
  std::optional<TimePoint> begin_ = std::nullopt;
  std::vector<Raised> alarms_;  // still to come, the next one last
  unsigned triggers_ = 0;
};

SimulatedBm::SimulatedBm(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
                         const BmOptions& options)
    : registers_(profile, start),
      events_(profile),
      max_read_(profile.link.max_read),
      limit_exception_(start.limit_exception),
      stopped_error_(start.stopped_error),
      screws_(registers_.get("status.screws-remaining")),
      identity_(make_identity(profile.identity, start, options)),
      store_(options.faults),
      rundown_every_(options.rundown_every),
      ng_every_(options.ng_every),
      burst_(options.burst),
      alarms_(options.alarms) {
  std::sort(alarms_.begin(), alarms_.end(),
            [](const Raised& a, const Raised& b) { return a.after > b.after; });
  constexpr std::array<std::pair<std::string_view, Handler>, 5> handlers = {{
      {"alarm-reset", &SimulatedBm::reset_alarm},
      {"lock", &SimulatedBm::lock},
      {"start", &SimulatedBm::start_or_stop},
      {"select-preset", &SimulatedBm::select_preset},
      {"direction", &SimulatedBm::turn_round},
  }};
  for (const catalogue::Action& action : profile.actions) {
    const auto* const known = std::find_if(handlers.begin(), handlers.end(), [&](const auto& row) {
      return row.first == action.name;
    });
    deeds_.push_back({action, known == handlers.end() ? nullptr : known->second});
    const bool selects = action.name == "select-preset";
    if (selects && registers_.get("status.preset") == 0) {
      registers_.set("status.preset", action.minimum);
    }
  }
  show_ready();
}

// ---- requests ----

std::optional<Pdu> SimulatedBm::answer(ConnectionId connection, modbus::UnitId /*unit*/,
                                       const Pdu& request, TimePoint now) {
  advance(now);
  const auto parsed = modbus::parse_request(request);
  if (!parsed) return refusal(request, parsed.error());
  if (const auto* wanted = std::get_if<modbus::ReadRequest>(&*parsed)) {
    return read(request, *wanted, now);
  }
  if (const auto* wanted = std::get_if<modbus::WriteSingleRequest>(&*parsed)) {
    return write(connection, request, *wanted, now);
  }
  if (std::holds_alternative<modbus::ReportServerIdRequest>(*parsed)) {
    return modbus::report_server_id_response(identity_);
  }
  return refusal(request, ExceptionCode::illegal_function);
}

Pdu SimulatedBm::read(const Pdu& request, const modbus::ReadRequest& wanted, TimePoint now) {
  if (wanted.count > max_read_) return refusal(request, ExceptionCode::illegal_data_value);
  show_motion(now);
  const auto found = registers_.read(wanted.table, wanted.first.value, wanted.count);
  if (!found) return refusal(request, ExceptionCode::illegal_data_address);
  return modbus::read_response(wanted.table, *found);
}

Pdu SimulatedBm::write(ConnectionId connection, const Pdu& request,
                       const modbus::WriteSingleRequest& wanted, TimePoint now) {
  const bool remote_input = is_remote_input(wanted.address.value);
  const WriteVerdict verdict = remote_input
                                   ? WriteVerdict::allowed
                                   : registers_.check_write(wanted.address.value, wanted.value);
  if (verdict == WriteVerdict::no_such_register) {
    return refusal(request, ExceptionCode::illegal_data_address);
  }
  if (verdict == WriteVerdict::outside_limits) {
    return modbus::exception_response(request.function, limit_exception_);
  }
  if (store_.accept()) {
    if (remote_input) {
      use_remote_input(connection, wanted, now);
    } else {
      store_.store(wanted.address.value, wanted.value, registers_);
    }
  }
  return request;  // the echo
}

bool SimulatedBm::is_remote_input(std::uint16_t address) const {
  return events_.is_arming(address) ||
         std::any_of(deeds_.begin(), deeds_.end(),
                     [address](const Deed& deed) { return deed.action.address.value == address; });
}

void SimulatedBm::use_remote_input(ConnectionId connection,
                                   const modbus::WriteSingleRequest& wanted, TimePoint now) {
  if (events_.is_arming(wanted.address.value)) {
    events_.arm(connection, wanted.value, now);
    return;
  }
  for (const Deed& deed : deeds_) {
    const bool meant = deed.action.address == wanted.address && accepts(deed.action, wanted.value);
    if (meant && deed.handler != nullptr) (this->*deed.handler)(deed.action, wanted.value, now);
  }
}

// ---- remote inputs ----

void SimulatedBm::reset_alarm(const catalogue::Action& /*action*/, std::uint16_t /*value*/,
                              TimePoint now) {
  for (const char* name : {"status.alarm", "alarm.1", "alarm.2"}) registers_.set(name, 0);
  show_ready();
  emit(EventKind::alarm_reset, {}, now);
}

void SimulatedBm::lock(const catalogue::Action& /*action*/, std::uint16_t value,
                       TimePoint /*now*/) {
  lock_ = value == 0 ? Lock::off : Lock::on;
  show_ready();
}

void SimulatedBm::start_or_stop(const catalogue::Action& action, std::uint16_t value,
                                TimePoint now) {
  if (value != action.stop_value) {
    begin_run(Rundown::ok, now);
  } else if (run_) {
    finish_run(now);
  }
}

void SimulatedBm::select_preset(const catalogue::Action& /*action*/, std::uint16_t value,
                                TimePoint now) {
  if (run_) return;
  registers_.set("status.preset", value);
  emit(EventKind::preset_change, {}, now);
}

void SimulatedBm::turn_round(const catalogue::Action& /*action*/, std::uint16_t value,
                             TimePoint now) {
  if (run_) return;
  registers_.set("status.direction", value);
  emit(EventKind::direction_change, {}, now);
}

// ---- motion ----

bool SimulatedBm::can_start() const {
  return !run_ && lock_ == Lock::off && registers_.get("status.alarm") == 0;
}

std::uint16_t SimulatedBm::preset_field(std::string_view field) const {
  return registers_.get(fmt::format("preset.{}.{}", registers_.get("status.preset"), field));
}

RunPlan SimulatedBm::plan_run() const {
  const auto time = [this](std::string_view field) {
    return Duration(std::chrono::milliseconds(preset_field(field)));
  };
  RunPlan plan{.target_torque = preset_field("target-torque"),
               .speed = preset_field("speed"),
               .ramp = time("soft-start"),
               .free_run = free_run};
  if (registers_.get("status.direction") != 0) {
    plan.turning = Turning::loosening;
    return plan;
  }
  plan.rise = time("torque-rising-time");
  // Screws differ by up to two per cent, the same screws in every simulation.
  constexpr std::uint64_t spread = 20;
  constexpr std::uint64_t stride = 7;
  constexpr std::uint64_t per_mille = 1000;
  constexpr std::uint64_t highest = std::numeric_limits<std::int16_t>::max();
  const std::uint64_t above = events_.number(registers_) * stride % spread;
  const std::uint64_t reached = plan.target_torque * (per_mille + above) / per_mille;
  plan.final_torque = static_cast<std::uint16_t>(std::min<std::uint64_t>(reached, highest));
  return plan;
}

void SimulatedBm::begin_run(Rundown outcome, TimePoint now) {
  if (!can_start()) return;
  const RunPlan plan = plan_run();
  const Duration planned = plan.duration();
  // A trigger that is released too early, whether the torque rises at once or not.
  const Duration missing = (plan.rise > Duration::zero() ? plan.rise : plan.free_run) / 2;
  run_ = Run{plan, now, now + (outcome == Rundown::ok ? planned : planned - missing)};
  registers_.set("status.running", yes);
  registers_.set("status.torque-up", no);
  registers_.set("status.fastening-ok", no);
  show_ready();
}

// At its planned end or before.
void SimulatedBm::finish_run(TimePoint now) {
  const Run run = *std::exchange(run_, std::nullopt);
  const Duration elapsed = now - run.begin;
  const bool fastening = run.plan.turning == Turning::fastening;
  const bool reached = fastening && elapsed >= run.plan.duration();

  registers_.set("status.running", no);
  registers_.set("status.torque-up", reached ? yes : no);
  registers_.set("status.fastening-ok", reached ? yes : no);
  if (reached) count_screw();
  show_motion(now);
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
void SimulatedBm::count_screw() {
  const std::uint16_t left = registers_.get("status.screws-remaining");
  if (left == 0) return;
  registers_.set("status.screws-remaining",
                 left == 1 ? screws_ : static_cast<std::uint16_t>(left - 1));
}

void SimulatedBm::show_motion(TimePoint now) {
  const Motion motion = run_ ? motion_at(run_->plan, now - run_->begin) : Motion{};
  registers_.set("status.speed", motion.speed);
  registers_.set("status.torque", motion.torque);
}

void SimulatedBm::show_ready() { registers_.set("status.ready", can_start() ? yes : no); }

// ---- time ----

std::optional<TimePoint> SimulatedBm::next_change() const {
  std::optional<TimePoint> next = next_trigger_;
  const auto consider = [&next](TimePoint due) { next = std::min(next.value_or(due), due); };
  if (run_) consider(run_->end);
  if (begin_ && !alarms_.empty()) consider(*begin_ + alarms_.back().after);
  return next;
}

void SimulatedBm::advance(TimePoint now) {
  if (!begin_) begin_ = now;
  const bool has_operator = rundown_every_ && *rundown_every_ > Duration::zero();
  if (has_operator && !next_trigger_) next_trigger_ = now + *rundown_every_;
  for (auto due = next_change(); due && *due <= now; due = next_change()) step(*due);
}

void SimulatedBm::step(TimePoint now) {
  if (run_ && run_->end <= now) finish_run(now);
  if (next_trigger_ && *next_trigger_ <= now) pull_trigger(now);
  if (!alarms_.empty() && *begin_ + alarms_.back().after <= now) {
    const Raised alarm = alarms_.back();
    alarms_.pop_back();
    show_alarm(alarm.code, now);
  }
}

void SimulatedBm::pull_trigger(TimePoint now) {
  next_trigger_ = now + *rundown_every_;
  if (!can_start()) return;
  ++triggers_;
  const bool fails = ng_every_ != 0 && triggers_ % ng_every_ == 0;
  begin_run(fails ? Rundown::ng : Rundown::ok, now);
  run_->results = burst_;
}

// ---- events ----

void SimulatedBm::emit(EventKind kind, const EventData& data, TimePoint now) {
  const bool has_snug = preset_field("snug-torque") != 0;
  const EventUnit::Values values = {
      {"event.fastening-time", data.fastening_time},
      {"event.preset", registers_.get("status.preset")},
      {"event.target-torque", preset_field("target-torque")},
      {"event.torque", data.motion.torque},
      {"event.speed", data.speed},
      {"event.a1", data.motion.angle_before_snug},
      {"event.a2", data.motion.angle_after_snug},
      {"event.a3", data.motion.angle},
      {"event.screw-count", registers_.get("status.screws-remaining")},
      {"event.error", data.error},
      {"event.direction", registers_.get("status.direction")},
      {"event.snug-angle", has_snug ? data.motion.angle_after_snug : std::uint16_t{0}}};
  events_.emit(kind, values, registers_, now);
}

// ---- what happens to the tool ----

void SimulatedBm::operator_rundown(Rundown outcome, TimePoint now) {
  advance(now);
  begin_run(outcome, now);
}

void SimulatedBm::raise_alarm(std::uint16_t code, TimePoint now) {
  advance(now);
  show_alarm(code, now);
}

void SimulatedBm::show_alarm(std::uint16_t code, TimePoint now) {
  run_.reset();
  registers_.set("status.running", no);
  registers_.set("status.alarm", code);
  registers_.set("alarm.1", code);
  show_motion(now);
  show_ready();
  emit(EventKind::error, {.error = code}, now);
}

void SimulatedBm::reboot(TimePoint now) {
  advance(now);
  run_.reset();
  lock_ = Lock::off;
  events_.reboot(registers_);
  for (const char* name : {"status.running", "status.torque-up", "status.fastening-ok",
                           "status.alarm", "alarm.1", "alarm.2"}) {
    registers_.set(name, 0);
  }
  show_motion(now);
  show_ready();
}

}  // namespace

std::unique_ptr<BmTool> make_bm_tool(const catalogue::Profile& profile,
                                     const catalogue::SimulationSpec& start,
                                     const BmOptions& options) {
  return std::make_unique<SimulatedBm>(profile, start, options);
}

}  // namespace spindle::sim
