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
    for (const std::uint8_t address : options.units) {
      if (!is_network_ || units_.empty()) units_.push_back(make(address));
    }
    for (const Raised& alarm : options.alarms) scheduled_.push_back({alarm, &Unit::raise_alarm});
    for (const Raised& warning : options.warnings) {
      scheduled_.push_back({warning, &Unit::raise_warning});
    }
    std::stable_sort(
        scheduled_.begin(), scheduled_.end(),
        [](const Scheduled& a, const Scheduled& b) { return a.raised.after < b.raised.after; });
    const catalogue::SerialSpec& serial = profile.link.serial;
    const unsigned baud = options.baud == 0 ? serial.line.baud : options.baud;
    gap_ = serial.gap_at(baud).value_or(Duration());
  }

  std::optional<Pdu> answer(ConnectionId connection, modbus::UnitId asked, const Pdu& request,
                            TimePoint now) override {
    advance(now);
    std::optional<Pdu> response;
    for (const auto& unit : units_) {
      unit->hear_good_frame();
      if (asked.value == unit->address() || is_network_) {
        response = unit->answer(connection, request, now);
      } else if (asked.value == broadcast ? modbus::is_write(request.function)
                                          : follows(*unit, asked, request)) {
        unit->answer(connection, request, now);  // and no client hears what it says to it
      }
    }
    return response;
  }

  [[nodiscard]] bool answers_to(modbus::UnitId asked) const override {
    return is_network_ || std::any_of(units_.begin(), units_.end(), [asked](const auto& unit) {
             return unit->address() == asked.value;
           });
  }
  [[nodiscard]] modbus::UnitId answering_unit(modbus::UnitId asked) const override {
    return units_.empty() ? asked : units_.front()->answers_as(asked);
  }
  [[nodiscard]] Duration required_gap() const override { return gap_; }
  [[nodiscard]] Duration answer_delay(modbus::UnitId asked) const override {
    for (const auto& unit : units_) {
      if (unit->address() == asked.value) return unit->waiting_time();
    }
    return {};
  }
  void bad_frame(TimePoint now) override {
    advance(now);
    for (const auto& unit : units_) unit->hear_bad_frame(now);
  }

  void advance(TimePoint now) override {
    if (!begin_) begin_ = now;
    std::erase_if(scheduled_, [&](const Scheduled& each) {
      const TimePoint due = *begin_ + each.raised.after;
      if (due > now) return false;
      for (const auto& unit : units_) {
        unit->advance(due);
        (*unit.*each.raise)(each.raised.code, due);
      }
      return true;
    });
    for (const auto& unit : units_) unit->advance(now);
  }
  [[nodiscard]] std::optional<TimePoint> next_change() const override {
    std::optional<TimePoint> next;
    for (const auto& unit : units_) {
      const auto due = unit->next_change();
      if (due && (!next || *due < *next)) next = due;
    }
    for (const Scheduled& each : scheduled_) {
      if (!begin_) break;
      const TimePoint due = *begin_ + each.raised.after;
      if (!next || due < *next) next = due;
    }
    return next;
  }

  std::vector<Push> take_pushes() override {
    std::vector<Push> all;
    for (const auto& unit : units_) append(unit->events().take_pushes(), all);
    return all;
  }
  std::vector<Push> take_pushes(ConnectionId connection) override {
    std::vector<Push> all;
    for (const auto& unit : units_) append(unit->events().take_pushes(connection), all);
    return all;
  }
  [[nodiscard]] std::optional<Pdu> event_frame() const override {
    return units_.empty() ? std::nullopt : std::as_const(*units_.front()).events().frame();
  }
  void connected(ConnectionId connection) override {
    for (const auto& unit : units_) unit->events().connected(connection);
  }
  void disconnected(ConnectionId connection) override {
    for (const auto& unit : units_) unit->events().disconnected(connection);
  }

  void operator_rundown(Rundown outcome, TimePoint now) override {
    advance(now);
    for (const auto& unit : units_) unit->operate(outcome, 1, now);
  }
  void happen(catalogue::EventKind kind, TimePoint now) override {
    advance(now);
    for (const auto& unit : units_) unit->happen(kind, now);
  }
  void raise_alarm(std::uint8_t address, std::uint16_t code, TimePoint now) override {
    advance(now);
    if (Unit* unit = find(address)) unit->raise_alarm(code, now);
  }
  void raise_warning(std::uint8_t address, std::uint16_t code, TimePoint now) override {
    advance(now);
    if (Unit* unit = find(address)) unit->raise_warning(code, now);
  }
  void use_setter(std::uint8_t address, TimePoint until) override {
    if (Unit* unit = find(address)) unit->use_setter(until);
  }
  void reboot(TimePoint now) override {
    advance(now);
    for (const auto& unit : units_) unit->power_cycle(now);
  }
  void power_cycle(std::uint8_t address, TimePoint now) override {
    advance(now);
    if (Unit* unit = find(address)) unit->power_cycle(now);
  }

 private:
  static void append(std::vector<Push> more, std::vector<Push>& all) {
    all.insert(all.end(), std::make_move_iterator(more.begin()),
               std::make_move_iterator(more.end()));
  }

  struct Scheduled {
    Raised raised;
    void (Unit::*raise)(std::int64_t code, TimePoint now);
  };

  // A group send reaches children by function 10h only.
  static bool follows(const Unit& child, modbus::UnitId parent, const Pdu& request) {
    return child.group() == parent.value &&
           request.function ==
               static_cast<std::uint8_t>(modbus::FunctionCode::write_multiple_registers);
  }
  Unit* find(std::uint8_t address) {
    const auto found = std::find_if(units_.begin(), units_.end(), [&](const auto& unit) {
      return is_network_ || unit->address() == address;
    });
    return found == units_.end() ? nullptr : found->get();
  }

  bool is_network_;  ///< there is one unit, whose number does not matter
  std::vector<std::unique_ptr<Unit>> units_ = {};
  std::vector<Scheduled> scheduled_ = {};
  std::optional<TimePoint> begin_ = std::nullopt;
  Duration gap_ = {};
};

}  // namespace

std::unique_ptr<SimulatedBus> make_bus(const catalogue::Profile& profile,
                                       const DeviceOptions& options, const MakeUnit& make) {
  return std::make_unique<Bus>(profile, options, make);
}

}  // namespace spindle::sim
