#include "spindle/work/stop.hpp"

namespace spindle::work {

Result<void> broadcast_stop(device::Device& device, const device::RunModel& model,
                            catalogue::StopMode mode) {
  Result<void> sent;
  for (int again = 0; again < most_stops && sent; ++again) {
    sent = model.broadcast_stop(device, mode);
  }
  return sent;
}

bool leaves_open(const Result<device::StopResult>& stopped) {
  if (stopped) return *stopped == device::StopResult::unconfirmed;
  return link::is_lost_answer(stopped.error());
}

Result<device::StopResult> stop_motor(OpenTool& tool, catalogue::StopMode mode,
                                      const Environment& environment) {
  TRY_LET(const auto model, device::RunModel::of(*tool.profile));
  if (tool.target.addressing == Addressing::broadcast) {
    return broadcast_stop(tool.device, *model, mode).map([] { return device::StopResult::sent; });
  }
  const auto stopper = model->stopper(mode);
  tool.device.set_retries(0);  // it is better to send the stop soon, and again
  tool.device.session().skip_verification();
  stopper->observe(tool.device);
  auto stopped = stopper->stop(tool.device, environment.clock);
  for (int again = 1; again < most_stops && leaves_open(stopped); ++again) {
    stopped = stopper->stop(tool.device, environment.clock);
  }
  return stopped;
}

std::string where_to_stop(const catalogue::Profile* profile) {
  const std::string here = "stop it at the tool";
  const std::string more = profile == nullptr ? "" : device::still_runs_words(*profile);
  return more.empty() ? here : here + "; " + more;
}

Error still_runs(const Target& target, const catalogue::Profile* profile) {
  return with_target(
      Error{.code = Errc::mismatch,
            .message = "the stop was acknowledged, but the tool still says that it runs",
            .hint = where_to_stop(profile)},
      target);
}

}  // namespace spindle::work
