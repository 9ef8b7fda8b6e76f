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

/// The last words to a tool must not hold up the end of the program.
constexpr Duration farewell_timeout = std::chrono::milliseconds(500);

/// Trouble that may pass by itself, so that trying again makes sense.
bool may_pass(const Error& error) {
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

}  // namespace

Watcher::Watcher(Open open, const catalogue::Profile& profile, WatchPlan plan, Clock& clock,
                 Tell tell)
    : open_(std::move(open)),
      profile_(&profile),
      plan_(std::move(plan)),
      clock_(&clock),
      tell_(std::move(tell)),
      previous_(plan_.values.size()) {
  if (!profile.events) return;
  if (const auto number = profile.find(profile.events->number)) {
    number_at_ = number->address.value - profile.events->first;
  }
}

Result<void> Watcher::run(const Until& until) {
  auto watched = watch(until);
  leave();
  return watched;
}

Result<void> Watcher::watch(const Until& until) {
  while (!stopped_ && clock_->now() < until()) {
    auto done = link_ ? serve(until) : connect(until);
    if (done) continue;
    if (!may_pass(done.error()) || plan_.reconnection == Reconnection::never) return done;
    lose(done.error());
  }
  return {};
}

Result<void> Watcher::connect(const Until& until) {
  auto link = open_();
  if (link) return greet(std::move(*link));
  if (!may_pass(link.error()) || plan_.reconnection == Reconnection::never) {
    return tl::unexpected(std::move(link.error()));
  }
  ++attempt_;
  tell(LinkNews{LinkState::reconnecting, attempt_, message_of(link.error())});
  if (stopped_) return {};
  return clock_->sleep_until(std::min(until(), clock_->now() + back_off()));
}

/// A quarter of a second, doubling up to ten seconds, a fifth more or less so that many watchers of
/// one access point do not come back all at once.
Duration Watcher::back_off() const {
  const unsigned doublings = std::min(attempt_ - 1, 10U);
  const Duration even = std::min(last_back_off, first_back_off * (std::int64_t{1} << doublings));
  constexpr std::int64_t steps = 401;
  const std::int64_t spread = clock_->now().time_since_epoch().count() % steps;
  return even * (800 + spread) / 1000;
}

Result<void> Watcher::greet(Link link) {
  std::string message = "connected";
  if (!link.identity.empty()) message += ": " + link.identity;
  const bool other = !known_identity_.empty() && known_identity_ != link.identity;
  if (other) {
    message =
        fmt::format("another tool answers now: {} (before: {})", link.identity, known_identity_);
    tracker_ = {};
    previous_.assign(plan_.values.size(), std::nullopt);
  }
  known_identity_ = link.identity;
  link_ = std::move(link);
  tell(LinkNews{LinkState::connected, attempt_, message});
  attempt_ = 0;
  return begin();
}

/// The counter is read before the output is armed, and the last event once more after it: whatever
/// happens in between is either pushed or fetched.
Result<void> Watcher::begin() {
  const TimePoint now = clock_->now();
  keep_alive_due_ = now + with_margin(profile_->link.keep_alive);
  poll_due_ = now;
  if (plan_.events == EventMode::none) return {};
  if (!tracker_.last()) {
    const auto number = link_->device.event_number();
    if (!number) return tl::unexpected(number.error());
    tracker_.set_baseline(*number);
  }
  if (plan_.events == EventMode::push) {
    if (auto armed = link_->device.switch_events(EventOutput::on); !armed) return armed;
    arm_due_ = now + with_margin(profile_->events->arm_every);
  }
  return fetch_last(EventSource::catch_up);
}

Result<void> Watcher::serve(const Until& until) {
  while (!stopped_ && clock_->now() < until()) {
    auto frame = link_->device.session().next_spontaneous(std::min(until(), next_due()));
    if (!frame) return tl::unexpected(std::move(frame.error()));
    if (*frame) hear(**frame);
    if (stopped_) break;
    if (auto done = run_due(); !done) return done;
  }
  return {};
}

TimePoint Watcher::next_due() const {
  TimePoint due = TimePoint::max();
  if (profile_->link.keep_alive > Duration::zero()) due = std::min(due, keep_alive_due_);
  if (plan_.events == EventMode::push) due = std::min(due, arm_due_);
  if (plan_.events == EventMode::poll || !plan_.values.empty()) due = std::min(due, poll_due_);
  return due;
}

