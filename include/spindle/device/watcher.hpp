#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "spindle/device/device.hpp"
#include "spindle/device/event_source.hpp"
#include "spindle/device/motor_follower.hpp"
#include "spindle/device/motor_watch.hpp"

namespace spindle::device {

/// A polled value: its first reading, one that differs, or every sample.
struct PolledValue {
  const catalogue::Parameter* parameter;
  Registers registers;
  catalogue::Value value;
  std::optional<catalogue::Value> previous;
};

/// Polls that could not be made in time, since the last time that this was told.
struct PollLag {
  std::uint32_t missed;  ///< intervals in which nothing was read
  Duration interval;     ///< as asked for
  Duration achieved;     ///< from one poll to the next, on average
};

enum class LinkState : std::uint8_t {
  connecting,  ///< an attempt failed, and none had success before
  connected,
  lost,
  reconnecting,  ///< an attempt failed after the link was lost
};

struct LinkChange {
  LinkState state;
  unsigned attempt;  ///< how many came to nothing, this one included, since there was a link
  std::string message;
};

using WatchEvent =
    std::variant<ToolEvent, PolledValue, EventGap, PollLag, LinkChange, MotorTransition, ToolCurve>;

enum class Samples : std::uint8_t { changes, changes_and_first, all };
/// What is done when a link is lost.
enum class Reconnection : std::uint8_t {
  forever,  ///< it is opened again; what no retry can mend ends the watch
  never,
  whatever,  ///< as `forever`, also behind a refusal and another product, which may be mended
};

struct WatchPlan {
  EventMode events = EventMode::declared;
  std::vector<catalogue::Parameter> values = {};
  std::optional<MotorMonitor> motor =
      std::nullopt;  ///< looked at between the values for what it does
  Duration interval = std::chrono::milliseconds(200);  ///< from one poll to the next, above zero
  Samples samples = Samples::changes;
};

/// Something to read of the tool between its events.
struct Errand {
  std::vector<catalogue::Parameter> wanted = {};
  std::function<void(const std::vector<Reading>&)> take = {};
};
/// What a record of a tool's events says when the tool is connected.
struct RecordedPast {
  std::optional<LastEvent> last = std::nullopt;  ///< empty: nothing is known of it
  /// The event that stands in the tool is told, too, where no last one is known.
  bool wants_first = false;
};

/// What keeps the events in a record, or knows one. All may be empty.
struct RecordHooks {
  /// Called on every connection before anything is asked of its events. An error of status
  /// `storage` counts as trouble of the link.
  std::function<Result<RecordedPast>(Device& device)> on_connected = {};
  /// Asked on every turn.
  std::function<std::optional<Errand>()> errand = {};
};

/// What the listener wants next.
enum class WatchControl : std::uint8_t { go_on, stop };

/// Watches one tool: pushed and polled events as one stream, values by polling, keep-alive,
/// re-arming, reconnection with back-off. Every loss of knowledge is in the stream. One thread.
///
/// The values are polled on the beat of the interval, also across reconnections; a beat that was
/// missed is told. Pauses between connections grow until one has lasted.
class Watcher {
 public:
  /// An open tool whose registers are known. Its profile outlives the watcher and may only be found
  /// while opening.
  struct Link {
    Device device;
    std::string identity;  ///< serial and firmware as it reports them; empty without an identity
  };
  using Open = std::function<Result<Link>()>;
  /// What to watch on a tool of this profile; asked once for every profile that a tool turns out to
  /// have.
  using Plan = std::function<Result<WatchPlan>(const catalogue::Profile&)>;
  using Tell = std::function<WatchControl(const WatchEvent&)>;
  /// When to end, asked anew at least once a second; a point in the past ends at once.
  using Until = std::function<TimePoint()>;

  Watcher(Open open, Plan plan, Reconnection reconnection, Clock& clock, Tell tell,
          RecordHooks hooks = {});

