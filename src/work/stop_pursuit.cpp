#include "spindle/work/stop_pursuit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "spindle/work/stop.hpp"

namespace spindle::work {
namespace {

using catalogue::Profile;
using catalogue::StopMode;
using device::StopResult;

/// What a question that goes before the stop may cost.
constexpr Duration hurried_answer = std::chrono::milliseconds(200);
/// The first questions of a tool that has to say what it is are repeated soon.
constexpr Duration soon = std::chrono::milliseconds(500);
constexpr unsigned soon_repeated = 4;
/// A start that a program sent before it ended reaches its tool within this time.
constexpr Duration start_under_way = std::chrono::seconds(2);

/// What is wrong with the command or its files stays so.
bool is_hopeless(const Error& error) {
  return error.code == Errc::usage || error.code == Errc::unknown_name ||
         error.code == Errc::bad_file || error.code == Errc::bad_target ||
         error.code == Errc::wrong_generation;
}

}  // namespace

StopPursuit::StopPursuit(const Target& target, StopMode mode, const Environment& environment)
    : target_(target),
      mode_(mode),
      wanted_connect_(environment.common.connect_timeout),
      usual_(wanted_connect_.value_or(catalogue::LinkSpec().connect)),
      environment_(environment),
      guard_(
          motion(), [this](Duration patience) { return open(patience); }, environment_.clock,
          Duration::zero()) {}

StopPursuit::StopPursuit(const OpenTool& tool, StopMode mode, const Environment& environment)
    : target_(tool.target),
      mode_(mode),
      wanted_connect_(environment.common.connect_timeout),
      usual_(wanted_connect_.value_or(tool.profile->link.connect)),
      environment_(environment),
      profile_(tool.profile.get()),
      generation_is_checked_(true),
      guard_(
          motion(), [this](Duration patience) { return open(patience); }, environment_.clock,
          start_under_way) {
  target_.endpoint.claim = link::Claim::beside;
  // It was started, so it can be stopped. On a line that was left in the middle of an exchange what
  // enables it may not be read in time; without that a motor coasts instead of being braked.
  if (prepare_stop()) stopper_->assume_enabled();
}

device::GuardedMotion StopPursuit::motion() {
  return {.start = {},
          .stop = [this](device::Device& device, Clock& clock) { return stop(device, clock); },
          .hopeless = is_hopeless};
}

Result<StopResult> StopPursuit::result() {
  const device::StopReport report = guard_.stop();
  if (report.result != StopResult::unconfirmed || !last_) return report.result;
  Error error = *last_;
  if (profile_ == nullptr && !is_hopeless(error)) {
    const std::string helps = error.code == Errc::connection_refused ? error.hint : "";
    error.hint = fmt::format(
        "no stop was sent, as it is not known what the tool is: {}, and stop "
        "it at the tool",
        helps.empty() ? "name its profile with --profile" : helps);
  }
  return tl::unexpected(std::move(error));
}

Result<device::Device> StopPursuit::open(Duration patience) {
  environment_.common.connect_timeout = std::min(usual_, patience);
  auto device = profile_ == nullptr && target_.profile.empty() ? connect_unknown() : connect();
  if (!device) last_ = device.error();
  return device;
}

/// The stop needs no identity where the profile is known. One that says in time that its registers
/// are others is not written to.
Result<device::Device> StopPursuit::connect() {
  if (profile_ == nullptr) {
    TRY_LET(auto profile, load_profile(target_, environment_));
    auto adopted = adopt(std::make_unique<const Profile>(std::move(profile)));
    if (!adopted) return tl::unexpected(std::move(adopted.error()));
  }
  auto device = connect_device(target_, *profile_, environment_);
  if (!device) return device;
  return check_generation(*device).map([&] { return std::move(*device); });
}

Result<void> StopPursuit::check_generation(device::Device& device) {
  if (!profile_->identity || std::exchange(generation_is_checked_, true)) return {};
  link::Session& session = device.session();
  const Duration patience = session.options().answer_timeout;
  session.set_uninterruptible();
  session.set_answer_timeout(std::min(patience, hurried_answer));
  const auto answer = device.report_server_id();
  session.set_answer_timeout(patience);
  if (!answer) return {};
  const auto& facts = *profile_->identity;
  const auto identity = catalogue::decode_identity(facts, *answer);
  serial_ = identity.serial;
  const auto generation = catalogue::generation_of(facts, identity);
  const bool has_others =
      generation == catalogue::Generation::later || generation == catalogue::Generation::earlier;
  return has_others ? device.require_known_registers() : Result<void>();
}

Result<device::Device> StopPursuit::connect_unknown() {
  const CommonOptions usual = environment_.common;
  const Duration patience = usual.timeout.value_or(catalogue::LinkSpec().answer);
  environment_.common.retries = 0;  // a question that got lost is asked on a new connection
  if (++questions_ <= soon_repeated) environment_.common.timeout = std::min(patience, soon);
  auto tool = open_tool(target_, Profile(), Need::stop, Purpose::change, environment_);
  environment_.common = usual;
  if (!tool) return tl::unexpected(std::move(tool.error()));
  generation_is_checked_ = true;
  if (tool->device.identity()) serial_ = tool->device.identity()->serial;
  auto adopted = adopt(std::move(tool->profile));
  if (!adopted) return tl::unexpected(std::move(adopted.error()));
  tool->device.session().set_answer_timeout(usual.timeout.value_or(profile_->link.answer));
  return std::move(tool->device);
}

Result<void> StopPursuit::adopt(std::unique_ptr<const Profile> profile) {
  own_profile_ = std::move(profile);
  profile_ = own_profile_.get();
  usual_ = wanted_connect_.value_or(profile_->link.connect);
  return prepare_stop();
}

Result<void> StopPursuit::prepare_stop() {
  auto model = device::RunModel::of(*profile_);
  if (!model) return tl::unexpected(with_target(std::move(model.error()), target_));
  model_ = std::move(*model);
  stopper_ = model_->stopper(mode_);
  return {};
}

Result<StopResult> StopPursuit::stop(device::Device& device, Clock& clock) {
  auto stopped = send_stop(device, clock);
  last_.reset();
  if (!stopped) last_ = stopped.error();
  return stopped;
}

Result<StopResult> StopPursuit::send_stop(device::Device& device, Clock& clock) {
  if (target_.addressing == Addressing::broadcast && device::has_motor(*profile_)) {
    return broadcast_stop(device, *model_, mode_).map([] { return StopResult::sent; });
  }
  if (!std::exchange(was_observed_, true)) stopper_->observe(device);
  return stopper_->stop(device, clock);
}

}  // namespace spindle::work
