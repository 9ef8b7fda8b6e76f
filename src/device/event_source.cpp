#include "spindle/device/event_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "bad_frames.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/curve.hpp"
#include "spindle/catalogue/event_layout.hpp"
#include "spindle/device/curve_collector.hpp"
#include "spindle/device/event_tracker.hpp"
#include "spindle/modbus/pdu.hpp"

namespace spindle::device {
namespace {

/// The last words to a tool must not hold up the end of the program.
constexpr Duration farewell_timeout = std::chrono::milliseconds(500);

/// How many frames are taken at once: a tool that never falls silent must not keep us from others.
constexpr std::size_t max_taken = 4096;

bool is_interrupt(const Error& error) {
  return error.code == Errc::interrupted || error.code == Errc::terminated;
}

/// What is still to be said is said although an interrupt came, but soon.
void begin_farewell(link::Session& session) {
  session.set_uninterruptible();
  session.set_answer_timeout(std::min(session.options().answer_timeout, farewell_timeout));
}

/// A little earlier than asked for, so that the time between two is never longer than it.
Duration with_margin(Duration period) { return period - period / 10; }

/// Whether one event number is older than another, across the end of the counter.
bool is_before(std::uint16_t number, std::uint16_t other) {
  constexpr std::uint16_t half = 0x8000;
  return number != other && static_cast<std::uint16_t>(other - number) < half;
}

/// How many were missed, as far as it is known.
std::optional<std::uint32_t> missed_of(const Tracked& tracked) {
  const bool known = tracked.novelty == Sequence::jump || tracked.novelty == Sequence::wrap;
  return known ? std::optional(tracked.missed) : std::nullopt;
}

/// Why events were not seen; empty: none was missed.
std::string_view reason_of(Sequence novelty, EventOrigin origin) {
  switch (novelty) {
    case Sequence::restart:
      return "the tool counts its events anew: it was restarted";
    case Sequence::doubtful:
      return "the tool may have been restarted while no client was connected, and count its events "
             "anew";
    case Sequence::wrap:
      return "the tool's event counter began again behind 65535";
    case Sequence::jump:
      break;
    case Sequence::baseline:
    case Sequence::repeat:
    case Sequence::next:
      return {};
  }
  switch (origin) {
    case EventOrigin::catch_up:
      return "events while no client was connected";
    case EventOrigin::poll:
      return "events came faster than they were polled";
    case EventOrigin::push:
      break;
  }
  return "the tool's event counter jumped";
}

/// What a tool pushes because it was armed comes within this time. What comes later has happened.
constexpr Duration held_comes_within = std::chrono::seconds(1);

/// A frame that came unasked, as it was understood.
struct Heard {
  catalogue::PushedFrame frame = {};
  std::optional<std::uint16_t> number = std::nullopt;  ///< of the event in it
  TimePoint arrival = {};
  WallTime wall = {};
};

/// A tool that counts its events: polled, and its frames heard where it sends any.
class CounterSource : public EventSource {
 public:
  CounterSource(const catalogue::Profile& profile, Clock& clock, Tell tell)
      : layout_(profile),
        frames_(profile),
        clock_(&clock),
        tell_(std::move(tell)),
        curves_(frames_, [this](const ToolCurve& curve) { tell_(curve); }),
        has_place_(profile.events->first.has_value()) {}

  Result<void> attach(Device& device, Duration unseen) override;
  void forget() override {
    tell_rest();
    tracker_ = {};
    first_.reset();
  }
  void recall(std::optional<LastEvent> last) override;
  [[nodiscard]] bool polls() const override { return true; }
  Result<void> poll() override;
  void handle(const link::Spontaneous& frame) override {
    if (auto heard = understand(frame)) hear(std::move(*heard));
  }
  void handle_waiting() override;
  [[nodiscard]] TimePoint next_due() const override {
    return std::min({curves_.next_due(), bad_events_.next_due(), bad_curves_.next_due()});
  }
  Result<void> run_due(const Ask& /*ask*/) override {
    const TimePoint now = clock_->now();
    curves_.run_due(now);
    tell_bad_events(bad_events_.due(now));
    tell_bad_curves(bad_curves_.due(now));
    return {};
  }
  void disarm() override {
    handle_waiting();
    tell_rest();
  }

