#include "page/live.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "page/metrics.hpp"
#include "page/recorder.hpp"
#include "page/state_json.hpp"

namespace spindle::page {
namespace {

/// A tool that was not heard for so long is named, and has no card.
constexpr auto forgotten_after = std::chrono::days(7);

bool is_forgotten(const Station& station, WallTime now) {
  auto last = station.heard.value_or(WallTime());
  if (station.link && station.link->at > last) last = station.link->at;
  return last + forgotten_after < now;
}

/// A store that cannot be read now says nothing of its sinks.
std::vector<commands::SinkMetrics> sinks_of(const std::string& store, WallTime now) {
  const auto reader = store::Reader::open(store);
  if (!reader) return {};
  return commands::sink_metrics(**reader, now).value_or(std::vector<commands::SinkMetrics>());
}

}  // namespace

std::string frame(std::string_view event, const std::optional<Position>& id,
                  std::string_view data) {
  return fmt::format("event: {}\n{}data: {}\n\n", event,
                     id ? fmt::format("id: {}\n", to_text(*id)) : std::string(), data);
}

// ---- the one that changes it ----

void Live::replace(Board board, const Position& position, Origin origin) {
  const std::lock_guard lock(mutex_);
  if (origin == Origin::other_store) ++store_;
  board.inherit(board_);
  board_ = std::move(board);
  position_ = position;
  cards_.clear();
  // Rows that came meanwhile were told to no listener: each reads for itself what it lacks.
  log_begin_ += log_.size() + 1;
  log_.clear();
  log_bytes_ = 0;
  refresh(true);
  changed_.notify_all();
}

Result<void> Live::advance(
    const std::function<Result<void>(Board&, Position&, std::vector<Told>&)>& change) {
  const std::lock_guard lock(mutex_);
  std::vector<Told> told;
  auto done = change(board_, position_, told);
  for (Told& record : told) {
    const Position present = std::exchange(position_, record.position);
    log(frame("record", record.position, record.json));
    position_ = present;
  }
  refresh(false);
  if (!told.empty()) changed_.notify_all();
  return done;
}

void Live::situate(const std::string& problem, Recorder recorder) {
  const std::lock_guard lock(mutex_);
  const bool is_new = problem != problem_ || recorder != recorder_;
  problem_ = problem;
  recorder_ = recorder;
  if (problem.empty()) read_at_ = clock_->wall();
  const auto today =
      std::chrono::floor<std::chrono::days>(clock_->wall() + clock_->utc_offset(clock_->wall()));
  // Times are shown with their day from the next one on.
  const bool is_another_day = std::exchange(day_, today) != today;
  if (is_new || is_another_day) return refresh(is_another_day);
  refresh(false);
}

void Live::close() {
  const std::lock_guard lock(mutex_);
  is_over_ = true;
  changed_.notify_all();
}

/// Draws anew what is another than before, and tells it.
void Live::refresh(bool is_all) {
  const Moment now = moment();
  const auto touched = board_.take_changed();
  std::vector<std::string> drawn;
  std::vector<std::string> old;
  bool has_order = is_all;
  for (const auto& [name, station] : board_.stations()) {
    if (is_forgotten(station, now.now)) {
      has_order = cards_.erase(name) > 0 || has_order;
      old.push_back(name);
      continue;
    }
    const auto [card, is_new] = cards_.try_emplace(name);
    has_order = has_order || is_new;
    LinkView link = link_view(station, recorder_, now.now, *clock_);
    const bool is_same_link = link == card->second.link;
    if (!is_all && !is_new && is_same_link && !touched.contains(name)) continue;
    card->second.link = std::move(link);
    std::string html = card_html(station, card->second.link, now);
    if (html == card->second.html && !is_all) continue;
    card->second.html = std::move(html);
    drawn.push_back(name);
  }
  old_ = std::move(old);
  std::string above = overview_html(overview(), now);
  const bool is_same = above == overview_html_;
  overview_html_ = std::move(above);
  const auto said = board_.take_said();
  if (drawn.empty() && !has_order && is_same) return;
  log(view_frame(drawn, has_order, is_all ? std::vector<std::string>() : said));
  changed_.notify_all();
}

void Live::log(std::string text) {
  log_bytes_ += text.size();
  log_.push_back({std::move(text), position_});
  // The newest one always stays: it is what those who wait are woken for.
  while (log_.size() > 1 &&
         (log_.size() > options_.most_frames || log_bytes_ > options_.most_bytes)) {
    log_bytes_ -= log_.front().text.size();
    log_.pop_front();
    ++log_begin_;
  }
}

// ---- those who read it ----

std::string Live::as_of() const {
  return read_at_ == WallTime() ? std::string("never")
                                : time_text(read_at_, clock_->wall(), *clock_);
}

Overview Live::overview() const {
  Overview overview{.shift = board_.shift(), .recorder = recorder_, .problem = problem_};
  overview.old = old_;
  for (const auto& [name, card] : cards_) {
    const auto found = board_.stations().find(name);
    if (found == board_.stations().end()) continue;
    ++overview.tools;
    if (card.link.shown == LinkShown::up) ++overview.up;
    if (card.link.shown == LinkShown::down) ++overview.down;
    if (card.link.shown == LinkShown::unknown) ++overview.unknown;
  }
  std::vector<Miss> misses;
  for (const auto& [name, station] : board_.stations()) {
    overview.ok += station.ok;
    overview.ng += station.ng;
    misses.insert(misses.end(), station.misses.begin(), station.misses.end());
  }
  overview.missed = sum_of(misses);
  return overview;
}

std::string Live::view_frame(const std::vector<std::string>& names, bool has_order,
                             const std::vector<std::string>& said) const {
  std::string cards;
  for (const std::string& name : names) {
    cards += fmt::format("{}\"{}\":{}", cards.empty() ? "" : ",", key_of(name),
                         quoted(cards_.at(name).html));
  }
  std::string json = fmt::format(R"({{"as_of":{},"overview":{},"cards":{{{}}})", quoted(as_of()),
                                 quoted(overview_html_), cards);
  if (has_order) {
    std::vector<std::string> order;
    for (const auto& [name, card] : cards_) order.push_back(quoted(key_of(name)));
    json += fmt::format(R"(,"order":[{}])", fmt::join(order, ","));
  }
  std::vector<std::string> words;
  for (const std::string& each : said) words.push_back(quoted(each));
  json += fmt::format(R"(,"say":[{}]}})", fmt::join(words, ","));
  return frame("view", position_, json);
}

std::string Live::page() {
  const std::lock_guard lock(mutex_);
  PageParts parts{.id = to_text(position_),
                  .overview = overview_html_,
                  .as_of = as_of(),
                  .version = options_.version};
  const auto offset = clock_->utc_offset(clock_->wall());
  const auto minutes = std::chrono::duration_cast<std::chrono::minutes>(offset).count();
  parts.zone = minutes == 0 ? std::string("UTC")
                            : fmt::format("UTC{}{:02}:{:02}", minutes < 0 ? '-' : '+',
                                          std::abs(minutes) / 60, std::abs(minutes) % 60);
  for (const auto& [name, card] : cards_) parts.cards.push_back(card.html);
  return page_html(parts);
}

std::string Live::state() {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> tools;
  for (const auto& [name, card] : cards_) {
    const auto found = board_.stations().find(name);
    if (found != board_.stations().end()) tools.push_back(station_json(found->second, card.link));
  }
  return state_json(overview(), position_, read_at_, tools);
}

std::string Live::metrics(std::size_t streams) {
  const std::lock_guard lock(mutex_);
  commands::Metrics metrics = board_.totals();
  metrics.version = options_.version;
  metrics.store_bytes = size_of(options_.store);
  metrics.sinks = sinks_of(options_.store, clock_->wall());
  for (const auto& [name, card] : cards_) {
    const LinkShown shown = card.link.shown;
    if (shown != LinkShown::unknown) metrics.links[name] = shown == LinkShown::up;
    const auto found = board_.stations().find(name);
    if (found == board_.stations().end()) continue;
    const auto& last = found->second.last;
    if (last && !last->is_old) metrics.last_results[name] = last->at;
  }
  return metrics_text(metrics,
                      {.recorder = recorder_, .streams = streams, .is_readable = problem_.empty()});
}

std::pair<std::string, Live::Place> Live::join() {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  for (const auto& [name, card] : cards_) names.push_back(name);
  return {view_frame(names, true, {}),
          {.next = log_begin_ + log_.size(), .position = position_, .store = store_}};
}

Position Live::position() {
  const std::lock_guard lock(mutex_);
  return position_;
}

Live::Batch Live::wait(Place& place, std::chrono::milliseconds patience) {
  constexpr std::size_t most_at_once = 256U << 10U;
  std::unique_lock lock(mutex_);
  const std::uint64_t nudges = nudges_;
  changed_.wait_for(lock, patience, [&] {
    return is_over_ || nudges != nudges_ || place.next < log_begin_ + log_.size();
  });
  Batch batch{.is_late = place.next < log_begin_, .is_over = is_over_};
  if (batch.is_late || batch.is_over) return batch;
  for (auto at = place.next - log_begin_; at < log_.size() && batch.text.size() < most_at_once;
       ++at) {
    batch.text += log_[at].text;
    place.next = log_begin_ + at + 1;
    place.position = log_[at].position;
  }
  return batch;
}

void Live::nudge() {
  const std::lock_guard lock(mutex_);
  ++nudges_;
  changed_.notify_all();
}

std::string Live::beat() {
  const std::lock_guard lock(mutex_);
  return ": still here\n" + frame("now", std::nullopt, quoted(as_of()));
}

}  // namespace spindle::page
