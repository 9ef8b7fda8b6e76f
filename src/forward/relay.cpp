#include "relay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "spindle/base/text.hpp"

namespace spindle::forward {
namespace {

/// How often the store is looked at while nothing waits.
constexpr Duration look_every = std::chrono::milliseconds(100);
/// How long one call waits for acknowledgements before other things get their turn.
constexpr Duration patience = std::chrono::milliseconds(100);
/// The place of the sink is stored so often, and oftener only where else more would be sent again
/// after a crash than a window.
constexpr Duration save_every = std::chrono::milliseconds(200);
constexpr Duration state_every = std::chrono::seconds(1);
/// A connection that ends sooner, and had nothing to deliver, was of no use.
constexpr Duration lasting = std::chrono::seconds(5);
constexpr Duration tell_every = std::chrono::seconds(1);
constexpr Duration count_every = std::chrono::seconds(5);

}  // namespace

Relay::Relay(Means means)
    : means_(std::move(means)),
      states_(means_.rows),
      backoff_(
          static_cast<std::uint32_t>(means_.context.clock.wall().time_since_epoch().count() +
                                     static_cast<std::int64_t>(means_.context.disk.process()))) {
  counters_.name = means_.settings.name;
  counters_.delivered = 0;
}

Result<commands::Outcome> Relay::run() {
  auto worked = prepare();
  if (worked) worked = work();
  auto saved = save();
  means_.sink.close();
  write_metrics();
  if (worked && !saved) worked = std::move(saved);
  return finish(worked);
}

Result<void> Relay::prepare() {
  if (means_.options.delivery == commands::Delivery::once) {
    TRY_LET(end_, means_.rows.reader().ends());
  }
  outbox_.emplace(
      means_.rows, means_.collector,
      [this](const Parcel& parcel) { return means_.sink.wants(parcel); },
      means_.cursor.row().positions, end_);
  // From now on trim waits for this sink.
  return means_.cursor.move(means_.cursor.row().positions, means_.settings.urls.front(), wall());
}

/// Failures end it only where the user waits for the end.
Result<void> Relay::work() {
  while (true) {
    is_going_on_ = false;
    auto served = serve();
    if (served || is_ended()) return {};
    means_.sink.close();
    const bool is_hopeless = end_.has_value() && !is_going_on_;
    if (is_hopeless) return served;
    fail(served.error());
    wait(backoff_.next());
    if (is_ended()) return {};
  }
}

/// Returns without an error where it is done, or a signal came.
Result<void> Relay::serve() {
  auto connected = connect();
  means_.news.ready();
  TRY(std::move(connected));
  states_.forget_told();
  while (!is_ended()) {
    TRY(step());
    look_around();
    if (is_done()) return {};
  }
  return {};
}

Result<void> Relay::connect() {
  Greeting greeting;
  TRY_LET(const auto places, means_.rows.reader().places());
  std::set<std::string> names;
  for (const store::Place& place : places) names.insert(place.name);
  greeting.targets.assign(names.begin(), names.end());
  greeting.first = outbox_->positions().event + 1;
  TRY_LET(greeting.last, means_.rows.reader().newest());
  TRY(means_.sink.connect(greeting));
  connected_at_ = now();
  if (told_.empty() && *counters_.delivered == 0) {
    means_.context.renderer.note(fmt::format("{}: connected", means_.settings.name));
  }
  return {};
}

Result<void> Relay::step() {
  TRY(tell_states());
  TRY(outbox_->fill(means_.sink.window()));
  if (!outbox_->empty()) return deliver();
  note_success(false);
  TRY(save_when_due());
  if (is_done()) return {};
  return means_.sink.idle(look_every);
}

/// What is acknowledged but not said so in the store counts as on its way: a crash sends it again.
Result<void> Relay::deliver() {
  const std::size_t window = means_.sink.window();
  TRY_LET(
      const auto acknowledged,
      means_.sink.deliver(outbox_->front(std::max<std::size_t>(window - unsaved_, 1)), patience));
  outbox_->acknowledge(acknowledged);
  unsaved_ += acknowledged;
  *counters_.delivered += acknowledged;
  if (acknowledged > 0) note_success(true);
  return 2 * unsaved_ >= window ? save() : save_when_due();
}

Result<void> Relay::save_when_due() {
  if (now() - saved_at_ < save_every) return {};
  return save();
}

Result<void> Relay::save() {
  if (!outbox_ || outbox_->positions() == means_.cursor.row().positions) return {};
  saved_at_ = now();
  TRY(means_.cursor.move(outbox_->positions(), means_.settings.urls.front(), wall()));
  unsaved_ = 0;
  return {};
}

Result<void> Relay::tell_states() {
  if (!means_.sink.tells_states() || now() - stated_at_ < state_every) return {};
  stated_at_ = now();
  TRY_LET(const auto states, states_.changed(wall()));
  if (states.empty()) return {};
  return means_.sink.tell_states(states);
}

bool Relay::is_done() const {
  if (!end_) return false;
  const store::Positions& there = outbox_->positions();
  return there.event >= end_->event && there.gap >= end_->gap && there.happening >= end_->happening;
}

void Relay::fail(const Error& error) {
  ++counters_.errors[std::string(info(error.status()).name)];
  Error named = error;
  if (named.target.empty()) named.target = means_.settings.name;
  std::string text = describe(named);
  if (text == told_) return;
  told_ = std::move(text);
  static_cast<void>(means_.context.renderer.error(named, wall()));
  means_.news.status(told_);
}

void Relay::note_success(bool is_acknowledged) {
  if (!is_acknowledged && now() - connected_at_ < lasting) return;
  is_going_on_ = true;
  backoff_.reset();
  if (std::exchange(told_, std::string()).empty()) return;
  means_.context.renderer.note(fmt::format("{}: delivers again", means_.settings.name));
}

void Relay::wait(Duration time) {
  const TimePoint end = now() + time;
  while (now() < end) {
    const TimePoint next = std::min(end, now() + tell_every);
    if (!means_.context.clock.sleep_until(next)) return;
    look_around();
  }
}

/// What is told to those who watch over this program.
void Relay::look_around() {
  if (now() - looked_at_ < tell_every) return;
  looked_at_ = now();
  means_.news.alive();
  if (!told_.empty()) means_.news.status(told_);  // it may have come too soon behind another one
  if (means_.take_reload && means_.take_reload()) {
    means_.context.renderer.note(
        fmt::format("{}: a forwarder reads its settings when it starts; restart it to have others",
                    means_.settings.name));
  }
  if (now() - counted_at_ < count_every) return;
  counted_at_ = now();
  write_metrics();
  if (!told_.empty()) return;
  means_.news.status(
      fmt::format("{} delivered, {} waiting", *counters_.delivered, counters_.backlog));
}

void Relay::write_metrics() {
  if (means_.options.metrics.empty() && !means_.news.is_heard()) return;
  const auto backlog =
      means_.rows.reader().behind(outbox_ ? outbox_->positions() : means_.cursor.row().positions);
  if (!backlog) return;
  counters_.backlog = backlog->events;
  counters_.oldest =
      backlog->oldest
          ? std::optional<Duration>(std::max(Duration(wall() - *backlog->oldest), Duration::zero()))
          : std::nullopt;
  if (means_.options.metrics.empty()) return;
  const auto text = commands::to_prometheus(
      {.sinks = {counters_}, .version = std::string(means_.context.version)});
  const auto written =
      means_.context.disk.write(means_.options.metrics, text, Overwrite::allow, Privacy::usual);
  std::string trouble = written ? std::string() : describe(written.error());
  if (trouble == trouble_) return;
  trouble_ = std::move(trouble);
  if (!trouble_.empty()) means_.context.renderer.note(trouble_);
}

Result<commands::Outcome> Relay::finish(const Result<void>& worked) {
  commands::Outcome outcome;
  const bool was_cut = end_ && worked && is_ended() && !(outbox_ && is_done());
  if (!worked) {
    Error error = worked.error();
    if (error.target.empty()) error.target = means_.settings.name;
    outcome.fail(error);
    TRY(means_.context.renderer.error(error, wall()));
  } else if (was_cut) {
    outcome.fail(means_.context.interrupt.error());
  } else {
    outcome.succeed();
  }
  const auto backlog = means_.rows.reader().behind(means_.cursor.row().positions);
  const std::size_t waiting = backlog ? backlog->events + backlog->gaps : 0;
  const auto status = static_cast<std::int64_t>(outcome.status());
  report::Record summary = {
      .type = "summary",
      .target = {},
      .time = wall(),
      .fields = {{"sink", means_.settings.name},
                 {"delivered", report::number(static_cast<std::int64_t>(*counters_.delivered))},
                 {"waiting", report::count(waiting)},
                 {"exit_status", report::number(status)}}};
  TRY(means_.context.renderer.summary(
      summary, fmt::format("{}: {} delivered, {} waiting", means_.settings.name,
                           *counters_.delivered, waiting)));
  return outcome;
}

}  // namespace spindle::forward