 protected:
  /// Makes the tool send its events, between the reading of its counter and that of its last event.
  virtual Result<void> arm() { return {}; }
  /// Until when an event that is pushed may be one that the tool held before it was connected.
  [[nodiscard]] virtual TimePoint held_until() const { return TimePoint::min(); }
  [[nodiscard]] Device& device() const { return *device_; }
  [[nodiscard]] Clock& clock() const { return *clock_; }
  /// Whether the last event can be read.
  [[nodiscard]] bool has_place() const { return has_place_; }

 private:
  enum class Fetched : std::uint8_t { yes, too_fast };

  Result<void> attach_unread(Duration unseen);
  Result<Fetched> fetch_last(EventOrigin origin);
  std::optional<Heard> understand(const link::Spontaneous& frame);
  std::vector<Heard> take_waiting();
  void hear(Heard heard);
  void judge(EventOrigin origin, const Registers& block, WallTime time);
  void judge_unread_first(const Registers& block, WallTime time);
  void note_bad(const link::Spontaneous& frame, const std::string& why);
  void tell_bad_events(const std::optional<BadFrames::News>& news);
  void tell_bad_curves(const std::optional<BadFrames::News>& news);
  void tell_rest();

  catalogue::EventLayout layout_;
  catalogue::EventFrames frames_;
  Clock* clock_;
  Tell tell_;
  CurveCollector curves_;
  bool has_place_ = true;
  bool was_away_ = false;  ///< the next event is the first behind a new connection
  BadFrames bad_events_ = {};
  BadFrames bad_curves_ = {};
  Device* device_ = nullptr;
  EventTracker tracker_ = {};
  /// How long the tool was not listened to behind the last event that was recalled.
  std::optional<Duration> unseen_ = std::nullopt;
  bool tells_first_ = false;
  std::optional<std::uint16_t> first_ = std::nullopt;  ///< number of the event to tell as such
};

void CounterSource::recall(std::optional<LastEvent> last) {
  tells_first_ = !last;
  if (!last) return;
  if (last->block && !layout_.fits(*last->block)) last->block.reset();
  if (last->block) last->block = layout_.key_of(*last->block);
  tracker_.set_last(last->number, std::move(last->block));
  unseen_ = last->unseen;
}

/// The counter is read before the output is armed, and the last event once more after it: whatever
/// happens in between is either pushed or fetched.
Result<void> CounterSource::attach(Device& device, Duration unseen) {
  device_ = &device;
  tell_rest();  // more of it went the old connection's way
  if (!has_place_) return attach_unread(unseen);
  if (tracker_.last()) {
    tracker_.look_again(std::exchange(unseen_, std::nullopt).value_or(unseen));
  } else {
    TRY_LET(const auto number, device.event_number());
    tracker_.set_baseline(number);
    if (tells_first_) first_ = number;
    take_waiting();  // pushed before the counter was read, so they are old
  }
  return arm().and_then([this] { return fetch_last(EventOrigin::catch_up).map([](Fetched) {}); });
}

/// Where the last event cannot be read, all that is known is pushed.
Result<void> CounterSource::attach_unread(Duration unseen) {
  if (tracker_.last()) {
    tracker_.look_again(std::exchange(unseen_, std::nullopt).value_or(unseen));
    was_away_ = true;
  }
  return arm();
}

/// Fetches the event of a counter that has changed; one that runs away is told as it was seen.
Result<void> CounterSource::poll() {
  TRY_LET(const auto number, device_->event_number());
  if (number == tracker_.last()) return {};
  TRY_LET(const auto fetched, fetch_last(EventOrigin::poll));
  if (fetched == Fetched::yes) return {};
  const auto missed = static_cast<std::uint16_t>(number - tracker_.last().value_or(number));
  const bool wrapped = number < tracker_.last();
  tell_(EventGap{.missed = missed,
                 .reason = "events came faster than they could be read",
                 .after = tracker_.last(),
                 .before = static_cast<std::uint16_t>(number + 1),
                 .sequence = wrapped ? Sequence::wrap : Sequence::jump});
  tracker_.set_baseline(number);
  return {};
}

/// Events may have been pushed while the last one was fetched: it is told in its place among them,
/// and only if it is not one of them.
Result<CounterSource::Fetched> CounterSource::fetch_last(EventOrigin origin) {
  const auto block = device_->last_event();
  const WallTime fetched = clock_->wall();
  auto pushed = take_waiting();
  const bool read = block && *block;
  const bool needed = read && std::none_of(pushed.begin(), pushed.end(), [&](const Heard& heard) {
                        return heard.number == layout_.number_of(**block);
                      });
  auto next = pushed.begin();
  for (; needed && next != pushed.end(); ++next) {
    if (next->number && !is_before(*next->number, layout_.number_of(**block))) break;
    hear(std::move(*next));
  }
  if (needed) judge(origin, **block, fetched);
  for (; next != pushed.end(); ++next) hear(std::move(*next));
  if (!block) return tl::unexpected(block.error());
  return read ? Fetched::yes : Fetched::too_fast;
}

/// One after the other, so that a flood of curves is never in memory as a whole.
void CounterSource::handle_waiting() {
  for (std::size_t taken = 0; taken < max_taken; ++taken) {
    const auto frame = device_->session().next_spontaneous(clock_->now());
    if (!frame || !*frame) return;  // a broken line is noticed by the next who uses it
    handle(**frame);
  }
}

std::vector<Heard> CounterSource::take_waiting() {
  std::vector<Heard> waiting;
  while (waiting.size() < max_taken) {
    auto frame = device_->session().next_spontaneous(clock_->now());
    if (!frame || !*frame) break;  // a broken line is noticed by the next who uses it
    if (auto heard = understand(**frame)) waiting.push_back(std::move(*heard));
  }
  return waiting;
}

std::optional<Heard> CounterSource::understand(const link::Spontaneous& frame) {
  auto decoded = frames_.decode(frame.pdu);
  if (!decoded) {
    note_bad(frame, decoded.error());
    return std::nullopt;
  }
  Heard heard = {.frame = std::move(*decoded), .arrival = frame.arrival, .wall = frame.wall};
  if (heard.frame.block) heard.number = layout_.number_of(*heard.frame.block);
  return heard;
}

void CounterSource::hear(Heard heard) {
  if (!heard.frame.block) {
    for (auto& part : heard.frame.channels) {
      curves_.take_part(std::move(part), heard.arrival, heard.wall);
    }
    return;
  }
  const Registers& block = *heard.frame.block;
  const Registers key = layout_.key_of(block);
  curves_.close_before(key);
  judge(EventOrigin::push, block, heard.wall);
  curves_.take_event(*heard.number, key, block, std::move(heard.frame.channels), heard.arrival,
                     heard.wall);
}

void CounterSource::note_bad(const link::Spontaneous& frame, const std::string& why) {
  if (frames_.holds_event(frame.pdu.function)) {
    tell_bad_events(bad_events_.note(frame, why, clock_->now()));
  } else {
    tell_bad_curves(bad_curves_.note(frame, why, clock_->now()));
  }
}

void CounterSource::tell_bad_events(const std::optional<BadFrames::News>& news) {
  if (news) tell_(EventGap{.missed = std::nullopt, .reason = news->reason});
}

void CounterSource::tell_bad_curves(const std::optional<BadFrames::News>& news) {
  if (news) tell_(ToolCurve{.time = news->time, .is_whole = false, .trouble = news->reason});
}

void CounterSource::tell_rest() {
  curves_.flush();
  tell_bad_events(bad_events_.rest());
  tell_bad_curves(bad_curves_.rest());
}

/// The first event of a tool whose last one cannot be read. What comes while it may answer to the
/// arming may be an old one; what comes later has just happened.
void CounterSource::judge_unread_first(const Registers& block, WallTime time) {
  const std::uint16_t number = layout_.number_of(block);
  tracker_.track(number, layout_.key_of(block));
  if (EventTracker::is_blank(layout_.key_of(block))) return;
  const bool is_held = clock_->now() < held_until();
  tell_(ToolEvent{.source = EventOrigin::push,
                  .block = block,
                  .time = time,
                  .standing = is_held ? Standing::first : Standing::result,
                  .number = number,
                  .sequence = is_held ? Sequence::baseline : Sequence::next});
}

void CounterSource::judge(EventOrigin origin, const Registers& block, WallTime time) {
  const std::uint16_t number = layout_.number_of(block);
  const std::optional<std::uint16_t> last = tracker_.last();
  if (!has_place_ && !last) return judge_unread_first(block, time);
  const Tracked tracked = tracker_.track(number, layout_.key_of(block));
  const bool is_first = std::exchange(first_, std::nullopt) == number &&
                        tracked.novelty == Sequence::repeat && !EventTracker::is_blank(block);
  if (is_first) {
    return tell_(ToolEvent{.source = origin,
                           .block = block,
                           .time = time,
                           .standing = Standing::first,
                           .number = number,
                           .sequence = Sequence::baseline});
  }
  if (!tracked.is_new()) return;
  // Since it was restarted the tool has had no event; what stands in its registers is none.
  const bool restarted = tracked.novelty == Sequence::restart;
  const bool pushed = origin == EventOrigin::push;
  const bool is_none = restarted && number == 0 && (!pushed || EventTracker::is_blank(block));
  const EventOrigin learned = std::exchange(was_away_, false) ? EventOrigin::catch_up : origin;
  if (const auto reason = reason_of(tracked.novelty, learned); !reason.empty()) {
    tell_(EventGap{.missed = missed_of(tracked),
                   .reason = std::string(reason),
                   .after = last,
                   .before = is_none ? std::nullopt : std::optional(number),
                   .sequence = tracked.novelty});
  }
  if (is_none) return;
  tell_(ToolEvent{.source = origin,
                  .block = block,
                  .time = time,
                  .standing = restarted && !pushed ? Standing::remembered : Standing::result,
                  .number = number,
                  .sequence = tracked.novelty});
}

/// A tool that sends its events unasked, where it has to be told so again and again.
class PushSource final : public CounterSource {
 public:
  PushSource(const catalogue::Profile& profile, Clock& clock, Tell tell)
      : CounterSource(profile, clock, std::move(tell)), arming_(profile.events->arm) {}

