#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "page/board.hpp"
#include "page/position.hpp"
#include "page/view.hpp"
#include "spindle/base/clock.hpp"

namespace spindle::page {

/// One server-sent event: "event: …", with an id where there is one, data on one line, and the
/// blank line that ends it.
std::string frame(std::string_view event, const std::optional<Position>& id, std::string_view data);

/// What is known now, and a log of what was told lately. One thread changes it; any number of
/// others read it and wait for more.
class Live {
 public:
  struct Options {
    std::size_t most_frames = 4096;      ///< that the log keeps
    std::size_t most_bytes = 4U << 20U;  ///< of these
    std::string version = {};            ///< of spindle
    std::string store = {};              ///< path, for metrics
  };
  Live(const Clock& clock, Options options) : clock_(&clock), options_(std::move(options)) {}

  // ---- the one that changes it ----

  /// A record, and the position behind it.
  struct Told {
    Position position;
    std::string json;
  };
  /// Whether positions of before mean the same rows still.
  enum class Origin : std::uint8_t { same_store, other_store };
  /// A whole new state, as at the start: those who listen have to join again.
  void replace(Board board, const Position& position, Origin origin = Origin::same_store);
  /// Applies what is new; `change` adds what is told. Where it fails, what it did before counts.
  Result<void> advance(
      const std::function<Result<void>(Board&, Position&, std::vector<Told>&)>& change);
  /// How the store and its recorder are; an empty problem: it was read now.
  void situate(const std::string& problem, Recorder recorder);
  /// Ends all waiting, for ever.
  void close();

  // ---- those who read it ----

  [[nodiscard]] std::string page();
  [[nodiscard]] std::string state();
  [[nodiscard]] std::string metrics(std::size_t streams);

  /// Where a listener stands in the log, and up to where the store was told to it.
  struct Place {
    std::uint64_t next = 0;
    Position position = {};
    std::uint64_t store = 0;  ///< which one its position is of, counted
  };
  /// Everything as one frame, and the place from which on to listen.
  [[nodiscard]] std::pair<std::string, Place> join();
  [[nodiscard]] Position position();

  struct Batch {
    std::string text = {};
    bool is_late = false;  ///< what comes next is in the log no more: join again
    bool is_over = false;
  };
  /// What came behind `place`, which is moved; waits for it as long as this takes at most.
  Batch wait(Place& place, std::chrono::milliseconds patience);
  /// Ends all waiting of now.
  void nudge();
  /// The frame that says when the store was read last.
  [[nodiscard]] std::string beat();

 private:
  struct Card {
    std::string html = {};
    LinkView link = {};
  };
  struct Logged {
    std::string text;
    Position position;
  };

  [[nodiscard]] Moment moment() const { return {.now = clock_->wall(), .clock = *clock_}; }
  [[nodiscard]] std::string as_of() const;
  [[nodiscard]] Overview overview() const;
  [[nodiscard]] std::string view_frame(const std::vector<std::string>& names, bool has_order,
                                       const std::vector<std::string>& said) const;
  void log(std::string text);
  void refresh(bool is_all);

  const Clock* clock_;
  Options options_;
  std::mutex mutex_ = {};
  std::condition_variable changed_ = {};
  Board board_ = Board({}, {});
  Position position_ = {};
  std::uint64_t store_ = 0;
  std::map<std::string, Card> cards_ = {};
  std::vector<std::string> old_ = {};
  std::string overview_html_ = {};
  std::string problem_ = "The store was not read yet.";
  Recorder recorder_ = Recorder::unknown;
  WallTime read_at_ = {};
  std::chrono::sys_days day_ = {};
  std::deque<Logged> log_ = {};
  std::size_t log_bytes_ = 0;
  std::uint64_t log_begin_ = 0;  ///< number of its first frame
  std::uint64_t nudges_ = 0;
  bool is_over_ = false;
};

}  // namespace spindle::page
