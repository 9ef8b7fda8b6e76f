#include "spindle/report/progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "display.hpp"

namespace spindle::report {
namespace {

using std::chrono::seconds;

constexpr Duration shortest_between_drawings = std::chrono::milliseconds(100);
constexpr Duration shortest_for_a_pace = seconds(1);
constexpr std::size_t usual_columns = 80;
constexpr std::size_t usual_rows = 24;
// ECMA-48: to the first column, and erase to the end of the line.
constexpr std::string_view wipe_line = "\r\x1b[K";

/// "540/s", "2.5/s", "12/min"; empty when it is slower than people count.
std::string rate_text(std::size_t steps, Duration elapsed) {
  const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(elapsed).count();
  const auto per = [&](std::int64_t tenths_of_unit) {
    return static_cast<std::int64_t>(steps) * tenths_of_unit / milliseconds;
  };
  constexpr std::int64_t tenths_per_second = 10'000;
  constexpr std::int64_t per_minute = 60'000;
  const std::int64_t tenths = per(tenths_per_second);
  if (tenths >= 100) return fmt::format("{}/s", tenths / 10);
  if (tenths >= 10) return fmt::format("{}.{}/s", tenths / 10, tenths % 10);
  const std::int64_t minutely = per(per_minute);
  return minutely > 0 ? fmt::format("{}/min", minutely) : std::string();
}

/// Rounded up, so that "0 s left" never stands there: "8 s left", "3 min left", "2 h left".
std::string remaining_text(Duration remaining) {
  const auto left = std::chrono::ceil<seconds>(remaining).count();
  constexpr std::int64_t minute = 60;
  constexpr std::int64_t hour = 3600;
  if (left <= 2 * minute) return fmt::format("{} s left", left);
  if (left <= 2 * hour) return fmt::format("{} min left", (left + minute - 1) / minute);
  return fmt::format("{} h left", (left + hour - 1) / hour);
}

}  // namespace

Progress::Progress(Streams& streams, const Clock& clock, Showing showing)
    : streams_(&streams),
      clock_(&clock),
      is_shown_(streams.err_is_terminal && showing == Showing::wanted) {
  if (!is_shown_) return;
  out_ = std::move(streams.out);
  err_ = std::move(streams.err);
  out_for_ = std::move(streams.out_for);
  streams.out = [this](std::string_view text) {
    const std::lock_guard lock(mutex_);
    if (streams_->out_is_terminal) wipe();
    return out_(text);
  };
  streams.err = [this](std::string_view text) {
    const std::lock_guard lock(mutex_);
    wipe();
    err_(text);
  };
  if (!out_for_) return;
  streams.out_for = [this](std::string_view text, Duration patience) {
    const std::lock_guard lock(mutex_);
    if (streams_->out_is_terminal) wipe();
    return out_for_(text, patience);
  };
}

Progress::~Progress() {
  if (!is_shown_) return;
  clear();
  streams_->out = std::move(out_);
  streams_->err = std::move(err_);
  streams_->out_for = std::move(out_for_);
}

void Progress::advance(const Step& step) {
  if (!is_shown_) return;
  const std::lock_guard lock(mutex_);
  const bool is_new = step.what != work_.what || step.done < work_.done;
  if (is_new) work_ = {.what = step.what, .began = clock_->now(), .done_before = step.done};
  work_.done = step.done;
  if (!is_new && step.done < step.total && !is_due()) return;
  std::string counts = fmt::format(" {} of {}", step.done, step.total);
  if (!step.more.empty()) counts += ", " + step.more;
  counts += pace_of(step);
  // The counts say more than the beginning of a long name.
  const std::size_t taken = display_width(counts);
  const std::size_t left = room() > taken ? room() - taken : 0;
  draw(fitted(printable(step.what, LineBreaks::fold), left, Keep::end) + counts);
}

void Progress::show(std::string_view text) {
  if (!is_shown_) return;
  const std::lock_guard lock(mutex_);
  draw(text);
}

void Progress::show(std::span<const ScreenLine> lines) {
  if (!is_shown_) return;
  const std::lock_guard lock(mutex_);
  std::string text;
  for (const ScreenLine& line : lines) {
    if (!text.empty()) text += '\n';
    text += line.text;
  }
  put(text, lines);
  drawn_at_ = clock_->now();
}

void Progress::refresh(std::string_view text) {
  if (!is_shown_) return;
  const std::lock_guard lock(mutex_);
  if (is_due()) draw(text);
}

void Progress::clear() {
  if (!is_shown_) return;
  const std::lock_guard lock(mutex_);
  wipe();
}

std::string Progress::pace_of(const Step& step) const {
  const Duration elapsed = clock_->now() - work_.began;
  const std::size_t steps = step.done - work_.done_before;
  const bool is_guess = elapsed < shortest_for_a_pace || steps < 2 * step.at_once;
  if (is_guess || step.done >= step.total) return {};
  std::string text;
  if (const std::string rate = rate_text(steps, elapsed); !rate.empty()) text = ", " + rate;
  const std::size_t open = step.total - step.done;
  const Duration remaining =
      elapsed / static_cast<Duration::rep>(steps) * static_cast<Duration::rep>(open);
  return text + ", " + remaining_text(remaining);
}

/// Cells that may be drawn on: in the last one of a row some terminals go to the next.
std::size_t Progress::room() const {
  const std::size_t columns = streams_->err_columns ? streams_->err_columns() : 0;
  return (columns > 1 ? columns : usual_columns) - 1;
}

Screen Progress::screen() const {
  const std::size_t rows = streams_->err_rows ? streams_->err_rows() : 0;
  constexpr std::size_t echo = 2;  // "^C"
  const std::size_t columns = room();
  return {columns > 2 * echo ? columns - echo : columns, rows > 0 ? rows : usual_rows};
}

bool Progress::is_due() const {
  return drawn_.empty() || clock_->now() - drawn_at_ >= shortest_between_drawings;
}

void Progress::draw(std::string_view text) {
  const ScreenLine line = screen_line(text, room());
  put(line.text, {&line, 1});
  drawn_at_ = clock_->now();
}

void Progress::wipe() {
  if (!drawn_.empty()) put({}, {});
}

/// A terminal that became narrower has put what did not fit any more into further rows.
std::string Progress::wiping() const {
  const std::size_t columns = room() + 1;
  std::size_t rows = 0;
  for (const std::size_t width : drawn_)
    rows += std::max<std::size_t>((width + columns - 1) / columns, 1);
  if (rows <= 1) return std::string(wipe_line);
  return fmt::format("\r\x1b[{}A\x1b[J", rows - 1);
}

void Progress::put(std::string_view text, std::span<const ScreenLine> lines) {
  if (streams_->err_is_ready && !streams_->err_is_ready()) return;
  err_(wiping().append(text));
  drawn_.clear();
  for (const ScreenLine& line : lines) drawn_.push_back(line.width);
}

}  // namespace spindle::report
