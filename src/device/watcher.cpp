#include "spindle/device/watcher.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

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

/// Whether who refused says that it only cannot do it now (1.1b3, section 7).
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
    case ExitStatus::storage:  // what keeps the events cannot do so now
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

}  // namespace

Watcher::Watcher(Open open, Plan plan, Reconnection reconnection, Clock& clock, Tell tell,
                 RecordHooks hooks)
    : open_(std::move(open)),
      make_plan_(std::move(plan)),
      reconnection_(reconnection),
      clock_(&clock),
      tell_(std::move(tell)),
      hooks_(std::move(hooks)) {}

Result<void> Watcher::run(const Until& until) {
  auto watched = watch(until);
  disarm();
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
    if (!may_pass(done.error()) && !goes_on_behind(done.error())) return done;
    tell_trouble(done.error());
    if (reconnection_ == Reconnection::never) return done;
    link_.reset();
  }
  return {};
}

/// Whether it is tried again what no retry mends by itself, which may be mended.
bool Watcher::goes_on_behind(const Error& error) const {
  if (reconnection_ != Reconnection::whatever) return false;
  const ExitStatus status = error.status();
  return status == ExitStatus::refused || status == ExitStatus::mismatch;
}

// ---- connecting ----

Result<void> Watcher::connect(const Until& until) {
  if (auto paused = pause(until); !paused || !goes_on(until)) return paused;
  TRY_LET(auto link, open_());
  return attach(std::move(link));
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
    tell(LinkChange{LinkState::lost, 0, message_of(error)});
    attempts_ = 0;
  } else {
    ++attempts_;
    if (reconnection_ != Reconnection::never) {
      const LinkState state = reached_ ? LinkState::reconnecting : LinkState::connecting;
      tell(LinkChange{state, attempts_, message_of(error)});
    }
  }
  const bool lasted = link_ && served_ && now - connected_at_ >= long_enough;
  short_lived_ = lasted ? 0 : short_lived_ + 1;
  const unsigned forgiven = served_ && !lasted ? 1 : 0;
  served_ = false;
  retry_at_ = now + back_off(short_lived_ - forgiven);
}

Result<void> Watcher::attach(Link link) {
  if (profile_ != &link.device.profile()) {
    TRY(adopt_profile(link.device.profile()));
  }
  hears_ = false;
  link_ = std::move(link);
  connected_at_ = clock_->now();
  reached_ = true;
  compare_identity(link_->identity);
  TRY(consult_record());
  return begin();
}

/// What keeps the events learns of the tool, and says what it knows of it where we know nothing.
Result<void> Watcher::consult_record() {
  if (!hooks_.on_connected) return {};
  TRY_LET(auto past, hooks_.on_connected(link_->device));
  const bool is_news = source_ && !std::exchange(recalled_, true);
  if (is_news && (past.last || past.wants_first)) source_->recall(std::move(past.last));
  return {};
}

Result<void> Watcher::adopt_profile(const catalogue::Profile& profile) {
  TRY_LET(auto plan, make_plan_(profile));
  plan_ = std::move(plan);
  previous_.assign(plan_.values.size(), std::nullopt);
  polled_ = plan_.values;
  motor_.reset();
  if (plan_.motor) motor_.emplace(*plan_.motor, plan_.values);
  profile_ = &profile;
  recalled_ = false;
  source_ = EventSource::make(profile, plan_.events, *clock_, [this](const auto& news) {
    if (std::holds_alternative<ToolEvent>(news)) served_ = true;
    std::visit([this](const auto& one) { tell(one); }, news);
  });
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
  if (source_ && !std::exchange(caveat_told_, true) && !source_->caveat().empty()) {
    message += fmt::format("; {}", source_->caveat());
  }
  tell(LinkChange{LinkState::connected, attempts_, message});
  if (!other) return;
  if (source_) {
    tell(EventGap{.missed = std::nullopt,
                  .reason = "what the tool of before did after its link was lost is not known"});
    source_->forget();
    recalled_ = false;
  }
  previous_.assign(plan_.values.size(), std::nullopt);
}

Result<void> Watcher::begin() {
  const TimePoint now = clock_->now();
  keep_alive_due_ = now + with_margin(profile_->link.keep_alive);
  poll_due_ = std::max(now, poll_due_);
  beat_ = {.since = poll_due_, .missed = beat_.missed};
  meanings_known_ = false;
  if (!source_) return {};
  hears_ = true;
  // A connection may be lost before it served: what was read on it until then counts.
  if (!seen_at_) seen_at_ = now;
  return source_->attach(link_->device, now - *seen_at_).map([this] { seen_at_ = clock_->now(); });
}

