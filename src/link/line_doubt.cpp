#include "spindle/link/line_doubt.hpp"

#include <algorithm>

namespace spindle::link {
namespace {

// Longer than the pause between two polls of a usual master.
constexpr Duration quiet = std::chrono::seconds(10);

constexpr std::size_t most_remembered = 32;

// A line of many devices must not make this grow without end.
constexpr std::size_t most_shapes = 64;

}  // namespace

bool LineDoubt::find(Evidence evidence, TimePoint now) {
  until_ = std::max(until_, now + quiet);
  if (evidence != Evidence::noise) ++disturbances_;
  const bool is_worse = !worst_ || evidence > *worst_;
  if (is_worse) worst_ = evidence;
  return is_worse;
}

void LineDoubt::learn(const LineDoubt& other) {
  until_ = std::max(until_, other.until_);
  lasting_ = lasting_ || other.lasting_;
  worst_ = std::max(worst_, other.worst_);
  accepted_ = other.accepted_;
  shapes_.insert(other.shapes_.begin(), other.shapes_.end());
}

void LineDoubt::remember(const modbus::Pdu& request, const modbus::Pdu& answer, TimePoint now) {
  while (!accepted_.empty() &&
         (now - accepted_.front().at > longest_copy || accepted_.size() >= most_remembered)) {
    accepted_.pop_front();
  }
  if (modbus::is_write(request.function)) {
    for (Accepted& accepted : accepted_) accepted.outdated = true;
  }
  accepted_.push_back({.at = now, .request = request, .answer = answer});
}

bool LineDoubt::is_copy(const modbus::Pdu& frame, TimePoint now) const {
  return std::any_of(accepted_.begin(), accepted_.end(), [&](const Accepted& accepted) {
    return now - accepted.at <= longest_copy && accepted.answer == frame;
  });
}

bool LineDoubt::may_be_copy(const modbus::Pdu& request, const modbus::Pdu& answer,
                            TimePoint now) const {
  return std::any_of(accepted_.begin(), accepted_.end(), [&](const Accepted& accepted) {
    const bool other = accepted.outdated || accepted.request != request;
    return other && now - accepted.at <= longest_copy && accepted.answer == answer;
  });
}

std::optional<TimePoint> LineDoubt::copies_end(const modbus::Pdu& answer) const {
  for (auto accepted = accepted_.rbegin(); accepted != accepted_.rend(); ++accepted) {
    if (accepted->answer == answer) return accepted->at + longest_copy;
  }
  return std::nullopt;
}

void LineDoubt::note_shape(const modbus::Pdu& frame) {
  if (shapes_.size() < most_shapes) shapes_.insert(shape_of(frame));
}

bool LineDoubt::is_shape_taken(const modbus::Pdu& read) const {
  if (read.data.size() != 4) return false;
  const std::size_t bytes = 1 + std::size_t{2} * get_u16(read.data, 2);
  return shapes_.contains({read.function, bytes});
}

}  // namespace spindle::link
