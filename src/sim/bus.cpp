#include "bus.hpp"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace spindle::sim {
namespace {

using modbus::Pdu;

constexpr std::uint8_t broadcast = 0;

class Bus final : public SimulatedBus {
 public:
  Bus(const catalogue::Profile& profile, const DeviceOptions& options, const MakeUnit& make)
      : is_network_(profile.link.framing == modbus::Framing::tcp) {
    for (const std::uint8_t unit : options.units) {
      if (!is_network_ || units_.empty()) units_.push_back(make(unit));
    }
    for (const Raised& alarm : options.alarms) trouble_.push_back({alarm, &Unit::raise_alarm});
    for (const Raised& warning : options.warnings) {
      trouble_.push_back({warning, &Unit::raise_warning});
    }
    std::stable_sort(trouble_.begin(), trouble_.end(), [](const Trouble& a, const Trouble& b) {
      return a.raised.after < b.raised.after;
    });
    const catalogue::SerialSpec& serial = profile.link.serial;
    const unsigned baud = options.baud == 0 ? serial.line.baud : options.baud;
    gap_ = serial.gap_at(baud).value_or(Duration());
  }

  std::optional<Pdu> answer(ConnectionId connection, modbus::UnitId unit, const Pdu& request,
                            TimePoint now) override {
    advance(now);
    std::optional<Pdu> response;
    for (const auto& one : units_) {
      one->hear_good_frame();
      if (unit.value == one->address() || is_network_) {
        response = one->answer(connection, request, now);
      } else if (unit.value == broadcast ? is_write(request) : follows(*one, unit, request)) {
        one->answer(connection, request, now);  // and no client hears what it says to it
      }
    }
    return response;
  }

  [[nodiscard]] bool answers_to(modbus::UnitId unit) const override {
    return is_network_ || std::any_of(units_.begin(), units_.end(), [unit](const auto& one) {
             return one->address() == unit.value;
           });
  }
  [[nodiscard]] Duration required_gap() const override { return gap_; }
  [[nodiscard]] Duration answer_delay(modbus::UnitId unit) const override {
    for (const auto& one : units_) {
      if (one->address() == unit.value) return one->waiting_time();
    }
    return {};
  }
  void bad_frame(TimePoint now) override {
    advance(now);
    for (const auto& one : units_) one->hear_bad_frame(now);
  }

  void advance(TimePoint now) override {
    if (!begin_) begin_ = now;
    std::erase_if(trouble_, [&](const Trouble& trouble) {
      const TimePoint due = *begin_ + trouble.raised.after;
      if (due > now) return false;
      for (const auto& one : units_) {
        one->advance(due);
        (*one.*trouble.raise)(trouble.raised.code, due);
      }
      return true;
    });
    for (const auto& one : units_) one->advance(now);
  }
  [[nodiscard]] std::optional<TimePoint> next_change() const override {
    std::optional<TimePoint> next;
    for (const auto& one : units_) {
      const auto due = one->next_change();
      if (due && (!next || *due < *next)) next = due;
    }
    for (const Trouble& trouble : trouble_) {
      if (!begin_) break;
      const TimePoint due = *begin_ + trouble.raised.after;
      if (!next || due < *next) next = due;
    }
    return next;
  }

  std::vector<Push> take_pushes() override {
    std::vector<Push> all;
    for (const auto& one : units_) append(one->events().take_pushes(), all);
    return all;
  }
  std::vector<Push> take_pushes(ConnectionId connection) override {
    std::vector<Push> all;
    for (const auto& one : units_) append(one->events().take_pushes(connection), all);
    return all;
  }
  [[nodiscard]] std::optional<Pdu> event_frame() const override {
    return units_.empty() ? std::nullopt : std::as_const(*units_.front()).events().frame();
  }
  void connected(ConnectionId connection) override {
    for (const auto& one : units_) one->events().connected(connection);
  }
  void disconnected(ConnectionId connection) override {
    for (const auto& one : units_) one->events().disconnected(connection);
  }

  void operator_rundown(Rundown outcome, TimePoint now) override {
    advance(now);
    for (const auto& one : units_) one->operate(outcome, 1, now);
  }
  void happen(catalogue::EventKind kind, TimePoint now) override {
    advance(now);
    for (const auto& one : units_) one->happen(kind, now);
  }
  void raise_alarm(std::uint8_t unit, std::uint16_t code, TimePoint now) override {
    advance(now);
    if (Unit* one = find(unit)) one->raise_alarm(code, now);
  }
  void raise_warning(std::uint8_t unit, std::uint16_t code, TimePoint now) override {
    advance(now);
    if (Unit* one = find(unit)) one->raise_warning(code, now);
  }
  void use_setter(std::uint8_t unit, TimePoint until) override {
    if (Unit* one = find(unit)) one->use_setter(until);
  }
  void reboot(TimePoint now) override {
    advance(now);
    for (const auto& one : units_) one->power_cycle(now);
  }
  void power_cycle(std::uint8_t unit, TimePoint now) override {
    advance(now);
    if (Unit* one = find(unit)) one->power_cycle(now);
  }

 private:
  static void append(std::vector<Push> more, std::vector<Push>& all) {
    all.insert(all.end(), std::make_move_iterator(more.begin()),
               std::make_move_iterator(more.end()));
  }

  struct Trouble {
    Raised raised;
    void (Unit::*raise)(std::int64_t code, TimePoint now);
  };

  static bool is_write(const Pdu& request) {
    const auto function = static_cast<modbus::FunctionCode>(request.function);
    return function == modbus::FunctionCode::write_single_register ||
           function == modbus::FunctionCode::write_multiple_registers;
  }
  // A group send reaches children by function 10h only.
  static bool follows(const Unit& child, modbus::UnitId parent, const Pdu& request) {
    return child.group() == parent.value &&
           request.function ==
               static_cast<std::uint8_t>(modbus::FunctionCode::write_multiple_registers);
  }
  Unit* find(std::uint8_t unit) {
    const auto found = std::find_if(units_.begin(), units_.end(), [&](const auto& one) {
      return is_network_ || one->address() == unit;
    });
    return found == units_.end() ? nullptr : found->get();
  }

  bool is_network_;  ///< there is one unit, whose number does not matter
  std::vector<std::unique_ptr<Unit>> units_ = {};
  std::vector<Trouble> trouble_ = {};
  std::optional<TimePoint> begin_ = std::nullopt;
  Duration gap_ = {};
};

}  // namespace

std::unique_ptr<SimulatedBus> make_bus(const catalogue::Profile& profile,
                                       const DeviceOptions& options, const MakeUnit& make) {
  return std::make_unique<Bus>(profile, options, make);
}

}  // namespace spindle::sim
