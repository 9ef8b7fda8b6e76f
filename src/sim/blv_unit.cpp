#include "blv_unit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

namespace spindle::sim {
namespace {

using catalogue::Parameter;
using modbus::ExceptionCode;
using modbus::Pdu;
using modbus::RegisterTable;
using std::chrono::milliseconds;

// The driver's codes of communication errors (HM-5114 p.33, p.38) and of the alarms and warnings
// that it raises by itself.
constexpr std::int64_t transmission_error = 0x84;
constexpr std::int64_t undefined_command = 0x88;
constexpr std::int64_t setter_busy = 0x89;
constexpr std::int64_t memory_busy = 0x8A;
constexpr std::int64_t outside_range = 0x8C;
constexpr std::int64_t not_now = 0x8D;
constexpr std::int64_t line_alarm = 0x84;
constexpr std::int64_t timeout_alarm = 0x85;
constexpr std::int64_t memory_alarm = 0x41;
constexpr std::int64_t overload = 0x30;

// HM-5114 p.15: a request is refused when address and count reach 2000h together.
constexpr catalogue::Area map{.from = 0, .to = 0x1FFE};

// What the initialisation that keeps the line working spares (AR p.230).
constexpr std::array<std::string_view, 3> line_settings = {
    "communication.parity", "communication.stop-bits", "communication.waiting-time"};

// How long the driver works.
constexpr Duration storing = milliseconds(500);
constexpr Duration clearing = milliseconds(100);

// Below this a speed counts as standstill.
constexpr std::int64_t slowest = 80;

constexpr std::string_view alarms = "alarm.history";
constexpr std::string_view warnings = "warning.history";
constexpr std::string_view errors = "communication-error.history";

/// An entry of a history; 1 is the newest.
std::string nth(std::string_view history, int n) { return fmt::format("{}.{}", history, n); }

catalogue::CommandWordSpec word_facts(const catalogue::Profile& profile) {
  const auto* facts = profile.run ? profile.run->word() : nullptr;
  return facts == nullptr ? catalogue::CommandWordSpec{} : *facts;
}

}  // namespace

BlvUnit::BlvUnit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
                 std::uint8_t address, const DeviceOptions& options)
    : Unit(profile, start, address, options),
      run_(word_facts(profile)),
      refusals_(profile.refusals.value_or(catalogue::ExtendedErrorSpec{})),
      load_(bank().get(run_.monitor.load)),
      configuring_(options.configuring) {
  constexpr std::array<std::pair<std::string_view, Handler>, 9> handlers = {{
      {"alarm-reset", &BlvUnit::reset_alarm},
      {"clear-alarm-history", &BlvUnit::clear_alarm_history},
      {"clear-warning-history", &BlvUnit::clear_warning_history},
      {"clear-communication-history", &BlvUnit::clear_communication_history},
      {"configure", &BlvUnit::configure},
      {"initialize", &BlvUnit::initialize},
      {"load", &BlvUnit::load},
      {"save", &BlvUnit::save},
      {"initialize-all", &BlvUnit::initialize_all},
  }};
  for (const catalogue::Action& action : profile.actions) {
    const auto* const known = std::find_if(handlers.begin(), handlers.end(), [&](const auto& row) {
      return row.first == action.name;
    });
    const Cell* cell = bank().cell_at(RegisterTable::holding, action.address.value);
    if (known == handlers.end() || !action.value || !action.rest || cell == nullptr) continue;
    commands_.push_back({cell->place.address, *action.value, known->second});
  }
  for (const Parameter& parameter : profile.parameters) {
    const bool operates = profile.commands_motion(parameter) ||
                          parameter.name.starts_with("command.") ||
                          parameter.name.starts_with("operation.");
    if (operates) operation_.insert(parameter.address.value);
  }
  for (const catalogue::Text* name : {&run_.command, &run_.monitor.status}) {
    if (auto parameter = profile.find(*name)) words_.push_back(std::move(*parameter));
  }
  bank().fill(map);
  factory_ = stored_ = bank().tables();
  make_effective();
}

std::int64_t BlvUnit::group() const { return bank().get("command.group"); }

// ---- time ----

std::optional<TimePoint> BlvUnit::watchdog_due() const {
  const Duration timeout = bank().time(run_.watchdog, milliseconds(1));
  if (timeout == Duration::zero() || !last_query_) return std::nullopt;
  return *last_query_ + timeout;
}