  [[nodiscard]] std::string_view caveat() const override {
    return has_place() ? std::string_view()
                       : "where its last event can be read is not known, so what it does while it "
                         "is not connected shows only by the number of the next event";
  }
  [[nodiscard]] bool polls() const override { return false; }
  [[nodiscard]] TimePoint next_due() const override {
    return std::min(arm_due_, CounterSource::next_due());
  }
  Result<void> run_due(const Ask& ask) override;
  void disarm() override;

 protected:
  Result<void> arm() override;
  [[nodiscard]] TimePoint held_until() const override { return held_until_; }

 private:
  void plan_next() {
    arm_due_ = arming_ ? clock().now() + with_margin(arming_->every) : TimePoint::max();
  }

  std::optional<catalogue::Arming> arming_;
  TimePoint arm_due_ = TimePoint::max();
  TimePoint held_until_ = TimePoint::min();
};

Result<void> PushSource::arm() {
  plan_next();
  auto armed = device().switch_events(EventOutput::on);
  // One lost answer is no reason to give up a connection.
  const bool again = !armed && link::is_lost_answer(armed.error());
  if (again) armed = device().switch_events(EventOutput::on);
  held_until_ = clock().now() + held_comes_within;
  return armed;
}

Result<void> PushSource::run_due(const Ask& ask) {
  TRY(CounterSource::run_due(ask));
  if (clock().now() < arm_due_) return {};
  plan_next();
  return ask([this] { return device().switch_events(EventOutput::on); });
}

void PushSource::disarm() {
  // The owner of the line may want the events that are sent there.
  if (arming_ && !device().session().asks_owner()) {
    begin_farewell(device().session());
    const auto ignored = device().switch_events(EventOutput::off);
    static_cast<void>(ignored);
  }
  CounterSource::disarm();
}

/// A tool that says by a flag that there is a result. Reading clears it, so whatever becomes of the
/// answer, the block behind it is looked at.
class FlagSource final : public EventSource {
 public:
  FlagSource(Clock& clock, Tell tell) : clock_(&clock), tell_(std::move(tell)) {}

