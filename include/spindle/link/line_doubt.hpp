#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <utility>

#include "spindle/base/clock.hpp"
#include "spindle/modbus/pdu.hpp"

namespace spindle::link {

/// How long behind an answer a copy of it may come. Gateways and drivers were seen to repeat an
/// answer after up to 40 ms.
inline constexpr Duration longest_copy = std::chrono::milliseconds(100);

/// What came on a serial line that no request of ours explains; each one says more than those
/// before it.
enum class Evidence : std::uint8_t {
  noise,     ///< bytes that are no frame
  repeated,  ///< an answer that had come before
  master,    ///< the request of another master, or any other frame that answers nothing
};

/// Whether the answers on a serial line can be believed as they come. RTU answers carry neither
/// address nor number, so what another master asked for, or an answer that comes twice, looks like
/// the answer to the request that is out. Pure: times are given.
class LineDoubt {
 public:
  /// The line is doubtful from now on, until it has been quiet for a while. True where this says
  /// more than what was found before.
  bool find(Evidence evidence, TimePoint now);
  /// The line is doubtful until then, at least.
  void raise(TimePoint until) { until_ = std::max(until_, until); }
  /// The line is doubtful for good: another program has it, too.
  void stay() { lasting_ = true; }
  /// What another session found on the same line, before this one had a turn.
  void learn(const LineDoubt& other);
  [[nodiscard]] bool is_raised(TimePoint now) const { return lasting_ || now < until_; }

  /// How often a frame came that may have been taken for an answer. Noise does not count.
  [[nodiscard]] std::uint64_t disturbances() const { return disturbances_; }

  /// What was accepted as the answer to a request.
  void remember(const modbus::Pdu& request, const modbus::Pdu& answer, TimePoint now);
  /// Whether a frame is the copy of an answer that was accepted a moment ago.
  [[nodiscard]] bool is_copy(const modbus::Pdu& frame, TimePoint now) const;
  /// Whether an answer may be the copy of the answer to another request: it is the same, and the
  /// other request or a write was answered a moment ago.
  [[nodiscard]] bool may_be_copy(const modbus::Pdu& request, const modbus::Pdu& answer,
                                 TimePoint now) const;
  /// When copies of this answer have surely come, if it was accepted a moment ago.
  [[nodiscard]] std::optional<TimePoint> copies_end(const modbus::Pdu& answer) const;

  /// A frame that answered nothing: from now on answers of its shape are not a shape of one's own.
  void note_shape(const modbus::Pdu& frame);
  /// Whether frames of the shape of this read's answer came unasked.
  [[nodiscard]] bool is_shape_taken(const modbus::Pdu& read) const;

 private:
  using Shape = std::pair<std::uint8_t, std::size_t>;  ///< function, bytes of data
  static Shape shape_of(const modbus::Pdu& frame) { return {frame.function, frame.data.size()}; }

  struct Accepted {
    TimePoint at;
    modbus::Pdu request;
    modbus::Pdu answer;
    bool outdated = false;  ///< a write was answered since
  };

  TimePoint until_ = {};
  bool lasting_ = false;
  std::uint64_t disturbances_ = 0;
  std::optional<Evidence> worst_ = std::nullopt;
  std::deque<Accepted> accepted_ = {};  ///< the last ones
  std::set<Shape> shapes_ = {};
};

}  // namespace spindle::link
