#include "blv_unit.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

namespace spindle::sim {
namespace {

using catalogue::Parameter;
using modbus::ExceptionCode;
using modbus::Pdu;
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

// How long the driver works.
constexpr Duration storing = milliseconds(500);
constexpr Duration clearing = milliseconds(100);

// Below this a speed counts as standstill.
constexpr std::int64_t slowest = 80;

constexpr std::string_view alarms = "alarm.history";
constexpr std::string_view warnings = "warning.history";
constexpr std::string_view errors = "communication-error.history";

catalogue::CommandWordSpec word_facts(const catalogue::Profile& profile) {
  const auto* facts = profile.run ? profile.run->word() : nullptr;
  return facts == nullptr ? catalogue::CommandWordSpec{} : *facts;
}

}  // namespace

BlvUnit::BlvUnit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
                 std::uint8_t address, Duration configuring)
    : address_(address),
      run_(word_facts(profile)),
      refusals_(profile.refusals.value_or(catalogue::ExtendedErrorSpec{})),
      permanent_alarms_(start.permanent_alarms.begin(), start.permanent_alarms.end()),
      max_read_(profile.link.max_read),
      max_write_(profile.link.max_write),
      registers_(profile, start),
      load_(registers_.get(run_.monitor.load)),
      configuring_(configuring) {
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
    const auto cell = registers_.cell_at(action.address.value);
    if (known == handlers.end() || !action.value || !action.rest || !cell) continue;
    deeds_.push_back({cell->first, *action.value, known->second});
  }
  for (const catalogue::Text* name : {&run_.command, &run_.monitor.status}) {
    if (auto parameter = profile.find(*name)) words_.push_back(std::move(*parameter));
  }
  make_effective();
}

std::int64_t BlvUnit::group() const { return registers_.get("command.group"); }

// ---- time ----

std::optional<TimePoint> BlvUnit::watchdog_due() const {
  const Duration timeout = registers_.time(run_.watchdog, milliseconds(1));
  if (timeout == Duration::zero() || !last_query_) return std::nullopt;
  return *last_query_ + timeout;
}

void BlvUnit::advance(TimePoint now) {
  if (configured_at_ && *configured_at_ <= now) finish_configuration(*configured_at_);
  const auto due = watchdog_due();
  if (!due || *due > now) return;
  last_query_.reset();  // once, until the next query
  raise_alarm(timeout_alarm, *due);
}

std::optional<TimePoint> BlvUnit::next_change() const {
  const auto due = watchdog_due();
  if (due && configured_at_) return std::min(*due, *configured_at_);
  return due ? due : configured_at_;
}

// ---- requests ----

Pdu BlvUnit::answer(const Pdu& request, TimePoint now) {
  last_query_ = now;
  return respond(request, now);
}

Pdu BlvUnit::respond(const Pdu& request, TimePoint now) {
  const auto parsed = modbus::parse_request(request);
  if (!parsed) {
    const bool function = parsed.error() == ExceptionCode::illegal_function;
    return refuse(request, {parsed.error(), function ? undefined_command : outside_range});
  }
  if (const auto* wanted = std::get_if<modbus::ReadRequest>(&*parsed)) {
    const bool holding = wanted->table == modbus::RegisterTable::holding;
    if (holding || registers_.has_input()) return read(request, *wanted, now);
  }
  if (const auto* wanted = std::get_if<modbus::WriteSingleRequest>(&*parsed)) {
    const Registers one = {wanted->value};
    const Outcome refused = write(wanted->address.value, one, now);
    return refused ? refuse(request, *refused) : request;
  }
  if (const auto* wanted = std::get_if<modbus::WriteMultipleRequest>(&*parsed)) {
    const Outcome refused = write(wanted->first.value, wanted->values, now);
    if (refused) return refuse(request, *refused);
    return modbus::write_multiple_response(wanted->first,
                                           static_cast<std::uint16_t>(wanted->values.size()));
  }
  if (std::holds_alternative<modbus::LoopbackRequest>(*parsed)) return request;
  return refuse(request, {ExceptionCode::illegal_function, undefined_command});
}

Pdu BlvUnit::refuse(const Pdu& request, const Refusal& refusal) {
  note_error(refusal.code);
  return modbus::exception_response(request.function, static_cast<std::uint8_t>(refusal.exception));
}

void BlvUnit::note_error(std::int64_t code) {
  registers_.set(refusals_.parameter, code);
  registers_.push_history(errors, code);
}

Pdu BlvUnit::read(const Pdu& request, const modbus::ReadRequest& wanted, TimePoint now) {
  if (wanted.count > max_read_) {
    return refuse(request, {ExceptionCode::illegal_data_value, outside_range});
  }
  show(now);
  const auto words = registers_.read(wanted.table, wanted.first.value, wanted.count);
  if (!words) return refuse(request, {ExceptionCode::illegal_data_address, undefined_command});
  return modbus::read_response(wanted.table, *words);
}

