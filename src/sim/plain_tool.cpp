#include "spindle/sim/plain_tool.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "event_unit.hpp"
#include "faulty_store.hpp"
#include "register_bank.hpp"
#include "spindle/modbus/pdu.hpp"

namespace spindle::sim {
namespace {

using catalogue::EventKind;
using modbus::ExceptionCode;
using modbus::Pdu;

Pdu refusal(const Pdu& request, ExceptionCode code) {
  return modbus::exception_response(request.function, static_cast<std::uint8_t>(code));
}

/// The parameter that shows the present alarm; empty: none does.
std::string present_alarm(const catalogue::Profile& profile) {
  for (const catalogue::AlarmList& list : profile.alarm_lists) {
    if (list.name == "present" && !list.parameters.empty()) return list.parameters.front();
  }
  return {};
}

class SimulatedPlain final : public PlainTool {
 public:
  SimulatedPlain(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
                 const PlainOptions& options);

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
  void reboot(TimePoint now) override;
  void happen(EventKind kind, TimePoint now) override;

 private:
  [[nodiscard]] Pdu read(const Pdu& request, const modbus::ReadRequest& wanted);
  [[nodiscard]] Pdu write(ConnectionId connection, const Pdu& request,
                          modbus::RegisterAddress first, RegisterView values, TimePoint now);
  [[nodiscard]] std::optional<ExceptionCode> check(modbus::RegisterAddress first,
                                                   RegisterView values) const;
  [[nodiscard]] bool is_command(std::uint16_t address) const;
  void obey(std::uint16_t address, std::uint16_t value);
  [[nodiscard]] std::optional<TimePoint> next_alarm() const;
  void work(TimePoint now);