  /// Returns at its end, or when the listener wants to stop; then the tool's output
  /// is switched off again where the link still allows it, and what had arrived is told. Errors: an
  /// interrupt; what no retry can mend (another product, a refusal); with Reconnection::never any
  /// trouble.
  Result<void> run(const Until& until);

  /// Why the tool was never reached; empty once it was. To be asked after run().
  [[nodiscard]] std::optional<Error> unreached() const;

 private:
  Result<void> watch(const Until& until);
  Result<void> connect(const Until& until);
  Result<void> pause(const Until& until);
  Result<void> attach(Link link);
  Result<void> adopt_profile(const catalogue::Profile& profile);
  void compare_identity(const std::string& identity);
  Result<void> consult_record();
  Result<void> begin();
  Result<void> serve(const Until& until);
  Result<void> run_due();
  Result<void> run_errand();
  Result<void> keep_alive();
  Result<void> ask(const std::function<Result<void>()>& request);
  Result<void> poll();
  void keep_beat(TimePoint now);
  void tell_lag(TimePoint now);
  Result<void> poll_values();
  Result<void> read_values();
  Result<void> learn_meanings();
  Result<void> look_between();
  Result<void> tell_motor(Result<std::vector<MotorTransition>> news);
  [[nodiscard]] std::uint64_t requests() { return link_->device.session().counters().requests; }
  [[nodiscard]] bool polls_values() const { return !plan_.values.empty() || motor_; }
  [[nodiscard]] bool polls() const { return (source_ && source_->polls()) || polls_values(); }
  void tell_reading(std::size_t index, Reading& reading);
  void hear_waiting();
  void handle(const link::Spontaneous& frame);
  void tell(const WatchEvent& news);
  void tell_trouble(const Error& error);
  void disarm();
  [[nodiscard]] bool goes_on(const Until& until) const;
  [[nodiscard]] bool goes_on_behind(const Error& error) const;
  [[nodiscard]] TimePoint next_due() const;
  [[nodiscard]] Duration back_off(unsigned failures) const;

  Open open_;
  Plan make_plan_;
  Reconnection reconnection_;
  Clock* clock_;
  Tell tell_;
  RecordHooks hooks_;
  const catalogue::Profile* profile_ = nullptr;  ///< empty until the first link
  WatchPlan plan_ = {};
  std::optional<Link> link_ = std::nullopt;
  std::string known_identity_ = {};
  std::unique_ptr<EventSource> source_ = nullptr;  ///< null where no events are learned of
  std::vector<std::optional<catalogue::Value>> previous_ = {};
  /// The values to poll, with the names of bits that count now.
  std::vector<catalogue::Parameter> polled_ = {};
  bool meanings_known_ = false;  ///< on this link
  std::optional<MotorWatch> motor_ = std::nullopt;
  std::uint64_t requests_owed_ = 0;  ///< for values, since something was read between them
  unsigned looks_between_ = 0;
  Duration last_look_ = {};  ///< what one request between the values took
  TimePoint keep_alive_due_ = {};
  TimePoint poll_due_ = {};
  TimePoint retry_at_ = {};
  TimePoint connected_at_ = {};
  /// When the tool last said something, or before that was first connected to; empty: neither.
  std::optional<TimePoint> seen_at_ = std::nullopt;
  unsigned attempts_ = 0;     ///< that came to nothing since there was a link
  unsigned short_lived_ = 0;  ///< attempts and links one after the other that did not last
  bool served_ = false;       ///< this link has kept the tool alive, or brought an event
  bool reached_ = false;      ///< there was a link
  bool caveat_told_ = false;
  bool hears_ = false;     ///< the source has this link
  bool recalled_ = false;  ///< the source knows what the record says of this tool
  bool stopped_ = false;
  std::optional<Error> trouble_ = std::nullopt;  ///< the last one
  /// Since a lag was told, or since the link began.
  struct Beat {
    TimePoint since = {};
    std::int64_t polls = 0;
    std::uint32_t missed = 0;
  };
  Beat beat_ = {};
  std::optional<TimePoint> lag_told_at_ = std::nullopt;
};

}  // namespace spindle::device
