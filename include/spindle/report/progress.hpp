#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/report/screen_lines.hpp"
#include "spindle/report/streams.hpp"

namespace spindle::report {

/// Whether people want to see how far long work has come.
enum class Showing : std::uint8_t { wanted, unwanted };

/// How far counted work has come.
struct Step {
  std::string what;  ///< "station3: reading"; another text begins another piece of work
  std::size_t done = 0;
  std::size_t total = 0;
  std::string more = {};    ///< beside the count: "2 found"
  std::size_t at_once = 1;  ///< how many are under way side by side: they also end together
};

/// How much of a terminal there is.
struct Screen {
  std::size_t columns = 0;
  std::size_t rows = 0;

  friend bool operator==(const Screen&, const Screen&) = default;
};

/// The last line of a terminal, or the last ones, that say how far long work has come. Says nothing
/// elsewhere and where it is not wanted, is never wider than the terminal, and never waits for a
/// terminal that does not take it. Several threads may call it.
///
/// As long as it lives, whatever is written to the streams takes the lines away first. It must be
/// made before threads write to them, and end after they did.
class Progress {
 public:
  Progress(Streams& streams, const Clock& clock, Showing showing);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// "station3: reading 312 of 725, 540/s, 1 s left". Rate and remaining time are left out while
  /// they would be guesses: in the first second, and before all that went on side by side came to
  /// an end twice. Drawn at most ten times a second, but always at the beginning, at the end, and
  /// where something else took the line away.
  void advance(const Step& step);

  /// A state, in words: at once.
  void show(std::string_view text);
  /// Several lines, at once, each at most screen().columns wide.
  void show(std::span<const ScreenLine> lines);
  /// The same state a little later, at most ten times a second.
  void refresh(std::string_view text);

  void clear();

  /// Whether there is a terminal that shows it.
  [[nodiscard]] bool is_shown() const { return is_shown_; }
  /// Cells that may be drawn on, so that a key's echo still fits, and rows; usual ones where the
  /// terminal does not say.
  [[nodiscard]] Screen screen() const;

 private:
  /// One piece of counted work.
  struct Work {
    std::string what = {};
    TimePoint began = {};
    std::size_t done_before = 0;
    std::size_t done = 0;
  };

  [[nodiscard]] std::string pace_of(const Step& step) const;
  [[nodiscard]] std::size_t room() const;
  [[nodiscard]] bool is_due() const;
  void draw(std::string_view text);
  void wipe();
  void put(std::string_view text, std::span<const ScreenLine> lines);
  [[nodiscard]] std::string wiping() const;

  Streams* streams_;
  const Clock* clock_;
  bool is_shown_;
  std::function<Result<void>(std::string_view)> out_ = {};
  std::function<void(std::string_view)> err_ = {};
  std::function<Result<std::size_t>(std::string_view, Duration)> out_for_ = {};
  std::mutex mutex_ = {};
  Work work_ = {};
  TimePoint drawn_at_ = {};
  std::vector<std::size_t> drawn_ = {};  ///< widths of the lines that stand there
};

}  // namespace spindle::report