  [[nodiscard]] std::string_view caveat() const override {
    return "it does not count its results, so gaps cannot be known";
  }
  Result<void> attach(Device& device, Duration unseen) override;
  void forget() override;
  void recall(std::optional<LastEvent> last) override;
  [[nodiscard]] bool polls() const override { return true; }
  Result<void> poll() override { return look(EventOrigin::poll); }

 private:
  Result<void> look(EventOrigin origin);
  Result<void> take_result(EventOrigin origin);
  Result<void> look_behind(EventOrigin origin, const std::string& doubt);
  void tell(EventOrigin origin, Registers block);

  Clock* clock_;
  Tell tell_;
  Device* device_ = nullptr;
  std::optional<Registers> seen_ = std::nullopt;  ///< the block as last read
  std::optional<Registers> told_ = std::nullopt;  ///< the block of the last event told
};

/// The block is read first, so that a result whose flag is lost on the way can be told from it.
Result<void> FlagSource::attach(Device& device, Duration /*unseen*/) {
  device_ = &device;
  if (!seen_) {
    TRY_LET(auto block, device_->event_block());
    seen_ = std::move(block);
    return look(EventOrigin::catch_up);
  }
  tell_(EventGap{.missed = std::nullopt,
                 .reason = "the tool does not count its results: of those while the link was lost "
                           "only the last one can be known"});
  return look(EventOrigin::catch_up).and_then([this] {
    return look_behind(EventOrigin::catch_up, {});
  });
}

void FlagSource::forget() {
  seen_.reset();
  told_.reset();
}

Result<void> FlagSource::look(EventOrigin origin) {
  const auto flag = device_->take_event_flag();
  if (!flag && is_interrupt(flag.error())) {
    begin_farewell(device_->session());
    const auto told = look_behind(origin, {});
    static_cast<void>(told);  // it ends because of the interrupt
  }
  if (!flag && link::is_lost_answer(flag.error())) {
    return look_behind(origin, fmt::format("whether there was a result is not known: {}",
                                           message_of(flag.error())));
  }
  if (!flag) return tl::unexpected(flag.error());
  return *flag == Shown::yes ? take_result(origin) : Result<void>();
}

/// An event that nothing is told of while no client looks at the flag: the last one counts, as
/// after a lost link.
void FlagSource::recall(std::optional<LastEvent> last) {
  if (!last || !last->block) return;
  seen_ = last->block;
  told_ = std::move(last->block);
}

/// The flag is cleared, so now or never.
Result<void> FlagSource::take_result(EventOrigin origin) {
  auto block = device_->event_block();
  std::optional<Error> interrupt;
  if (!block && is_interrupt(block.error())) {
    interrupt = std::move(block.error());
    begin_farewell(device_->session());
    block = device_->event_block();
  }
  if (!block) {
    tell_(EventGap{.missed = std::nullopt,
                   .reason = fmt::format("there is a result, and it could not be read: {}",
                                         message_of(block.error())),
                   .is_only_here = true});
  } else if (told_ == *block) {
    tell_(EventGap{.missed = 1,
                   .reason = "the result that was read is the one before: another came before it "
                             "was read, or both are equal",
                   .is_only_here = true});
  } else {
    tell(origin, std::move(*block));
  }
  if (interrupt) return tl::unexpected(std::move(*interrupt));
  if (!block) return tl::unexpected(std::move(block.error()));
  return {};
}

/// Tells what stands in the block where it is not what stood there before, whatever the flag says.
/// `doubt`: what is told where it is; may be empty.
Result<void> FlagSource::look_behind(EventOrigin origin, const std::string& doubt) {
  auto block = device_->event_block();
  const bool is_new = block && seen_ != *block && !EventTracker::is_blank(*block);
  if (is_new) {
    tell(origin, std::move(*block));
    return {};
  }
  if (!doubt.empty()) {
    tell_(EventGap{.missed = std::nullopt, .reason = doubt, .is_only_here = true});
  }
  if (!block) return tl::unexpected(std::move(block.error()));
  return {};
}

void FlagSource::tell(EventOrigin origin, Registers block) {
  seen_ = block;
  told_ = block;
  tell_(ToolEvent{
      .source = origin, .block = std::move(block), .time = clock_->wall(), .is_only_here = true});
}

}  // namespace

std::unique_ptr<EventSource> EventSource::make(const catalogue::Profile& profile, EventMode mode,
                                               Clock& clock, Tell tell) {
  if (!profile.events || mode == EventMode::none) return nullptr;
  const catalogue::EventModel model = profile.events->model;
  if (model == catalogue::EventModel::flag) {
    return std::make_unique<FlagSource>(clock, std::move(tell));
  }
  if (model == catalogue::EventModel::push && mode == EventMode::declared) {
    return std::make_unique<PushSource>(profile, clock, std::move(tell));
  }
  return std::make_unique<CounterSource>(profile, clock, std::move(tell));
}

}  // namespace spindle::device