Result<void> Watcher::run_due() {
  const TimePoint now = clock_->now();
  if (plan_.events == EventMode::push && now >= arm_due_) {
    arm_due_ = now + with_margin(profile_->events->arm_every);
    if (auto armed = link_->device.switch_events(EventOutput::on); !armed) return armed;
  }
  if (profile_->link.keep_alive > Duration::zero() && now >= keep_alive_due_) {
    keep_alive_due_ = now + with_margin(profile_->link.keep_alive);
    if (auto alive = link_->device.ping(); !alive) return tl::unexpected(std::move(alive.error()));
  }
  if (now < poll_due_) return {};
  poll_due_ = now + plan_.interval;
  if (plan_.events == EventMode::poll) {
    if (auto polled = poll_number(); !polled) return polled;
  }
  return plan_.values.empty() ? Result<void>() : poll_values();
}

Result<void> Watcher::poll_values() {
  auto readings = link_->device.read_each(plan_.values, Limits::skip);
  if (!readings) return tl::unexpected(std::move(readings.error()));
  for (std::size_t index = 0; index < readings->size() && !stopped_; ++index) {
    Reading& reading = (*readings)[index];
    if (!reading.value) return tl::unexpected(std::move(reading.value.error()));
    std::optional<catalogue::Value>& previous = previous_[index];
    const bool first = !previous.has_value();
    const bool changed = !first && !(*previous == *reading.value);
    const bool wanted = plan_.samples == Samples::all || changed ||
                        (first && plan_.samples == Samples::changes_and_first);
    if (wanted) {
      tell(
          ValueNews{&plan_.values[index], std::move(*reading.registers), *reading.value, previous});
    }
    previous = std::move(*reading.value);
  }
  return {};
}

Result<void> Watcher::poll_number() {
  const auto number = link_->device.event_number();
  if (!number) return tl::unexpected(number.error());
  return *number == tracker_.last() ? Result<void>() : fetch_last(EventSource::poll);
}

Result<void> Watcher::fetch_last(EventSource source) {
  auto block = link_->device.last_event();
  if (!block) return tl::unexpected(std::move(block.error()));
  judge(source, std::move(*block), clock_->wall());
  return {};
}

void Watcher::hear(const link::Spontaneous& frame) {
  if (plan_.events == EventMode::none) return;
  judge(EventSource::push, modbus::registers_of(frame.pdu), frame.wall);
}

void Watcher::judge(EventSource source, Registers block, WallTime time) {
  const Tracked tracked = tracker_.track(block[number_at_], block);
  if (!tracked.is_new()) return;
  tell_gap(tracked, source);
  if (!stopped_) tell(EventNews{source, std::move(block), time});
}

void Watcher::tell_gap(const Tracked& tracked, EventSource source) {
  switch (tracked.novelty) {
    case Novelty::restart:
      tell(GapNews{std::nullopt, "the tool counts its events anew: it was restarted"});
      return;
    case Novelty::wrap:
      tell(GapNews{tracked.missed, "the tool's event counter began again behind 65535"});
      return;
    case Novelty::jump:
      tell(GapNews{tracked.missed, source == EventSource::catch_up
                                       ? "events while nobody was connected"
                                       : "the tool's event counter jumped"});
      return;
    case Novelty::baseline:
    case Novelty::repeat:
    case Novelty::next:
      return;
  }
}

void Watcher::tell(const News& news) {
  if (!stopped_ && tell_(news) == Heed::stop) stopped_ = true;
}

void Watcher::lose(const Error& error) {
  // What had arrived before the line broke is still true.
  while (link_) {
    auto frame = link_->device.session().next_spontaneous(clock_->now());
    if (!frame || !*frame) break;
    hear(**frame);
  }
  link_.reset();
  tell(LinkNews{LinkState::lost, 0, message_of(error)});
}

void Watcher::leave() {
  if (!link_ || plan_.events != EventMode::push) return;
  link::Session& session = link_->device.session();
  session.shield();
  session.set_answer_timeout(std::min(session.options().answer_timeout, farewell_timeout));
  // The tool switches itself off when it hears nothing; a lost farewell costs only time.
  const auto ignored = link_->device.switch_events(EventOutput::off);
  static_cast<void>(ignored);
}

}  // namespace spindle::device
