#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "watched_tool.hpp"

namespace spindle::commands {

/// What one tool's thread and the roster tell each other.
class Task {
 public:
  /// The tool is not to be watched any more: its watch has to end soon, and leave it disarmed.
  [[nodiscard]] bool is_leaving() const { return leaving_.load(); }
  /// It was tried to reach the tool, whatever came of it.
  void note_tried() { tried_.store(true); }

 private:
  friend class Roster;

  std::atomic<bool> leaving_ = false;
  std::atomic<bool> tried_ = false;
};

/// Which tools are watched, each in a thread of its own, while their set changes. A tool that stays
/// is not touched. What conflicts waits: a tool begins once those that leave and have its name, its
/// host or its line have left. One thread may call it.
class Roster {
 public:
  /// Watches a tool until it ends by itself, or is asked to leave. Called in the tool's thread.
  using Watch = std::function<void(WatchedTool& tool, Task& task)>;

  struct Change {
    std::size_t begun = 0;
    std::size_t left = 0;
    std::size_t changed = 0;  ///< left and begun
    std::size_t kept = 0;
  };
  struct Standing {
    std::size_t wanted = 0;
    std::size_t watched = 0;  ///< those that are, or will be as soon as others have left
    std::size_t paused = 0;   ///< another collector holds them
    std::size_t untried = 0;  ///< watched, and never tried so far
  };

  explicit Roster(Watch watch) : watch_(std::move(watch)) {}
  /// Asks all to leave, and waits for them.
  ~Roster();
  Roster(const Roster&) = delete;
  Roster& operator=(const Roster&) = delete;

  /// From now on these are to be watched: others leave, and what is new, what differs in anything
  /// but its limits, and what had ended begins. Names are unique.
  Change want(std::vector<WatchedTool> tools);

  /// Only these of them, by name: another collector holds the others, so they are paused. Empty:
  /// all of them, as at first.
  void allow(std::optional<std::set<std::string>> names);

  [[nodiscard]] Standing standing();

  /// Whether every watch has ended, and none is to come unless a tool is wanted or allowed anew.
  [[nodiscard]] bool is_idle();

  /// Waits until every watch has ended, as it does when all waits of the program are ended.
  void join();

 private:
  struct Seat {
    explicit Seat(WatchedTool watched) : entry(watched.target()), tool(std::move(watched)) {}

    Target entry;  ///< as it is wanted; what the tool is may be found out later
    WatchedTool tool;
    Task task = {};
    bool is_done = false;
    std::thread thread = {};
  };

  [[nodiscard]] bool may_watch(const std::string& name) const;
  [[nodiscard]] Seat* seat_of(const std::string& name) const;
  bool leave(const std::string& name);
  void begin(const WatchedTool& tool);
  void follow();
  void run(Seat& seat);
  [[nodiscard]] bool has_to_wait(const Seat& seat) const;
  void sweep();

  Watch watch_;
  std::vector<WatchedTool> wanted_ = {};
  std::optional<std::set<std::string>> allowed_ = std::nullopt;
  mutable std::mutex mutex_ = {};
  std::condition_variable changed_ = {};
  std::vector<std::unique_ptr<Seat>> seats_ = {};  ///< in the order in which they began
};

}  // namespace spindle::commands
