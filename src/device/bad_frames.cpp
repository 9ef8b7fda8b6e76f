#include "bad_frames.hpp"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "spindle/base/text.hpp"

namespace spindle::device {
namespace {

constexpr Duration told_every = std::chrono::minutes(1);

}  // namespace

std::optional<BadFrames::News> BadFrames::note(const link::Spontaneous& frame,
                                               const std::string& why, TimePoint now) {
  ++untold_;
  function_ = frame.pdu.function;
  why_ = why;
  time_ = frame.wall;
  if (told_at_ && now < *told_at_ + told_every) return std::nullopt;
  told_at_ = now;
  return rest();
}

std::optional<BadFrames::News> BadFrames::due(TimePoint now) {
  if (now < next_due()) return std::nullopt;
  told_at_ = now;
  return rest();
}

std::optional<BadFrames::News> BadFrames::rest() {
  if (untold_ == 0) return std::nullopt;
  const std::size_t frames = std::exchange(untold_, 0);
  return News{fmt::format("{} that came unasked could not be understood; the last has function "
                          "0x{:02X}, but {}",
                          counted(frames, "frame"), function_, why_),
              time_};
}

TimePoint BadFrames::next_due() const {
  return untold_ > 0 && told_at_ ? *told_at_ + told_every : TimePoint::max();
}

}  // namespace spindle::device
