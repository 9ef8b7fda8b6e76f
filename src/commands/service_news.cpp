#include "spindle/commands/service_news.hpp"

#include <fmt/format.h>

#include <utility>

namespace spindle::commands {
namespace {

constexpr Duration status_every = std::chrono::seconds(1);
/// How long what waits to be stored is worth more than a fresh start.
constexpr Duration patience_in_trouble = std::chrono::hours(1);
/// sd_watchdog_enabled(3) wants half of the period at most.
constexpr int beats_of_period = 4;

std::int64_t microseconds(Duration duration) {
  return std::chrono::duration_cast<std::chrono::microseconds>(duration).count();
}

}  // namespace

ServiceNews::ServiceNews(ServiceManager manager, const Clock& clock)
    : manager_(std::move(manager)), clock_(&clock) {}

void ServiceNews::tell(std::string_view state) const {
  if (manager_.notify) manager_.notify(state);
}

std::optional<Duration> ServiceNews::period() const {
  if (!manager_.watchdog) return std::nullopt;
  return *manager_.watchdog / beats_of_period;
}

void ServiceNews::ready() {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(is_ready_, true)) return;
  }
  tell("READY=1");
}

bool ServiceNews::is_ready() {
  const std::lock_guard lock(mutex_);
  return is_ready_;
}

void ServiceNews::reloading() {
  if (!is_ready()) return;
  // By its time systemd tells this reload from one that it asks for later.
  tell(fmt::format("RELOADING=1\nMONOTONIC_USEC={}",
                   microseconds(clock_->now().time_since_epoch())));
}

void ServiceNews::reloaded() {
  if (is_ready()) tell("READY=1");
}

void ServiceNews::stopping() { tell("STOPPING=1"); }

void ServiceNews::status(std::string sentence) {
  {
    const std::lock_guard lock(mutex_);
    const bool is_soon = said_at_ && clock_->now() < *said_at_ + status_every;
    if (is_soon || sentence == sentence_) return;
    said_at_ = clock_->now();
    sentence_ = sentence;
  }
  tell("STATUS=" + sentence);
}

void ServiceNews::alive() {
  if (!manager_.watchdog) return;
  {
    const std::lock_guard lock(mutex_);
    const TimePoint now = clock_->now();
    if (alive_at_ && now < *alive_at_ + *period() / 2) return;
    alive_at_ = now;
  }
  tell("WATCHDOG=1");
}

void ServiceNews::trouble(bool is_in_trouble) {
  if (!manager_.watchdog) return;
  const Duration period = is_in_trouble ? patience_in_trouble : *manager_.watchdog;
  tell(fmt::format("WATCHDOG_USEC={}", microseconds(period)));
}

ServiceNews begin_service(const Context& context) {
  const Supervision& supervision = context.supervision;
  if (supervision.heed_reload) supervision.heed_reload();
  return {supervision.take_manager ? supervision.take_manager() : ServiceManager(), context.clock};
}

}  // namespace spindle::commands