std::optional<TimePoint> BlvUnit::next_step() const {
  const auto due = watchdog_due();
  if (due && configured_at_) return std::min(*due, *configured_at_);
  return due ? due : configured_at_;
}

void BlvUnit::step(TimePoint now) {
  if (configured_at_ && *configured_at_ <= now) finish_configuration(now);
  const auto due = watchdog_due();
  if (!due || *due > now) return;
  last_query_.reset();  // once, until the next query
  raise_alarm(timeout_alarm, now);
}

// ---- requests ----

Pdu BlvUnit::answer(ConnectionId connection, const Pdu& request, TimePoint now) {
  last_query_ = now;
  return Unit::answer(connection, request, now);
}

/// Why, unless it was said already, follows from the exception.
void BlvUnit::on_refusal(const Refusal& refused) {
  const auto exception = static_cast<ExceptionCode>(refused.exception);
  const bool is_unknown = exception == ExceptionCode::illegal_function ||
                          exception == ExceptionCode::illegal_data_address;
  note_error(refused.code != 0 ? refused.code : is_unknown ? undefined_command : outside_range);
}

void BlvUnit::note_error(std::int64_t code) {
  bank().set(refusals_.parameter, code);
  push_history(errors, code);
}

// In ascending order, value by value: what stands before a refused one has been written.
BlvUnit::Outcome BlvUnit::write(ConnectionId /*connection*/,
                                const modbus::WriteMultipleRequest& request, TimePoint now) {
  const std::uint16_t first = request.first.value;
  if (!bank().has(request.table, first, request.values.size())) {
    return refusal(ExceptionCode::illegal_data_address);
  }
  if (Outcome busy = check_busy(now)) return busy;
  for (const Change& change : bank().changes(request.table, first, request.values)) {
    if (change.cell == nullptr) return refusal(ExceptionCode::illegal_data_address);
    if (Outcome refused = write_value(change, now)) return refused;
  }
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::check_busy(TimePoint now) const {
  if (now < setter_until_) return refusal(ExceptionCode::server_device_failure, setter_busy);
  if (now < memory_until_) return refusal(ExceptionCode::server_device_failure, memory_busy);
  return std::nullopt;
}

// While the driver configures itself it takes commands and operation data, and obeys when it is
// done: the maker's own programs send both 30 ms behind Configuration. Everything else waits.
BlvUnit::Outcome BlvUnit::write_value(const Change& change, TimePoint now) {
  const Place& place = change.cell->place;
  if (configured_at_ && !operation_.contains(place.address)) {
    return refusal(ExceptionCode::server_device_failure, memory_busy);
  }
  const bool is_refused = bank().is_locked(*change.cell) || !change.cell->takes(change.registers);
  if (is_refused) return refusal(ExceptionCode::server_device_failure, outside_range);
  const std::int64_t raw = stored_in(place.encoding, change.registers);
  const auto command = std::find_if(commands_.begin(), commands_.end(), [&](const auto& each) {
    return place.table == RegisterTable::holding && each.address == place.address;
  });
  const bool is_edge =
      command != commands_.end() && raw == command->value && bank().stored(place) != command->value;
  if (is_edge) {
    if (Outcome refused = (this->*command->handler)(now)) return refused;
  }
  bank().put(place, change.registers);
  if (command == commands_.end()) on_write(place, raw, now);
  return std::nullopt;
}

void BlvUnit::on_write(const Place& /*place*/, std::int64_t /*raw*/, TimePoint now) { drive(now); }

// ---- maintenance commands ----

BlvUnit::Outcome BlvUnit::check_at_rest(TimePoint now) const {
  const bool at_rest = bank().get(run_.monitor.alarm) == 0 && !motor_.moves(now);
  if (at_rest) return std::nullopt;
  return refusal(ExceptionCode::server_device_failure, not_now);
}

BlvUnit::Outcome BlvUnit::check_memory() const {
  if (bank().get(run_.monitor.alarm) != memory_alarm) return std::nullopt;
  return refusal(ExceptionCode::server_device_failure, memory_busy);
}

BlvUnit::Outcome BlvUnit::reset_alarm(TimePoint now) {
  const std::int64_t present = bank().get(run_.monitor.alarm);
  if (is_permanent(present)) return std::nullopt;  // accepted, and without effect
  bank().set(run_.monitor.alarm, 0);
  bad_frames_ = 0;
  drive(now);  // a run command that is still on counts again
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::clear_alarm_history(TimePoint now) {
  clear_history(alarms);
  work(clearing, now);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::clear_warning_history(TimePoint /*now*/) {
  clear_history(warnings);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::clear_communication_history(TimePoint /*now*/) {
  clear_history(errors);
  bank().set(refusals_.parameter, 0);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::configure(TimePoint now) {
  if (Outcome refused = check_at_rest(now)) return refused;
  configured_at_ = now + configuring_;
  return std::nullopt;
}

void BlvUnit::finish_configuration(TimePoint now) {
  configured_at_.reset();
  const Duration waiting = waiting_time_;
  make_effective();
  waiting_time_ = waiting;  // that of the line waits for the next power-on
  drive(now);
}

BlvUnit::Outcome BlvUnit::initialize(TimePoint now) {
  if (Outcome refused = check_at_rest(now)) return refused;
  bank().copy_parameters(factory_, stored_, line_settings);
  bank().take_parameters(factory_, line_settings);
  work(storing, now);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::initialize_all(TimePoint now) {
  if (Outcome refused = check_at_rest(now)) return refused;
  bank().copy_parameters(factory_, stored_);
  bank().take_parameters(factory_);
  work(storing, now);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::load(TimePoint now) {
  if (Outcome refused = check_memory()) return refused;
  if (Outcome refused = check_at_rest(now)) return refused;
  bank().take_parameters(stored_);
  work(storing, now);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::save(TimePoint now) {
  if (Outcome refused = check_memory()) return refused;
  stored_ = bank().tables();
  work(storing, now);
  return std::nullopt;
}

// ---- the motor ----

std::uint32_t BlvUnit::mask_of(const std::string& parameter, std::string_view bit,
                               std::optional<std::int64_t> mode) const {
  for (const Parameter& word : words_) {
    if (word.name != parameter) continue;
    for (const catalogue::BitName& name : word.bits) {
      const bool counts = !name.when || name.when == mode;
      if (counts && name.text == bit) return 1U << name.bit;
    }
  }
  return 0;
}

std::uint16_t BlvUnit::standard_word() const {
  const auto word = static_cast<std::uint16_t>(bank().get(run_.command));
  const catalogue::InputSpec& inputs = run_.inputs;
  if (inputs.parameter.empty()) return word;
  std::vector<std::int64_t> numbers;
  for (std::uint16_t n = inputs.first; n <= inputs.last; ++n) {
    numbers.push_back(bank().get(catalogue::numbered_name(inputs.parameter, n)));
  }
  const catalogue::CommandBits bits(inputs, numbers);
  const auto known = static_cast<std::uint16_t>(word & ~unsigned{bits.unknown()});
  return bits.standard(known).value_or(0);
}

BlvUnit::Motion BlvUnit::motion_of(std::uint32_t word) const {
  const auto on = [&](std::string_view bit) {
    return (word & mask_of(run_.command, bit, mode_)) != 0;
  };
  const bool three_wire = mask_of(run_.command, "RUN/BRAKE", mode_) != 0;
  if (three_wire) {
    if (!on("RUN/BRAKE")) return Motion::brake;
    if (!on("START/STOP")) return Motion::decelerate;
    return on("FWD/REV") ? Motion::reverse : Motion::forward;
  }
  if (on("FWD") != on("REV")) return on("FWD") ? Motion::forward : Motion::reverse;
  return !on("FWD") && on("STOP-MODE") ? Motion::decelerate : Motion::brake;
}

std::int64_t BlvUnit::speed_of(std::uint16_t operation) const {
  const bool from_outside = analog_ != run_.digital && operation <= run_.analog_to;
  const std::int64_t speed = bank().get(
      from_outside ? "monitor.analog-speed" : catalogue::numbered_name(run_.speed, operation));
  return speed < slowest ? 0 : speed;
}

Duration BlvUnit::time_of(const std::string& pattern, std::uint16_t operation) const {
  return bank().time(catalogue::numbered_name(pattern, operation), std::chrono::seconds(1));
}

void BlvUnit::drive(TimePoint now) {
  if (bank().get(run_.monitor.alarm) != 0 || configured_at_) return;
  const std::uint32_t word = standard_word();
  const auto operation = static_cast<std::uint16_t>(
      (word & run_.select) >> static_cast<unsigned>(std::countr_zero(run_.select)));
  bank().set("monitor.operation-number", operation);
  const Duration up = time_of(run_.acceleration, operation);
  const Duration down = time_of(run_.deceleration, operation);
  switch (motion_of(word)) {
    case Motion::forward:
      motor_.go_to(speed_of(operation), up, down, now);
      break;
    case Motion::reverse:
      motor_.go_to(-speed_of(operation), up, down, now);
      break;
    case Motion::decelerate:
      if (motor_.target() != 0) motor_.go_to(0, up, down, now);
      break;
    case Motion::brake:
      motor_.brake(now);
      break;
  }
}

void BlvUnit::make_effective() {
  mode_ = bank().get(run_.mode);
  analog_ = bank().get(run_.analog);
  waiting_time_ = bank().time("communication.waiting-time", milliseconds(1));
}

std::uint32_t BlvUnit::status_word(TimePoint now) const {
  std::uint32_t word = static_cast<std::uint32_t>(bank().get(run_.command)) & 0x3FU;
  const auto show_bit = [&](bool on, std::uint32_t mask) { word |= on ? mask : 0U; };
  const std::int64_t alarm = bank().get(run_.monitor.alarm);
  const std::int64_t warning = bank().get(run_.monitor.warning);
  const std::int64_t off = std::abs(motor_.speed(now) - motor_.target());
  const bool near = motor_.target() != 0 && off <= bank().get("motor.attainment-band");
  show_bit(warning != 0, mask_of(run_.monitor.status, "WNG", std::nullopt));
  show_bit(alarm != 0, mask_of(run_.monitor.status, "ALARM-OUT1", std::nullopt));
  show_bit(alarm == overload || warning == overload,
           mask_of(run_.monitor.status, "ALARM-OUT2", std::nullopt));
  show_bit(busy(now), 1U << *run_.monitor.busy);
  show_bit(motor_.moves(now), 1U << *run_.monitor.running);
  show_bit(near, 1U << *run_.monitor.at_speed);
  return word;
}

// Monitors are looked at only when a client reads.
void BlvUnit::before_read(TimePoint now) {
  const bool alarm = bank().get(run_.monitor.alarm) != 0;
  const std::int64_t speed = motor_.speed(now);
  bank().set(run_.monitor.status, status_word(now));
  bank().set(run_.monitor.command_speed, alarm ? 0 : speed);
  bank().set(run_.monitor.feedback_speed, speed);
  bank().set("monitor.operating-speed", speed);
  bank().set(run_.monitor.load, motor_.target() != 0 ? load_ : 0);
}

// ---- what goes wrong ----

void BlvUnit::push_history(std::string_view name, std::int64_t code) {
  int last = 1;
  while (bank().find(nth(name, last + 1))) ++last;
  for (int n = last; n > 1; --n) bank().set(nth(name, n), bank().get(nth(name, n - 1)));
  bank().set(nth(name, 1), code);
}

void BlvUnit::clear_history(std::string_view name) {
  for (int n = 1; bank().find(nth(name, n)); ++n) bank().set(nth(name, n), 0);
}

void BlvUnit::raise_alarm(std::int64_t code, TimePoint now) {
  bank().set(run_.monitor.alarm, code);
  push_history(alarms, code);
  motor_.coast(now);
}

void BlvUnit::raise_warning(std::int64_t code, TimePoint /*now*/) {
  bank().set(run_.monitor.warning, code);
  if (code != 0) push_history(warnings, code);
}

void BlvUnit::hear_good_frame() {
  bad_frames_ = 0;
  if (bank().get(run_.monitor.warning) == transmission_error) bank().set(run_.monitor.warning, 0);
}

void BlvUnit::hear_bad_frame(TimePoint now) {
  ++bad_frames_;
  note_error(transmission_error);
  if (bank().get(run_.monitor.warning) != transmission_error)
    raise_warning(transmission_error, now);
  if (bad_frames_ == bank().get("communication.error-limit")) raise_alarm(line_alarm, now);
}

void BlvUnit::power_cycle(TimePoint now) {
  std::vector<std::int64_t> history;  // stays
  for (int n = 1; bank().find(nth(alarms, n)); ++n) history.push_back(bank().get(nth(alarms, n)));
  bank().set_tables(factory_);
  bank().take_parameters(stored_);
  int n = 0;
  for (const std::int64_t code : history) bank().set(nth(alarms, ++n), code);
  motor_.brake(now);
  bad_frames_ = 0;
  memory_until_ = TimePoint::min();
  configured_at_.reset();
  setter_until_ = TimePoint::min();
  last_query_.reset();
  make_effective();
}

}  // namespace spindle::sim
