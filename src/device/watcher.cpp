#include "spindle/device/watcher.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "spindle/modbus/pdu.hpp"

namespace spindle::device {
namespace {

// Reconnection: soon at first, never a burden later.
constexpr Duration first_back_off = std::chrono::milliseconds(250);
constexpr Duration last_back_off = std::chrono::seconds(10);

/// A link that has served for so long has lasted: a little less than a second, which is how often a
/// tool is kept alive, or polled by who asks for that.
constexpr Duration long_enough = std::chrono::milliseconds(900);

/// What is read between the values may cost them a tenth of their pace.
constexpr std::uint64_t requests_for_a_look = 10;

/// How often the meaning of bits is read instead of what the motor does.
constexpr unsigned looks_for_meanings = 8;

/// A line that is too slow for what is asked is told at once, then this often.
constexpr Duration lag_told_every = std::chrono::minutes(1);

/// How long a wait may be before it is asked anew when to end.
constexpr Duration longest_pause = std::chrono::seconds(1);

/// The last words to a tool must not hold up the end of the program.
constexpr Duration farewell_timeout = std::chrono::milliseconds(500);

/// How many frames are taken at once: a tool that never falls silent must not keep us from others.
constexpr std::size_t max_taken = 4096;

/// Whether who refused says that it only can not do it now (1.1b3, section 7).
bool is_busy(std::uint8_t exception) {
  switch (static_cast<modbus::ExceptionCode>(exception)) {
    case modbus::ExceptionCode::acknowledge:
    case modbus::ExceptionCode::server_device_busy:
    case modbus::ExceptionCode::gateway_path_unavailable:
    case modbus::ExceptionCode::gateway_target_failed_to_respond:
      return true;
    default:
      return false;
  }
}

/// Trouble that may pass by itself, so that trying again makes sense.
bool may_pass(const Error& error) {
  if (error.exception && is_busy(*error.exception)) return true;
  switch (error.status()) {
    case ExitStatus::unreachable:
    case ExitStatus::no_answer:
    case ExitStatus::malformed:
      return true;
    default:
      return false;
  }
}

/// A little earlier than asked for, so that the time between two is never longer than it.
Duration with_margin(Duration period) { return period - period / 10; }

/// Asks once more where no answer came: one lost answer is no reason to give up a connection.
template <typename Ask>
Result<void> ask_twice(Ask ask) {
  Result<void> answered = ask();
  if (!answered && link::is_lost_answer(answered.error())) answered = ask();
  return answered;
}

/// Whether one event number is older than another, across the end of the counter.
bool is_before(std::uint16_t number, std::uint16_t other) {
  constexpr std::uint16_t half = 0x8000;
  return number != other && static_cast<std::uint16_t>(other - number) < half;
}

std::optional<GapNews> gap_of(const Tracked& tracked, EventSource source) {
  switch (tracked.novelty) {
    case Novelty::restart:
      return GapNews{std::nullopt, "the tool counts its events anew: it was restarted"};
    case Novelty::doubtful:
      return GapNews{std::nullopt,
                     "the tool may have been restarted while nobody was connected, and count its "
                     "events anew"};
    case Novelty::wrap:
      return GapNews{tracked.missed, "the tool's event counter began again behind 65535"};
    case Novelty::jump:
      break;
    case Novelty::baseline:
    case Novelty::repeat:
    case Novelty::next:
      return std::nullopt;
  }
  switch (source) {
    case EventSource::catch_up:
      return GapNews{tracked.missed, "events while nobody was connected"};
    case EventSource::poll:
      return GapNews{tracked.missed, "events came faster than they were polled"};
    case EventSource::push:
      break;
  }
  return GapNews{tracked.missed, "the tool's event counter jumped"};
}

}  // namespace

Watcher::Watcher(Open open, Plan plan, Reconnection reconnection, Clock& clock, Tell tell)
    : open_(std::move(open)),
      make_plan_(std::move(plan)),
      reconnection_(reconnection),
      clock_(&clock),
      tell_(std::move(tell)) {}

Result<void> Watcher::run(const Until& until) {
  auto watched = watch(until);
  leave();
  if (beat_.missed > 0) tell_lag(clock_->now());
  return watched;
}

std::optional<Error> Watcher::unreached() const {
  if (reached_) return std::nullopt;
  return trouble_.value_or(
      Error{.code = Errc::connect_timeout, .message = "no connection before the watch ended"});
}

bool Watcher::goes_on(const Until& until) const { return !stopped_ && clock_->now() < until(); }

Result<void> Watcher::watch(const Until& until) {
  while (goes_on(until)) {
    auto done = link_ ? serve(until) : connect(until);
    if (done) continue;
    if (!may_pass(done.error())) return done;
    tell_trouble(done.error());
    if (reconnection_ == Reconnection::never) return done;
    link_.reset();
  }
  return {};
}

// ---- connecting ----

Result<void> Watcher::connect(const Until& until) {
  if (auto paused = pause(until); !paused || !goes_on(until)) return paused;
  auto link = open_();
  if (!link) return tl::unexpected(std::move(link.error()));
  return greet(std::move(*link));
}

Result<void> Watcher::pause(const Until& until) {
  while (goes_on(until) && clock_->now() < retry_at_) {
    auto slept = clock_->sleep_until(std::min({retry_at_, until(), clock_->now() + longest_pause}));
    if (!slept) return slept;
  }
  return {};
}

/// At once where nothing failed yet; else a quarter of a second, doubling up to ten seconds. Up to
/// a fifth less, so that many watchers of one access point do not come back all at once.
Duration Watcher::back_off(unsigned failures) const {
  if (failures == 0) return Duration::zero();
  const unsigned doublings = std::min(failures - 1, 10U);
  const Duration even = std::min(last_back_off, first_back_off * (std::int64_t{1} << doublings));
  constexpr std::int64_t whole = 1000;
  constexpr std::int64_t steps = 201;
  return even * (whole - clock_->now().time_since_epoch().count() % steps) / whole;
}

/// Says what became of the link, and when it is tried again: at once where it has lasted, or is the
/// first one that served and did not.
void Watcher::tell_trouble(const Error& error) {
  const TimePoint now = clock_->now();
  trouble_ = error;
  if (link_) {
    hear_waiting();  // what had arrived before the line broke is still true
    tell(LinkNews{LinkState::lost, 0, message_of(error)});
    attempts_ = 0;
  } else {
    ++attempts_;
    if (reconnection_ == Reconnection::forever) {
      const LinkState state = reached_ ? LinkState::reconnecting : LinkState::connecting;
      tell(LinkNews{state, attempts_, message_of(error)});
    }
  }
  const bool lasted = link_ && served_ && now - connected_at_ >= long_enough;
  short_lived_ = lasted ? 0 : short_lived_ + 1;
  const unsigned forgiven = served_ && !lasted ? 1 : 0;
  served_ = false;
  retry_at_ = now + back_off(short_lived_ - forgiven);
}

Result<void> Watcher::greet(Link link) {
  if (profile_ != &link.device.profile()) {
    if (auto learned = learn(link.device.profile()); !learned) return learned;
  }
  link_ = std::move(link);
  connected_at_ = clock_->now();
  reached_ = true;
  compare_identity(link_->identity);
  return begin();
}

Result<void> Watcher::learn(const catalogue::Profile& profile) {
  auto plan = make_plan_(profile);
  if (!plan) return tl::unexpected(std::move(plan.error()));
  plan_ = std::move(*plan);
  previous_.assign(plan_.values.size(), std::nullopt);
  polled_ = plan_.values;
  motor_.reset();
  if (plan_.motor) motor_.emplace(*plan_.motor, plan_.values);
  profile_ = &profile;
  layout_.reset();
  if (profile.events) layout_.emplace(profile);
  return {};
}

void Watcher::compare_identity(const std::string& identity) {
  const bool other = !known_identity_.empty() && known_identity_ != identity;
  std::string message = "connected";
  if (other) {
    message = fmt::format("not the tool of before: {} (before: {})", identity, known_identity_);
  } else if (!identity.empty()) {
    message += ": " + identity;
  }
  known_identity_ = identity;
  tell(LinkNews{LinkState::connected, attempts_, message});
  if (!other) return;
  if (plan_.events != EventMode::none) {
    tell(GapNews{std::nullopt, "what the tool of before did after its link was lost is not known"});
  }
  tracker_ = {};
  previous_.assign(plan_.values.size(), std::nullopt);
}

/// The counter is read before the output is armed, and the last event once more after it: whatever
/// happens in between is either pushed or fetched.
Result<void> Watcher::begin() {
  const TimePoint now = clock_->now();
  keep_alive_due_ = now + with_margin(profile_->link.keep_alive);
  poll_due_ = std::max(now, poll_due_);
  beat_ = {.since = poll_due_, .missed = beat_.missed};
  meanings_known_ = false;
  if (plan_.events == EventMode::none) return {};
  if (tracker_.last()) {
    tracker_.look_again(now - seen_at_);
  } else {
    const auto number = link_->device.event_number();
    if (!number) return tl::unexpected(number.error());
    tracker_.set_baseline(*number);
    take_waiting();  // pushed before the counter was read, so they are old
  }
  if (plan_.events == EventMode::push) {
    auto armed = ask_twice([&] { return link_->device.switch_events(EventOutput::on); });
    if (!armed) return armed;
    arm_due_ = now + with_margin(profile_->events->arm_every);
  }
  return fetch_last(EventSource::catch_up).map([this](Fetched) { seen_at_ = clock_->now(); });
}

// ---- serving ----

Result<void> Watcher::serve(const Until& until) {
  while (!stopped_) {
    const TimePoint end = until();
    if (clock_->now() >= end) break;
    auto frame = link_->device.session().next_spontaneous(std::min(end, next_due()));
    if (!frame) return tl::unexpected(std::move(frame.error()));
    if (*frame) hear(**frame);
    if (stopped_) break;
    if (auto done = run_due(); !done) return done;
  }
  return {};
}

TimePoint Watcher::next_due() const {
  TimePoint due = clock_->now() + longest_pause;
  if (profile_->link.keep_alive > Duration::zero()) due = std::min(due, keep_alive_due_);
  if (plan_.events == EventMode::push) due = std::min(due, arm_due_);
  if (polls()) due = std::min(due, poll_due_);
  return due;
}

Result<void> Watcher::run_due() {
  const TimePoint now = clock_->now();
  if (plan_.events == EventMode::push && now >= arm_due_) {
    arm_due_ = now + with_margin(profile_->events->arm_every);
    if (auto armed = ask([&] { return link_->device.switch_events(EventOutput::on); }); !armed) {
      return armed;
    }
  }
  if (profile_->link.keep_alive > Duration::zero() && now >= keep_alive_due_) {
    keep_alive_due_ = now + with_margin(profile_->link.keep_alive);
    if (auto alive = keep_alive(); !alive) return alive;
  }
  if (!polls() || now < poll_due_) return {};
  const TimePoint due = poll_due_;
  keep_beat(now);
  auto polled = poll();
  if (!polled) poll_due_ = due;  // what was not read is read as soon as it can be
  return polled;
}

/// The next poll is due on the beat; a beat that is over has been missed.
void Watcher::keep_beat(TimePoint now) {
  const auto skipped = (now - poll_due_) / plan_.interval;
  poll_due_ += (skipped + 1) * plan_.interval;
  beat_.missed += static_cast<std::uint32_t>(skipped);
  const bool silent = lag_told_at_ && now < *lag_told_at_ + lag_told_every;
  if (beat_.missed > 0 && !silent) tell_lag(now);
  ++beat_.polls;
}

void Watcher::tell_lag(TimePoint now) {
  const Duration achieved = beat_.polls == 0
                                ? plan_.interval
                                : (now - beat_.since) / std::max<std::int64_t>(beat_.polls, 1);
  tell(LagNews{beat_.missed, plan_.interval, achieved});
  beat_ = {.since = now};
  lag_told_at_ = now;
}

Result<void> Watcher::keep_alive() {
  return ask([&] { return link_->device.ping().map([](Duration) {}); }).map([&] {
    served_ = true;
    seen_at_ = clock_->now();
  });
}

/// Asks while events are told as they come: a tool that is slow to answer must not hold them up.
Result<void> Watcher::ask(const std::function<Result<void>()>& request) {
  hear_waiting();
  link::Session& session = link_->device.session();
  session.set_hearer([this](const link::Spontaneous& frame) { hear(frame); });
  auto answered = ask_twice(request);
  session.set_hearer({});
  return answered;
}

Result<void> Watcher::poll() {
  if (plan_.events == EventMode::poll) {
    const auto number = link_->device.event_number();
    if (!number) return tl::unexpected(number.error());
    if (*number != tracker_.last()) {
      if (auto fetched = fetch_polled(*number); !fetched) return fetched;
    }
    seen_at_ = clock_->now();
  }
  if (!polls_values()) return {};
  return poll_values().map([&] {
    served_ = true;
    seen_at_ = clock_->now();
  });
}

/// Fetches the event of a counter that has changed; one that runs away is told as it was seen.
Result<void> Watcher::fetch_polled(std::uint16_t number) {
  const auto fetched = fetch_last(EventSource::poll);
  if (!fetched) return tl::unexpected(fetched.error());
  if (*fetched == Fetched::yes) return {};
  const auto missed = static_cast<std::uint16_t>(number - tracker_.last().value_or(number));
  tracker_.set_baseline(number);
  tell(GapNews{missed, "events came faster than they could be read"});
  return {};
}

/// The values on every beat; what else has to be known between them.
Result<void> Watcher::poll_values() {
  if (!meanings_known_) {
    if (auto learned = learn_meanings(); !learned) return learned;
  }
  const std::uint64_t before = requests();
  if (auto read = read_values(); !read || stopped_) return read;
  requests_owed_ += requests() - before;
  return look_between();
}

Result<void> Watcher::read_values() {
  if (polled_.empty()) return {};
  auto readings = link_->device.read_each(polled_, Limits::skip);
  if (!readings) return tl::unexpected(std::move(readings.error()));
  if (motor_) {
    if (auto told = tell_motor(motor_->take(link_->device, *readings)); !told) return told;
  }
  for (std::size_t index = 0; index < polled_.size() && !stopped_; ++index) {
    Reading& reading = (*readings)[index];
    if (!reading.value) return tl::unexpected(std::move(reading.value.error()));
    tell_reading(index, reading);
  }
  return {};
}

/// Which names of bits count is decided by another parameter, which hardly ever changes.
Result<void> Watcher::learn_meanings() {
  std::vector<catalogue::Parameter> open;
  for (const catalogue::Parameter& parameter : plan_.values) {
    if (!parameter.bits_by.empty()) open.push_back(parameter);
  }
  meanings_known_ = true;
  if (open.empty()) return {};
  auto readings = link_->device.read_each(open, Limits::skip);
  if (!readings) return tl::unexpected(std::move(readings.error()));
  for (Reading& reading : *readings) {
    for (catalogue::Parameter& parameter : polled_) {
      if (parameter.name == reading.parameter.name) parameter = reading.parameter;
    }
  }
  return {};
}

/// One piece at a time, where there is time for it before the next beat, or where its turn has come
/// although there is none.
Result<void> Watcher::look_between() {
  const bool has_meanings = std::any_of(plan_.values.begin(), plan_.values.end(),
                                        [](const auto& each) { return !each.bits_by.empty(); });
  if (!has_meanings && !(motor_ && motor_->needs_turns())) return {};
  const TimePoint began = clock_->now();
  const std::uint64_t before = requests();
  const bool has_time = began + last_look_ + last_look_ / 2 <= poll_due_;
  if (!has_time && requests_owed_ < requests_for_a_look) return {};
  requests_owed_ = 0;
  const bool of_meaning = has_meanings && ++looks_between_ % looks_for_meanings == 0;
  if (of_meaning) return learn_meanings();
  if (!motor_ || !motor_->needs_turns()) return {};
  auto told = tell_motor(motor_->take_turn(link_->device));
  // What happened may have been looked at more closely.
  const auto made = static_cast<std::int64_t>(requests() - before);
  last_look_ = (clock_->now() - began) / std::max<std::int64_t>(made, 1);
  return told;
}

Result<void> Watcher::tell_motor(Result<std::vector<MotorNews>> news) {
  if (!news) return tl::unexpected(std::move(news.error()));
  for (const MotorNews& one : *news) tell(one);
  return {};
}

void Watcher::tell_reading(std::size_t index, Reading& reading) {
  std::optional<catalogue::Value>& previous = previous_[index];
  const bool changed = previous && !(*previous == *reading.value);
  const bool wanted = plan_.samples == Samples::all || changed ||
                      (!previous && plan_.samples == Samples::changes_and_first);
  if (wanted) {
    tell(ValueNews{&plan_.values[index], std::move(*reading.registers), *reading.value, previous});
  }
  previous = std::move(*reading.value);
}

// ---- events ----

/// Events may have been pushed while the last one was fetched: it is told in its place among them,
/// and only if it is not one of them.
Result<Watcher::Fetched> Watcher::fetch_last(EventSource source) {
  const auto block = link_->device.last_event();
  const WallTime fetched = clock_->wall();
  const auto pushed = take_waiting();
  const auto block_of = [](const link::Spontaneous& frame) {
    return modbus::registers_of(frame.pdu);
  };
  const bool read = block && *block;
  const bool needed =
      read && std::none_of(pushed.begin(), pushed.end(), [&](const link::Spontaneous& frame) {
        return number_of(block_of(frame)) == number_of(**block);
      });
  auto next = pushed.begin();
  for (; needed && next != pushed.end(); ++next) {
    if (!is_before(number_of(block_of(*next)), number_of(**block))) break;
    hear(*next);
  }
  if (needed) judge(source, **block, fetched);
  for (; next != pushed.end(); ++next) hear(*next);
  if (!block) return tl::unexpected(block.error());
  return read ? Fetched::yes : Fetched::too_fast;
}

/// What was pushed and not heard yet, without waiting.
std::vector<link::Spontaneous> Watcher::take_waiting() {
  std::vector<link::Spontaneous> waiting;
  while (waiting.size() < max_taken) {
    auto frame = link_->device.session().next_spontaneous(clock_->now());
    if (!frame || !*frame) break;  // a broken line is noticed by whoever uses it next
    waiting.push_back(std::move(**frame));
  }
  return waiting;
}

void Watcher::hear_waiting() {
  for (const link::Spontaneous& frame : take_waiting()) hear(frame);
}

void Watcher::hear(const link::Spontaneous& frame) {
  if (plan_.events == EventMode::none) return;
  seen_at_ = clock_->now();
  judge(EventSource::push, modbus::registers_of(frame.pdu), frame.wall);
}

void Watcher::judge(EventSource source, const Registers& block, WallTime time) {
  const Tracked tracked = tracker_.track(number_of(block), block);
  if (!tracked.is_new()) return;
  if (const auto gap = gap_of(tracked, source)) tell(*gap);
  // Since it was restarted the tool has had no event; what stands in its registers is none.
  const bool nothing_yet = tracked.novelty == Novelty::restart && number_of(block) == 0 &&
                           (source != EventSource::push || EventTracker::is_blank(block));
  if (nothing_yet) return;
  served_ = true;
  const bool remembered = tracked.novelty == Novelty::restart && source != EventSource::push;
  tell(EventNews{source, block, time, remembered ? Standing::remembered : Standing::result});
}

void Watcher::tell(const News& news) {
  if (!stopped_ && tell_(news) == Heed::stop) stopped_ = true;
}

// ---- leaving ----

void Watcher::leave() {
  if (!link_ || plan_.events != EventMode::push) return;
  link::Session& session = link_->device.session();
  session.shield();
  session.set_answer_timeout(std::min(session.options().answer_timeout, farewell_timeout));
  // The tool switches itself off when it hears nothing; a lost farewell costs only time.
  const auto ignored = link_->device.switch_events(EventOutput::off);
  static_cast<void>(ignored);
  hear_waiting();
}

}  // namespace spindle::device