// In ascending order, value by value: what stands before a refused one has been written.
BlvUnit::Outcome BlvUnit::write(std::uint16_t first, RegisterView values, TimePoint now) {
  if (values.size() > max_write_) {
    return Refusal{ExceptionCode::illegal_data_value, outside_range};
  }
  const Refusal no_such_register{ExceptionCode::illegal_data_address, undefined_command};
  if (!registers_.holds(first, values.size())) return no_such_register;
  if (Outcome busy = check_busy(now)) return busy;
  for (std::size_t i = 0; i < values.size();) {
    const auto cell = registers_.cell_at(static_cast<std::uint16_t>(first + i));
    if (!cell) return no_such_register;
    const std::uint32_t raw = registers_.with_words(*cell, first, values, i);
    if (Outcome refused = write_cell(*cell, raw, now)) return refused;
  }
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::check_busy(TimePoint now) const {
  if (now < setter_until_) return Refusal{ExceptionCode::server_device_failure, setter_busy};
  if (now < memory_until_) return Refusal{ExceptionCode::server_device_failure, memory_busy};
  return std::nullopt;
}

// While the driver configures itself it takes commands and operation data, and obeys when it is
// done: the maker's own programs send both 30 ms behind Configuration. Everything else waits.
BlvUnit::Outcome BlvUnit::write_cell(const BlvRegisters::Cell& cell, std::uint32_t raw,
                                     TimePoint now) {
  if (configured_at_ && !cell.operation) {
    return Refusal{ExceptionCode::server_device_failure, memory_busy};
  }
  if (!registers_.takes(cell, raw)) {
    return Refusal{ExceptionCode::server_device_failure, outside_range};
  }
  const std::uint32_t before = registers_.raw(cell);
  for (const Deed& deed : deeds_) {
    if (deed.first == cell.first) return use(deed, before, raw, now);
  }
  registers_.set_raw(cell, raw);
  obey(now);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::use(const Deed& deed, std::uint32_t before, std::uint32_t raw,
                              TimePoint now) {
  const bool edge = before != deed.value && raw == deed.value;
  if (edge) {
    if (Outcome refused = (this->*deed.handler)(now)) return refused;
  }
  if (const auto cell = registers_.cell_at(deed.first)) registers_.set_raw(*cell, raw);
  return std::nullopt;
}

// ---- maintenance commands ----

BlvUnit::Outcome BlvUnit::check_at_rest(TimePoint now) const {
  const bool at_rest = registers_.get(run_.monitor.alarm) == 0 && !motor_.moves(now);
  if (at_rest) return std::nullopt;
  return Refusal{ExceptionCode::server_device_failure, not_now};
}

BlvUnit::Outcome BlvUnit::check_memory() const {
  if (registers_.get(run_.monitor.alarm) != memory_alarm) return std::nullopt;
  return Refusal{ExceptionCode::server_device_failure, memory_busy};
}

BlvUnit::Outcome BlvUnit::reset_alarm(TimePoint now) {
  const std::int64_t present = registers_.get(run_.monitor.alarm);
  const bool stays = std::find(permanent_alarms_.begin(), permanent_alarms_.end(), present) !=
                     permanent_alarms_.end();
  if (stays) return std::nullopt;  // accepted, and without effect
  registers_.set(run_.monitor.alarm, 0);
  bad_frames_ = 0;
  obey(now);  // a run command that is still on counts again
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::clear_alarm_history(TimePoint now) {
  registers_.clear_history(alarms);
  work(clearing, now);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::clear_warning_history(TimePoint /*now*/) {
  registers_.clear_history(warnings);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::clear_communication_history(TimePoint /*now*/) {
  registers_.clear_history(errors);
  registers_.set(refusals_.parameter, 0);
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
  obey(now);
}

BlvUnit::Outcome BlvUnit::initialize(TimePoint now) {
  if (Outcome refused = check_at_rest(now)) return refused;
  registers_.initialize(BlvRegisters::Scope::without_the_line);
  work(storing, now);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::initialize_all(TimePoint now) {
  if (Outcome refused = check_at_rest(now)) return refused;
  registers_.initialize(BlvRegisters::Scope::everything);
  work(storing, now);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::load(TimePoint now) {
  if (Outcome refused = check_memory()) return refused;
  if (Outcome refused = check_at_rest(now)) return refused;
  registers_.load();
  work(storing, now);
  return std::nullopt;
}

BlvUnit::Outcome BlvUnit::save(TimePoint now) {
  if (Outcome refused = check_memory()) return refused;
  registers_.save();
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
  const auto word = static_cast<std::uint16_t>(registers_.get(run_.command));
  const catalogue::InputSpec& inputs = run_.inputs;
  if (inputs.parameter.empty()) return word;
  std::vector<std::int64_t> numbers;
  for (std::uint16_t n = inputs.first; n <= inputs.last; ++n) {
    numbers.push_back(registers_.get(catalogue::numbered_name(inputs.parameter, n)));
  }
  const catalogue::CommandBits bits(inputs, numbers);
  const auto known = static_cast<std::uint16_t>(word & ~unsigned{bits.unknown()});
  return bits.standard(known).value_or(0);
}

BlvUnit::Wish BlvUnit::wish_of(std::uint32_t word) const {
  const auto on = [&](std::string_view bit) {
    return (word & mask_of(run_.command, bit, mode_)) != 0;
  };
  const bool three_wire = mask_of(run_.command, "RUN/BRAKE", mode_) != 0;
  if (three_wire) {
    if (!on("RUN/BRAKE")) return Wish::brake;
    if (!on("START/STOP")) return Wish::decelerate;
    return on("FWD/REV") ? Wish::reverse : Wish::forward;
  }
  if (on("FWD") != on("REV")) return on("FWD") ? Wish::forward : Wish::reverse;
  return !on("FWD") && on("STOP-MODE") ? Wish::decelerate : Wish::brake;
}

std::int64_t BlvUnit::speed_of(std::uint16_t operation) const {
  const bool from_outside = analog_ != run_.digital && operation <= run_.analog_to;
  const std::int64_t speed = registers_.get(
      from_outside ? "monitor.analog-speed" : catalogue::numbered_name(run_.speed, operation));
  return speed < slowest ? 0 : speed;
}

Duration BlvUnit::time_of(const std::string& pattern, std::uint16_t operation) const {
  return registers_.time(catalogue::numbered_name(pattern, operation), std::chrono::seconds(1));
}

void BlvUnit::obey(TimePoint now) {
  if (registers_.get(run_.monitor.alarm) != 0 || configured_at_) return;
  const std::uint32_t word = standard_word();
  const auto operation = static_cast<std::uint16_t>(
      (word & run_.select) >> static_cast<unsigned>(std::countr_zero(run_.select)));
  registers_.set("monitor.operation-number", operation);
  const Duration up = time_of(run_.acceleration, operation);
  const Duration down = time_of(run_.deceleration, operation);
  switch (wish_of(word)) {
    case Wish::forward:
      motor_.go_to(speed_of(operation), up, down, now);
      break;
    case Wish::reverse:
      motor_.go_to(-speed_of(operation), up, down, now);
      break;
    case Wish::decelerate:
      if (motor_.target() != 0) motor_.go_to(0, up, down, now);
      break;
    case Wish::brake:
      motor_.brake(now);
      break;
  }
}

void BlvUnit::make_effective() {
  mode_ = registers_.get(run_.mode);
  analog_ = registers_.get(run_.analog);
  waiting_time_ = registers_.time("communication.waiting-time", milliseconds(1));
}

std::uint32_t BlvUnit::status_word(TimePoint now) const {
  std::uint32_t word = static_cast<std::uint32_t>(registers_.get(run_.command)) & 0x3FU;
  const auto show_bit = [&](bool on, std::uint32_t mask) { word |= on ? mask : 0U; };
  const std::int64_t alarm = registers_.get(run_.monitor.alarm);
  const std::int64_t warning = registers_.get(run_.monitor.warning);
  const std::int64_t off = std::abs(motor_.speed(now) - motor_.target());
  const bool near = motor_.target() != 0 && off <= registers_.get("motor.attainment-band");
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
void BlvUnit::show(TimePoint now) {
  const bool alarm = registers_.get(run_.monitor.alarm) != 0;
  const std::int64_t speed = motor_.speed(now);
  registers_.set(run_.monitor.status, status_word(now));
  registers_.set(run_.monitor.command_speed, alarm ? 0 : speed);
  registers_.set(run_.monitor.feedback_speed, speed);
  registers_.set("monitor.operating-speed", speed);
  registers_.set(run_.monitor.load, motor_.target() != 0 ? load_ : 0);
}

// ---- what goes wrong ----

void BlvUnit::raise_alarm(std::int64_t code, TimePoint now) {
  registers_.set(run_.monitor.alarm, code);
  registers_.push_history(alarms, code);
  motor_.coast(now);
}

void BlvUnit::raise_warning(std::int64_t code, TimePoint /*now*/) {
  registers_.set(run_.monitor.warning, code);
  if (code != 0) registers_.push_history(warnings, code);
}

void BlvUnit::hear_good_frame() {
  bad_frames_ = 0;
  if (registers_.get(run_.monitor.warning) == transmission_error)
    registers_.set(run_.monitor.warning, 0);
}

void BlvUnit::hear_bad_frame(TimePoint now) {
  ++bad_frames_;
  note_error(transmission_error);
  if (registers_.get(run_.monitor.warning) != transmission_error)
    raise_warning(transmission_error, now);
  if (bad_frames_ == registers_.get("communication.error-limit")) raise_alarm(line_alarm, now);
}

void BlvUnit::power_cycle(TimePoint now) {
  registers_.restart();
  motor_.brake(now);
  bad_frames_ = 0;
  memory_until_ = TimePoint::min();
  configured_at_.reset();
  setter_until_ = TimePoint::min();
  last_query_.reset();
  make_effective();
}

}  // namespace spindle::sim