  RegisterBank registers_;
  EventUnit events_;
  FaultyStore store_;
  catalogue::List<catalogue::Action> actions_;
  catalogue::LinkSpec link_;
  catalogue::List<catalogue::SimulationSpec::Event> told_;  ///< what events say, in turn
  std::map<EventKind, std::size_t> turns_ = {};
  std::uint8_t limit_exception_;
  Bytes identity_;
  std::string alarm_;
  PlainOptions options_;
  std::optional<TimePoint> begin_ = std::nullopt;
  std::optional<TimePoint> next_result_ = std::nullopt;
  unsigned results_ = 0;
};

SimulatedPlain::SimulatedPlain(const catalogue::Profile& profile,
                               const catalogue::SimulationSpec& start, const PlainOptions& options)
    : registers_(profile, start),
      events_(profile),
      store_(options.faults),
      actions_(profile.actions),
      link_(profile.link),
      told_(start.events),
      limit_exception_(start.limit_exception),
      identity_(start.identity.begin(),
                start.identity.begin() + static_cast<std::ptrdiff_t>(start.identity_bytes)),
      alarm_(present_alarm(profile)),
      options_(options) {
  std::sort(options_.alarms.begin(), options_.alarms.end(),
            [](const Raised& a, const Raised& b) { return a.after > b.after; });
}

std::optional<Pdu> SimulatedPlain::answer(ConnectionId connection, modbus::UnitId /*unit*/,
                                          const Pdu& request, TimePoint now) {
  advance(now);
  const auto parsed = modbus::parse_request(request);
  if (!parsed) return refusal(request, parsed.error());
  if (const auto* wanted = std::get_if<modbus::ReadRequest>(&*parsed)) {
    return read(request, *wanted);
  }
  if (const auto* wanted = std::get_if<modbus::WriteSingleRequest>(&*parsed)) {
    return write(connection, request, wanted->address, Registers{wanted->value}, now);
  }
  if (const auto* wanted = std::get_if<modbus::WriteMultipleRequest>(&*parsed)) {
    return write(connection, request, wanted->first, wanted->values, now);
  }
  if (std::holds_alternative<modbus::LoopbackRequest>(*parsed) && link_.loopback) return request;
  const bool asks = std::holds_alternative<modbus::ReportServerIdRequest>(*parsed);
  if (asks && !identity_.empty()) return modbus::report_server_id_response(identity_);
  return refusal(request, ExceptionCode::illegal_function);
}

Pdu SimulatedPlain::read(const Pdu& request, const modbus::ReadRequest& wanted) {
  if (wanted.count > link_.max_read) return refusal(request, ExceptionCode::illegal_data_value);
  const auto found = registers_.read(wanted.table, wanted.first.value, wanted.count);
  if (!found) return refusal(request, ExceptionCode::illegal_data_address);
  events_.note_read(wanted, registers_);
  return modbus::read_response(wanted.table, *found);
}

std::optional<ExceptionCode> SimulatedPlain::check(modbus::RegisterAddress first,
                                                   RegisterView values) const {
  if (values.size() > link_.max_write) return ExceptionCode::illegal_data_value;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto address = static_cast<std::uint16_t>(first.value + i);
    if (events_.is_arming(address) || is_command(address)) continue;
    switch (registers_.check_write(address, values[i])) {
      case WriteVerdict::no_such_register:
        return ExceptionCode::illegal_data_address;
      case WriteVerdict::outside_limits:
        return static_cast<ExceptionCode>(limit_exception_);
      case WriteVerdict::allowed:
        break;
    }
  }
  return std::nullopt;
}

Pdu SimulatedPlain::write(ConnectionId connection, const Pdu& request,
                          modbus::RegisterAddress first, RegisterView values, TimePoint now) {
  if (const auto code = check(first, values)) return refusal(request, *code);
  const bool done = store_.accept();
  for (std::size_t i = 0; done && i < values.size(); ++i) {
    const auto address = static_cast<std::uint16_t>(first.value + i);
    if (events_.is_arming(address)) {
      events_.arm(connection, values[i], now);
    } else if (is_command(address)) {
      obey(address, values[i]);
    } else {
      store_.store(address, values[i], registers_);
    }
  }
  constexpr auto single = static_cast<std::uint8_t>(modbus::FunctionCode::write_single_register);
  if (request.function == single) return request;  // the echo
  return modbus::write_multiple_response(first, static_cast<std::uint16_t>(values.size()));
}

bool SimulatedPlain::is_command(std::uint16_t address) const {
  return std::any_of(actions_.begin(), actions_.end(), [&](const catalogue::Action& action) {
    return action.address.value == address;
  });
}

/// What an action does is what its confirming parameter shows.
void SimulatedPlain::obey(std::uint16_t address, std::uint16_t value) {
  registers_.store(address, value);
  for (const catalogue::Action& action : actions_) {
    if (action.address.value != address || (action.value && value != *action.value)) continue;
    registers_.set_raw(action.confirm, action.confirm_value.value_or(value));
  }
}

std::optional<TimePoint> SimulatedPlain::next_alarm() const {
  if (!begin_ || options_.alarms.empty()) return std::nullopt;
  return *begin_ + options_.alarms.back().after;
}

std::optional<TimePoint> SimulatedPlain::next_change() const {
  const auto alarm = next_alarm();
  if (!alarm || !next_result_) return alarm ? alarm : next_result_;
  return std::min(*alarm, *next_result_);
}

void SimulatedPlain::advance(TimePoint now) {
  if (!begin_) begin_ = now;
  const bool works = options_.rundown_every && *options_.rundown_every > Duration::zero();
  if (works && !next_result_) next_result_ = now + *options_.rundown_every;
  for (auto due = next_change(); due && *due <= now; due = next_change()) {
    if (next_result_ && *next_result_ <= *due) work(*due);
    if (const auto alarm = next_alarm(); alarm && *alarm <= *due) {
      registers_.set(alarm_, options_.alarms.back().code);
      options_.alarms.pop_back();
      happen(EventKind::error, *due);
    }
  }
}

void SimulatedPlain::work(TimePoint now) {
  next_result_ = now + *options_.rundown_every;
  ++results_;
  const bool fails = options_.ng_every != 0 && results_ % options_.ng_every == 0;
  for (unsigned told = 0; told < options_.burst; ++told) {
    happen(fails ? EventKind::fastening_ng : EventKind::fastening_ok, now);
  }
}

void SimulatedPlain::happen(EventKind kind, TimePoint now) {
  if (!events_.knows(kind)) return;
  const auto says = [kind](const auto& event) { return event.kind == kind; };
  const auto choices = static_cast<std::size_t>(std::count_if(told_.begin(), told_.end(), says));
  if (choices > 0) {
    std::size_t turn = turns_[kind]++ % choices;
    const auto chosen = std::find_if(told_.begin(), told_.end(),
                                     [&](const auto& event) { return says(event) && turn-- == 0; });
    for (const auto& value : chosen->values) registers_.set_raw(value.pattern, value.raw);
  }
  events_.emit(kind, {}, registers_, now);
}

void SimulatedPlain::reboot(TimePoint now) {
  advance(now);
  registers_.set(alarm_, 0);
  events_.reboot(registers_);
}

}  // namespace

std::unique_ptr<PlainTool> make_plain_tool(const catalogue::Profile& profile,
                                           const catalogue::SimulationSpec& start,
                                           const PlainOptions& options) {
  return std::make_unique<SimulatedPlain>(profile, start, options);
}

}  // namespace spindle::sim
