#include "spindle/device/motor_watch.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "spindle/device/command_word.hpp"
#include "spindle/device/watcher.hpp"
#include "support/rig.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using device::CommandWord;
using device::EventMode;
using device::MotorEvent;
using device::MotorTransition;
using device::PolledValue;
using device::Reconnection;
using device::Samples;
using device::WatchControl;
using device::Watcher;
using device::WatchEvent;
using device::WatchPlan;

namespace {

constexpr std::uint16_t command_register = 0x007D;
constexpr std::uint16_t run_forward = 0x002A;
constexpr std::uint16_t status_register = 0x007E;
constexpr std::uint16_t warning_register = 150;

/// A watch of a motor.
struct Line : test::BlvRig {
  Line() {
    line.character_time = 1146us;
    plan = {.events = EventMode::none,
            .motor = *CommandWord::of(profile).value().monitor(),
            .samples = Samples::all};
  }

  Result<Watcher::Link> link() {
    auto device = connect();
    if (!device) return tl::unexpected(device.error());
    return Watcher::Link{std::move(*device), {}};
  }

  void watch(Duration time) {
    const TimePoint end = clock.now() + time;
    Watcher watcher([this] { return link(); },
                    [this](const catalogue::Profile&) -> Result<WatchPlan> { return plan; },
                    Reconnection::never, clock,
                    [this](const WatchEvent& one) {
                      if (const auto* motor = std::get_if<MotorTransition>(&one)) {
                        events.push_back(motor->event);
                        heard.push_back(clock.now());
                        states.push_back(motor->state);
                      }
                      if (std::holds_alternative<PolledValue>(one)) ++samples;
                      return WatchControl::go_on;
                    });
    REQUIRE(watcher.run([end] { return end; }));
  }

  void name(const std::string& parameter) {
    plan.values.push_back(profile.find(parameter).value());
  }
  [[nodiscard]] std::size_t requests() const { return wire.requests.size(); }
  /// Those that begin with this register.
  [[nodiscard]] std::size_t asked(std::uint16_t first) const {
    return static_cast<std::size_t>(std::count_if(
        wire.requests.begin(), wire.requests.end(),
        [first](const auto& request) { return get_u16(request.pdu.data, 0) == first; }));
  }

  WatchPlan plan = {};
  std::vector<MotorEvent> events = {};
  std::vector<TimePoint> heard = {};
  std::vector<device::MotorState> states = {};
  std::size_t samples = 0;
};

}  // namespace

TEST_CASE("one value that is asked for as fast as can be costs a tenth more than itself") {
  Line line;
  line.name("monitor.feedback-speed");
  line.plan.interval = 10ms;
  line.watch(60s);
  REQUIRE(line.samples > 500);
  CHECK(line.requests() <= line.samples * 11 / 10 + 8);
  CHECK(line.asked(status_register) > line.samples / 30);
  CHECK(line.asked(warning_register) > line.samples / 80);
}

TEST_CASE("where there is time, one piece of the motor's state is read between two polls") {
  Line line;
  line.name("monitor.feedback-speed");
  line.plan.interval = 200ms;
  line.watch(20s);
  CHECK(line.samples >= 100);
  CHECK(line.samples <= 101);
  CHECK(line.requests() <= 2 * line.samples + 8);
  CHECK(line.requests() >= 2 * line.samples - 8);
}

TEST_CASE("what is polled anyhow is not read again for the motor's sake") {
  Line line;
  for (const char* name : {"status.driver-output", "alarm.present", "warning.present"}) {
    line.name(name);
  }
  line.plan.interval = 200ms;
  line.watch(20s);
  CHECK(line.samples >= 300);
  CHECK(line.samples <= 303);
  // Status and alarm stand side by side, the warning apart; the mode that names bits comes seldom.
  CHECK(line.requests() <= 100 * 2 + 100 / 8 * 2 + 12);
}

TEST_CASE("a motor that is run and stopped by others is told soon, with the speed that it has") {
  for (const Duration interval : {10ms, 200ms}) {
    CAPTURE(interval.count());
    Line line;
    line.name("operation.2.speed");
    line.plan.interval = interval;
    const TimePoint began = line.clock.now();
    line.clock.at(began + 5s, [&] { line.write(command_register, run_forward); });
    line.clock.at(began + 10s, [&] { line.write(command_register, 0x0022); });
    line.watch(15s);
    REQUIRE(line.events == std::vector<MotorEvent>{MotorEvent::started, MotorEvent::at_speed,
                                                   MotorEvent::stopped});
    CHECK(line.heard[0] - began > 5s);
    CHECK(line.heard[0] - began < 6500ms);
    CHECK(line.states[0].feedback_speed > Decimal(0));
    CHECK(line.states[1].feedback_speed == Decimal(1000));
    CHECK(line.states[2].feedback_speed == Decimal(0));
  }
}
