#include "spindle/device/motor_watch.hpp"

#include <algorithm>
#include <utility>

namespace spindle::device {
namespace {

using catalogue::Parameter;

std::uint32_t end_of(const Parameter& parameter) {
  return parameter.address.value + catalogue::register_count(parameter.encoding);
}

bool joins(const std::vector<Parameter>& piece, const Parameter& parameter) {
  return piece.back().table == parameter.table && end_of(piece.back()) == parameter.address.value;
}

/// What says that something happened, as pieces of registers that stand side by side.
std::vector<std::vector<Parameter>> pieces_of(const MotorMonitor& motor,
                                              const std::vector<Parameter>& polled) {
  std::vector<Parameter> telling;
  for (const Parameter& parameter : motor.parameters()) {
    const bool read_anyhow = std::any_of(polled.begin(), polled.end(), [&](const Parameter& other) {
      return other.name == parameter.name;
    });
    if (motor.tells(parameter.name) && !read_anyhow) telling.push_back(parameter);
  }
  std::sort(telling.begin(), telling.end(), [](const Parameter& one, const Parameter& other) {
    return std::pair(one.table, one.address.value) < std::pair(other.table, other.address.value);
  });
  std::vector<std::vector<Parameter>> pieces;
  for (Parameter& parameter : telling) {
    if (pieces.empty() || !joins(pieces.back(), parameter)) pieces.emplace_back();
    pieces.back().push_back(std::move(parameter));
  }
  const auto first = std::find_if(pieces.begin(), pieces.end(), [&](const auto& piece) {
    return std::any_of(piece.begin(), piece.end(),
                       [&](const Parameter& each) { return each.name == motor.facts().alarm; });
  });
  if (first != pieces.end()) std::iter_swap(pieces.begin(), first);
  return pieces;
}

bool says_the_same(const MotorState& one, const MotorState& other) {
  return one.running == other.running && one.at_speed == other.at_speed &&
         one.alarm == other.alarm && one.warning == other.warning;
}

}  // namespace

MotorWatch::MotorWatch(MotorMonitor motor, const std::vector<Parameter>& polled)
    : motor_(std::move(motor)), pieces_(pieces_of(motor_, polled)) {}

/// The first piece three times of four: an alarm is what has to be known soonest.
const std::vector<Parameter>& MotorWatch::next_piece() {
  constexpr std::size_t round = 4;
  const std::size_t turn = turn_++;
  if (pieces_.size() == 1 || turn % round != 1) return pieces_.front();
  return pieces_[1 + turn / round % (pieces_.size() - 1)];
}

bool MotorWatch::knows_running() const {
  return std::any_of(seen_.begin(), seen_.end(),
                     [this](const std::string& name) { return motor_.tells_running(name); });
}

Result<std::vector<MotorTransition>> MotorWatch::take_turn(Device& device) {
  if (pieces_.empty()) return std::vector<MotorTransition>();
  TRY_LET(const auto readings, device.read_each(next_piece(), Limits::skip));
  return take(device, readings);
}

/// The state as seen last, with what these readings say. What was never read before is taken for
/// what it always was.
Result<MotorState> MotorWatch::with(std::span<const Reading> readings) {
  MotorState now = state_;
  for (const Reading& reading : readings) {
    const std::string& name = reading.parameter.name;
    if (!motor_.tells(name)) continue;
    TRY(motor_.note(reading, now));
    if (seen_.insert(name).second) static_cast<void>(motor_.note(reading, state_));
  }
  return now;
}

/// Everything, read once more where the motor stopped or left its speed before speed and load were
/// read: values of different moments make no state.
Result<MotorState> MotorWatch::look(Device& device) const {
  std::vector<Parameter> status = motor_.parameters();
  std::erase_if(status, [&](const Parameter& each) { return !motor_.tells_running(each.name); });
  auto seen = motor_.look(device);
  if (!seen || !seen->running) return seen;
  TRY_LET(const auto behind, device.read_each(status, Limits::skip));
  MotorState later = *seen;
  TRY(motor_.note(behind.front(), later));
  const bool keeps_speed = later.at_speed || !seen->at_speed;
  return later.running && keeps_speed ? seen : motor_.look(device);
}

/// What happened is told with the speed and load that are read at once. They may say already what
/// happened behind it: a speed that was reached, but is no longer, is then not told.
Result<std::vector<MotorTransition>> MotorWatch::take(Device& device,
                                                      std::span<const Reading> readings) {
  TRY_LET(auto now, with(readings));
  std::vector<MotorTransition> news;
  if (says_the_same(state_, now)) return news;
  const Clock& clock = device.session().clock();
  const WallTime time = clock.wall();
  TRY_LET(auto later, look(device));  // told when it can be read again
  // What was never read by its turn is not judged by chance.
  if (!knows_running()) {
    later.running = state_.running;
    later.at_speed = state_.at_speed;
  }
  if (!seen_.contains(motor_.facts().warning)) later.warning = state_.warning;
  if (!seen_.contains(motor_.facts().alarm)) later.alarm = state_.alarm;
  now.at_speed = now.at_speed && later.at_speed;
  MotorState shown = later;
  shown.running = now.running;
  shown.at_speed = now.at_speed;
  shown.alarm = now.alarm;
  shown.warning = now.warning;
  for (const MotorEvent event : events_between(state_, now)) news.push_back({event, shown, time});
  for (const MotorEvent event : events_between(now, later)) {
    news.push_back({event, later, clock.wall()});
  }
  state_ = later;
  return news;
}

}  // namespace spindle::device