// ---- serving ----

Result<void> Watcher::serve(const Until& until) {
  while (!stopped_) {
    const TimePoint end = until();
    if (clock_->now() >= end) break;
    TRY_LET(auto frame, link_->device.session().next_spontaneous(std::min(end, next_due())));
    if (frame) handle(*frame);
    if (stopped_) break;
    TRY(run_due());
  }
  return {};
}

TimePoint Watcher::next_due() const {
  TimePoint due = clock_->now() + longest_pause;
  if (profile_->link.keep_alive > Duration::zero()) due = std::min(due, keep_alive_due_);
  if (source_) due = std::min(due, source_->next_due());
  if (polls()) due = std::min(due, poll_due_);
  return due;
}

Result<void> Watcher::run_due() {
  const TimePoint now = clock_->now();
  if (source_) {
    auto armed = source_->run_due([this](const auto& request) { return ask(request); });
    if (!armed) return armed;
  }
  if (profile_->link.keep_alive > Duration::zero() && now >= keep_alive_due_) {
    keep_alive_due_ = now + with_margin(profile_->link.keep_alive);
    TRY(keep_alive());
  }
  TRY(run_errand());
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
  tell(PollLag{beat_.missed, plan_.interval, achieved});
  beat_ = {.since = now};
  lag_told_at_ = now;
}

/// Reads what was asked for beside the watch. What the tool refuses to say ends no watch.
Result<void> Watcher::run_errand() {
  if (!hooks_.errand) return {};
  auto errand = hooks_.errand();
  if (!errand) return {};
  std::vector<Reading> readings;
  auto read = ask([&] {
    return link_->device.read_each(errand->wanted, Limits::skip).map([&](auto taken) {
      readings = std::move(taken);
    });
  });
  if (!read) return read;
  errand->take(readings);
  return {};
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
  session.on_spontaneous([this](const link::Spontaneous& frame) { handle(frame); });
  auto answered = ask_twice(request);
  session.on_spontaneous({});
  return answered;
}

Result<void> Watcher::poll() {
  if (source_ && source_->polls()) {
    TRY(source_->poll());
    seen_at_ = clock_->now();
  }
  if (!polls_values()) return {};
  return poll_values().map([&] {
    served_ = true;
    seen_at_ = clock_->now();
  });
}

/// The values on every beat; what else has to be known between them.
Result<void> Watcher::poll_values() {
  if (!meanings_known_) {
    TRY(learn_meanings());
  }
  const std::uint64_t before = requests();
  if (auto read = read_values(); !read || stopped_) return read;
  requests_owed_ += requests() - before;
  return look_between();
}

Result<void> Watcher::read_values() {
  if (polled_.empty()) return {};
  TRY_LET(auto readings, link_->device.read_each(polled_, Limits::skip));
  if (motor_) {
    TRY(tell_motor(motor_->take(link_->device, readings)));
  }
  for (std::size_t index = 0; index < polled_.size() && !stopped_; ++index) {
    Reading& reading = readings[index];
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
  TRY_LET(auto readings, link_->device.read_each(open, Limits::skip));
  for (Reading& reading : readings) {
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

Result<void> Watcher::tell_motor(Result<std::vector<MotorTransition>> news) {
  if (!news) return tl::unexpected(std::move(news.error()));
  for (const MotorTransition& one : *news) tell(one);
  return {};
}

void Watcher::tell_reading(std::size_t index, Reading& reading) {
  std::optional<catalogue::Value>& previous = previous_[index];
  const bool changed = previous && !(*previous == *reading.value);
  const bool wanted = plan_.samples == Samples::all || changed ||
                      (!previous && plan_.samples == Samples::changes_and_first);
  if (wanted) {
    tell(
        PolledValue{&plan_.values[index], std::move(*reading.registers), *reading.value, previous});
  }
  previous = std::move(*reading.value);
}

// ---- events ----

void Watcher::hear_waiting() {
  if (hears_) source_->handle_waiting();
}

void Watcher::handle(const link::Spontaneous& frame) {
  if (!source_) return;
  seen_at_ = clock_->now();
  source_->handle(frame);
}

void Watcher::tell(const WatchEvent& news) {
  if (!stopped_ && tell_(news) == WatchControl::stop) stopped_ = true;
}

// ---- leaving ----

void Watcher::disarm() {
  if (link_ && hears_) source_->disarm();
}

}  // namespace spindle::device
