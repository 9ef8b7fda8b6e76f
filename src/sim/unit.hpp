#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <tl/expected.hpp>

#include "event_block.hpp"
#include "faulty_store.hpp"
#include "register_bank.hpp"
#include "spindle/base/clock.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/sim/simulated_tool.hpp"

namespace spindle::sim {

/// One simulated device: takes requests apart, and has registers, events and an identity as its
/// profile says. What a model of device adds overrides the hooks. Knows nothing of other devices or
/// of frames.
class Unit {
 public:
  Unit(const catalogue::Profile& profile, const catalogue::SimulationSpec& start,
       std::uint8_t address, const DeviceOptions& options,
       RegisterBank::Commands commands = RegisterBank::Commands::readable);
  Unit(const Unit&) = delete;
  Unit& operator=(const Unit&) = delete;
  virtual ~Unit() = default;

  [[nodiscard]] std::uint8_t address() const { return address_; }
  /// The unit whose group it belongs to; 0: none.
  [[nodiscard]] virtual std::int64_t group() const { return 0; }
  /// Time between a query and its answer, the gap not counted.
  [[nodiscard]] virtual Duration waiting_time() const { return {}; }

  /// The unit identifier of its answers to this one, on a network.
  [[nodiscard]] virtual modbus::UnitId answers_as(modbus::UnitId asked) const { return asked; }

  void advance(TimePoint now);
  [[nodiscard]] std::optional<TimePoint> next_change() const;

  /// A query for this unit, its group or all units.
  virtual modbus::Pdu answer(ConnectionId connection, const modbus::Pdu& request, TimePoint now);
  /// A good frame for any unit; a bad one was meant for an unknown one.
  virtual void hear_good_frame() {}
  virtual void hear_bad_frame(TimePoint now) { static_cast<void>(now); }
  [[nodiscard]] EventBlock& events() { return events_; }
  [[nodiscard]] const EventBlock& events() const { return events_; }

  /// An event occurs, which says what the start state has for its kind, in turn.
  virtual void happen(catalogue::EventKind kind, TimePoint now);
  /// The operator works, with so many results at once. Whether the device let him.
  virtual bool operate(Rundown outcome, unsigned results, TimePoint now);
  virtual void raise_alarm(std::int64_t code, TimePoint now) = 0;
  /// A warning begins; 0 ends it.
  virtual void raise_warning(std::int64_t code, TimePoint now) = 0;
  virtual void use_setter(TimePoint until) { static_cast<void>(until); }
  virtual void power_cycle(TimePoint now) = 0;

 protected:
  /// Why a request is refused.
  struct Refusal {
    std::uint8_t exception = 0;
    std::int64_t code = 0;  ///< in the product's own words; 0: as the exception says
  };
  using Outcome = std::optional<Refusal>;  ///< empty: it is done
  static Refusal refusal(modbus::ExceptionCode exception, std::int64_t code = 0) {
    return {static_cast<std::uint8_t>(exception), code};
  }

  // Hooks.

  /// Clients are about to read: what the device shows of itself becomes that of now.
  virtual void before_read(TimePoint now) { static_cast<void>(now); }
  /// Some values are written, as many as the device takes. All of them or none, each one whole: a
  /// register alone changes one half of its value.
  virtual Outcome write(ConnectionId connection, const modbus::WriteMultipleRequest& request,
                        TimePoint now);
  /// A value was written and stored; `raw` as stored_in() gives it.
  virtual void on_write(const Place& place, std::int64_t raw, TimePoint now) = 0;
  /// A request is about to be refused.
  virtual void on_refusal(const Refusal& refused) { static_cast<void>(refused); }
  /// When something will happen by itself, beside what the operator does; and its moment has come.
  [[nodiscard]] virtual std::optional<TimePoint> next_step() const { return std::nullopt; }
  virtual void step(TimePoint now) { static_cast<void>(now); }

  [[nodiscard]] RegisterBank& bank() { return bank_; }
  [[nodiscard]] const RegisterBank& bank() const { return bank_; }
  /// Whether only switching off and on ends this alarm.
  [[nodiscard]] bool is_permanent(std::int64_t alarm) const;

 private:
  using Answer = tl::expected<modbus::Pdu, Refusal>;

  struct Query {
    ConnectionId connection;
    const modbus::Pdu& pdu;
    TimePoint now;
  };

  Answer respond(const Query& query);
  Answer serve(const modbus::ReadRequest& request, const Query& query);
  Answer serve(const modbus::WriteSingleRequest& request, const Query& query);
  Answer serve(const modbus::WriteMultipleRequest& request, const Query& query);
  [[nodiscard]] Answer serve(const modbus::LoopbackRequest& request, const Query& query) const;
  [[nodiscard]] Answer serve(const modbus::ReportServerIdRequest& request,
                             const Query& query) const;
  Answer serve_write(const modbus::WriteMultipleRequest& request, modbus::Pdu response,
                     const Query& query);
  [[nodiscard]] bool writes_with(std::uint8_t function) const;
  [[nodiscard]] Outcome check_write(std::uint8_t function,
                                    const modbus::WriteMultipleRequest& request) const;
  [[nodiscard]] Outcome check(const Change& change) const;
  void run_down(TimePoint now);

  std::uint8_t address_;
  catalogue::LinkSpec link_;
  RegisterBank bank_;
  EventBlock events_;
  FaultyStore store_;
  Bytes identity_;
  std::uint8_t limit_exception_;
  catalogue::List<std::int64_t> permanent_alarms_;
  catalogue::List<catalogue::SimulationSpec::Event> event_values_;  ///< what events say
  std::map<catalogue::EventKind, std::size_t> turns_ = {};

  std::optional<Duration> rundown_every_;
  unsigned ng_every_;
  unsigned burst_;
  std::optional<TimePoint> next_rundown_ = std::nullopt;
  unsigned rundowns_ = 0;
};

}  // namespace spindle::sim
