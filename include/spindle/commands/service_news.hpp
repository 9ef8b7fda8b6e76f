#pragma once

#include <mutex>
#include <optional>
#include <string>

#include "spindle/base/clock.hpp"
#include "spindle/base/service_manager.hpp"
#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// What a service manager is told of a program that runs on (sd_notify(3)). Without a manager,
/// nothing. Several threads may call it.
class ServiceNews {
 public:
  /// `clock` must outlive it.
  ServiceNews(ServiceManager manager, const Clock& clock);

  /// It does its work from now on; told once.
  void ready();
  /// It reads its files again, until reloaded(); nothing before it is ready.
  void reloading();
  void reloaded();
  void stopping();

  /// What it does, in a sentence: told when it is another one, and at most once a second.
  void status(std::string sentence);

  /// Its work goes on. Told often enough, and not much more often.
  void alive();
  /// Its work fails, and is tried again; what waits for that would be lost in a restart, so the
  /// manager is asked to wait for an hour. No error: it goes on.
  void trouble(bool is_in_trouble);

  /// Whether there is a manager.
  [[nodiscard]] bool is_heard() const { return static_cast<bool>(manager_.notify); }
  /// How often alive() has to be called; empty: never.
  [[nodiscard]] std::optional<Duration> period() const;

 private:
  void tell(std::string_view state) const;
  [[nodiscard]] bool is_ready();

  ServiceManager manager_;
  const Clock* clock_;
  std::mutex mutex_ = {};
  bool is_ready_ = false;
  std::string sentence_ = {};
  std::optional<TimePoint> said_at_ = std::nullopt;
  std::optional<TimePoint> alive_at_ = std::nullopt;
};

/// For a command that runs on: what it tells its manager, if it has one. From now on SIGHUP ends
/// nothing, but is a wish of which Supervision tells. The context must outlive it.
ServiceNews begin_service(const Context& context);

}  // namespace spindle::commands
