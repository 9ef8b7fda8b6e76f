#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/base/line_channel.hpp"
#include "spindle/store/rows.hpp"
#include "spindle/work/lease_lines.hpp"

namespace spindle::commands {

/// Which tools this collector holds of those that several collectors share. Another program asks
/// the database; it is started here, and anew when it ended. All time that counts here is this
/// computer's monotonic clock, from before a renewal was asked for: a lease ends here before the
/// database gives it to another collector, whatever becomes of that program, of the network or of
/// the database. Any thread may ask.
class Leases {
 public:
  using Start = std::function<Result<std::unique_ptr<LineChannel>>()>;
  using Note = std::function<void(const std::string& text)>;

  /// `ttl` is one second or more. All that is referred to outlives it; `note` is called by a thread
  /// of its own.
  Leases(Start start, Duration ttl, Clock& clock, const Interrupt& interrupt, Note note);
  /// Ends; what is held then ends with its time.
  ~Leases();
  Leases(const Leases&) = delete;
  Leases& operator=(const Leases&) = delete;

  /// The names of the tools that are wanted from now on.
  void want(std::set<std::string> names);

  /// Those that may be watched now.
  [[nodiscard]] std::set<std::string> held() const;

  /// The number of a tool's lease; empty: it is not held.
  [[nodiscard]] std::optional<std::int64_t> fence(const std::string& name) const;

  /// The last that a tool told any collector, as far as the database knows; empty: nothing. Error
  /// `storage` where it cannot be asked now.
  Result<std::optional<store::Last>> last(const store::ToolName& name);

  /// No tool is watched any more: gives all back at once, as far as that is still possible.
  void give_back();

 private:
  struct Held {
    std::int64_t fence = 0;
    TimePoint until = {};
  };

  void run();
  void renew();
  void take(const work::LeaseLine& answer, TimePoint until);
  Result<work::LeaseLine> ask(const std::string& verb, std::vector<std::string> words,
                              TimePoint deadline);
  Result<void> open();
  void tell(const std::string& text);
  [[nodiscard]] bool wait(Duration time);

  Start start_;
  Duration ttl_;
  Clock* clock_;
  const Interrupt* interrupt_;
  Note note_;
  mutable std::mutex mutex_ = {};  ///< of what is wanted and held
  std::condition_variable ended_ = {};
  bool closing_ = false;
  std::set<std::string> wanted_ = {};
  std::map<std::string, Held> held_ = {};
  std::mutex channel_mutex_ = {};  ///< one question at a time
  std::unique_ptr<LineChannel> channel_ = nullptr;
  std::uint64_t questions_ = 0;
  TimePoint retry_at_ = {};
  Duration retry_ = {};
  std::string told_ = {};  ///< what is wrong, as it was told last
  std::thread thread_ = {};
};

}  // namespace spindle::commands
