#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/device/device.hpp"
#include "spindle/device/event_tracker.hpp"

namespace spindle::device {

/// How an event became known.
enum class EventOrigin : std::uint8_t {
  push,      ///< the tool sent it unasked
  poll,      ///< its counter or its flag was seen to change
  catch_up,  ///< it was fetched after (re)connecting
};

/// What an event is worth.
enum class Standing : std::uint8_t {
  result,      ///< it happened, and was not told before
  remembered,  ///< the tool held it when its counter was found restarted: it may be an old one
  first,       ///< the tool held it when it was looked at for the first time: its age is not known
};

/// A new event. `block` are the registers of the profile's event block.
struct ToolEvent {
  EventOrigin source;
  Registers block;
  WallTime time;
  Standing standing = Standing::result;
  bool is_only_here = false;                           ///< the tool gave it away when it was read
  std::optional<std::uint16_t> number = std::nullopt;  ///< empty: the tool does not count
  Sequence sequence = Sequence::next;                  ///< what its number says
};

/// The curves of one event, told behind it, or of none that was seen.
struct ToolCurve {
  std::optional<Registers> block = std::nullopt;  ///< of its event; empty: it fits none
  std::optional<std::uint16_t> number = std::nullopt;
  std::vector<Bytes> channels = {};  ///< by channel, as they came; empty: none, or it did not come
  WallTime time = {};                ///< when the last part of it came
  bool is_whole = true;              ///< every channel is there that the event counts
  std::string trouble = {};          ///< why a frame of samples could not be understood
};

/// Events that happened, or may have, and were not seen.
struct EventGap {
  std::optional<std::uint32_t> missed;  ///< empty: unknown
  std::string reason;
  bool is_only_here = false;  ///< as of a result
  /// The numbers between which they are missing, where they are known.
  std::optional<std::uint16_t> after = std::nullopt;
  std::optional<std::uint16_t> before = std::nullopt;
  Sequence sequence = Sequence::jump;  ///< what made it known
};

/// The last event that a record of the tool's events holds.
struct LastEvent {
  std::uint16_t number = 0;
  std::optional<Registers> block = std::nullopt;  ///< empty: only its number is known
  Duration unseen = {};                           ///< how long the tool was not listened to since
};

/// How events are learned of.
enum class EventMode : std::uint8_t {
  none,      ///< not at all
  declared,  ///< as the profile says; what it arms is switched off at the end
  unarmed,   ///< the counter alone is polled; for tools whose output another client uses
};

/// Learns of the events of one tool, over all its connections. Nothing is lost in silence and
/// nothing is told twice, as far as the tool lets it be known. One thread.
class EventSource {
 public:
  using News = std::variant<ToolEvent, EventGap, ToolCurve>;
  using Tell = std::function<void(const News&)>;

  /// Null where there is nothing to learn: the profile has no events, or they are not wanted.
  /// `profile` and `clock` must outlive it.
  static std::unique_ptr<EventSource> make(const catalogue::Profile& profile, EventMode mode,
                                           Clock& clock, Tell tell);

  EventSource() = default;
  EventSource(const EventSource&) = delete;
  EventSource& operator=(const EventSource&) = delete;
  virtual ~EventSource() = default;

  /// What cannot be known of this tool's events, as part of a sentence; empty: nothing is lost
  /// without a sign of it.
  [[nodiscard]] virtual std::string_view caveat() const { return {}; }

  /// Goes on with a new connection, behind a time in which the tool was not listened to, and
  /// catches up with what happened meanwhile. The device must outlive the connection.
  virtual Result<void> attach(Device& device, Duration unseen) = 0;

  /// Another tool answers now: nothing of what is known counts.
  virtual void forget() = 0;

  /// Events are kept in a record, and this is the last one there; empty: none is. Then the one that
  /// stands in the tool at first is told, too. To be called before the first attach(), and behind
  /// forget().
  virtual void recall(std::optional<LastEvent> last) = 0;

  /// When run_due() is next due; TimePoint::max(): never.
  [[nodiscard]] virtual TimePoint next_due() const { return TimePoint::max(); }
  /// Keeps armed what expires. `ask` makes a request while events are told as they come.
  using Ask = std::function<Result<void>(const std::function<Result<void>()>&)>;
  virtual Result<void> run_due(const Ask& ask) {
    static_cast<void>(ask);
    return {};
  }

  /// Whether poll() has to be called on every beat.
  [[nodiscard]] virtual bool polls() const = 0;
  virtual Result<void> poll() { return {}; }

  /// A frame that the tool sent unasked.
  virtual void handle(const link::Spontaneous& frame) { static_cast<void>(frame); }
  /// What was sent unasked and not taken yet, without waiting.
  virtual void handle_waiting() {}

  /// Switches off what it armed. The tool does so by itself when it hears nothing, so a lost
  /// request costs only time.
  virtual void disarm() {}
};

}  // namespace spindle::device
