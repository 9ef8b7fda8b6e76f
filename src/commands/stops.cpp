#include "stops.hpp"

#include <array>

#include "records.hpp"

namespace spindle::commands {
namespace {

std::string_view to_text(device::StopResult result) {
  switch (result) {
    case device::StopResult::confirmed:
      return "confirmed";
    case device::StopResult::sent:
      return "sent";
    case device::StopResult::unconfirmed:
      return "not-confirmed";
  }
  return "";
}

}  // namespace

Result<void> broadcast_stop(device::Device& device, const device::Motor& motor,
                            catalogue::StopMode mode) {
  const catalogue::RunFacts& facts = motor.facts();
  const bool gently = mode == catalogue::StopMode::decelerate && !motor.has_inputs();
  const std::uint16_t word = gently ? facts.decelerate_always : motor.idle_word();
  Result<void> sent;
  for (int again = 0; again < most_stops && sent; ++again) sent = motor.broadcast(device, word);
  return sent;
}

bool leaves_open(const Result<device::StopResult>& stopped) {
  if (stopped) return *stopped == device::StopResult::unconfirmed;
  return link::is_lost_answer(stopped.error());
}

Result<device::StopResult> stop_motor(OpenTool& tool, catalogue::StopMode mode,
                                      const Context& context) {
  const auto motor = device::Motor::of(*tool.profile);
  if (!motor) return tl::unexpected(motor.error());
  if (tool.target.reach == Reach::everybody) {
    return broadcast_stop(tool.device, *motor, mode).map([] { return device::StopResult::sent; });
  }
  device::MotorStopper stopper(*motor, mode);
  tool.device.set_retries(0);  // it is better to send the stop soon, and again
  tool.device.session().waive_proofs();
  stopper.observe(tool.device);
  auto stopped = stopper.stop(tool.device, context.clock);
  for (int again = 1; again < most_stops && leaves_open(stopped); ++again) {
    stopped = stopper.stop(tool.device, context.clock);
  }
  return stopped;
}

Result<catalogue::Action> find_start(const catalogue::Profile& profile) {
  auto start = profile.find_action("start");
  if (start && start->value && start->stop_value) return start;
  return tl::unexpected(Error{.code = Errc::usage,
                              .message = "this product can not be started and stopped by Modbus",
                              .hint = "start and stop it at the tool",
                              .name = profile.id});
}

report::Record stop_record(device::StopResult result, const Target& target, const Clock& clock) {
  return {.type = "action",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"action", std::string("stop")},
                     {"value", report::Cell()},
                     {"result", std::string(to_text(result))}}};
}

std::span<const report::Column> stop_columns() {
  static const std::array<report::Column, 3> columns = {
      {{"TARGET", "target"}, {"ACTION", "action"}, {"RESULT", "result"}}};
  return columns;
}

std::string where_to_stop(const catalogue::Profile* profile) {
  const std::string here = "stop it at the tool";
  const bool has_more = profile != nullptr && profile->run && !profile->run->still_runs.empty();
  return has_more ? here + "; " + profile->run->still_runs : here;
}

Error still_runs(const Target& target, const catalogue::Profile* profile) {
  return target.blamed(
      {.code = Errc::mismatch,
       .message = "the stop was acknowledged, but the tool still says that it runs",
       .hint = where_to_stop(profile)});
}

}  // namespace spindle::commands
