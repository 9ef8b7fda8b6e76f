#include "spindle/work/journal.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace spindle::work {
namespace {

/// What need not be stored at once is stored after so long.
constexpr Duration lazy_every = std::chrono::seconds(10);

/// A curve is as large as a hundred events, so that curves find no room when much less waits.
constexpr std::size_t curve_share = 50;

constexpr std::string_view no_room =
    "the store could not be written, and the memory for events that wait was full";

std::optional<std::uint32_t> sum(std::optional<std::uint32_t> a, std::optional<std::uint32_t> b) {
  return a && b ? std::optional(*a + *b) : std::nullopt;
}

/// Two gaps of one tool, the second right behind the first.
store::Gap joined(const store::Gap& first, const store::Gap& second) {
  return {
      .tool = first.tool,
      .after = first.after,
      .before = second.before,
      .missed = sum(first.missed, second.missed),
      .at_least = first.at_least || second.at_least,
      .began = first.began,
      .ended = second.ended,
      .reason = first.reason == second.reason ? first.reason : first.reason + "; " + second.reason};
}

/// The gap that an event becomes, with the one that it made known.
store::Gap gap_of(const store::NewEvent& lost) {
  const store::Event& event = lost.event;
  const store::Gap own = {.tool = event.tool,
                          .after = static_cast<std::uint16_t>(event.number - 1),
                          .before = static_cast<std::uint16_t>(event.number + 1),
                          .missed = 1,
                          .began = event.at,
                          .ended = event.at,
                          .reason = std::string(no_room)};
  return lost.gap ? joined(*lost.gap, own) : own;
}

}  // namespace

Journal::Journal(store::Writer& writer, JournalOptions options, Told told, Trouble trouble)
    : writer_(&writer),
      options_(options),
      told_(std::move(told)),
      trouble_(std::move(trouble)),
      thread_([this] { run(); }) {}

Journal::~Journal() { close(Duration::zero()); }

void Journal::add(store::Entry entry, Told told) {
  const std::lock_guard lock(mutex_);
  take({std::move(entry), std::move(told)});
  changed_.notify_one();
}

void Journal::add_lazily(store::Entry entry) {
  const std::lock_guard lock(mutex_);
  if (lazy_.size() < options_.capacity) lazy_.push_back({std::move(entry)});
}

void Journal::take(Item item) {
  auto* event = std::get_if<store::NewEvent>(&item.entry);
  // What is told of links and values leaves room for events, and a gap is told whatever there is.
  const bool is_gap = std::holds_alternative<store::NewGap>(item.entry);
  const bool is_curve = std::holds_alternative<store::NewCurve>(item.entry);
  const std::size_t room = event != nullptr ? options_.capacity
                           : is_curve       ? options_.capacity / curve_share
                                            : options_.capacity / 2;
  const bool has_room = is_gap || waiting_.size() < room;
  if (event != nullptr && !has_room) return lose(*event);
  if (!has_room) return;
  if (event != nullptr) find_lost_again(*event);
  waiting_.push_back(std::move(item));
}

/// An event that finds no room is part of a gap of its tool.
void Journal::lose(const store::NewEvent& event) {
  const auto found = lost_.find(event.event.tool);
  if (found == lost_.end()) {
    lost_.insert({event.event.tool, {gap_of(event), event.begins}});
    return;
  }
  found->second.gap = joined(found->second.gap, gap_of(event));
  if (event.begins) found->second.begins = event.begins;
}

/// The gap of what was lost stands before the next event of its tool.
void Journal::find_lost_again(store::NewEvent& event) {
  const auto found = lost_.find(event.event.tool);
  if (found == lost_.end()) return;
  Lost lost = std::move(found->second);
  lost_.erase(found);
  lost.gap.before = event.event.number;
  event.gap = event.gap ? joined(lost.gap, *event.gap) : std::move(lost.gap);
  if (!event.begins) event.begins = lost.begins;
}

/// What was lost is known, although no event of its tool came since.
void Journal::flush_lost() {
  for (auto entry = lost_.begin(); entry != lost_.end();) {
    Lost& lost = entry->second;
    // The event behind the gap says in which epoch it is.
    if (lost.begins && !closing_) {
      ++entry;
      continue;
    }
    waiting_.push_back({store::NewGap{std::move(lost.gap)}});
    entry = lost_.erase(entry);
  }
}

std::size_t Journal::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

bool Journal::waits_for(store::RowId tool) const {
  const std::lock_guard lock(mutex_);
  return lost_.contains(tool) ||
         std::any_of(waiting_.begin(), waiting_.end(), [&](const Item& item) {
           const auto* event = std::get_if<store::NewEvent>(&item.entry);
           const auto* gap = std::get_if<store::NewGap>(&item.entry);
           return (event != nullptr && event->event.tool == tool) ||
                  (gap != nullptr && gap->gap.tool == tool);
         });
}

std::size_t Journal::close(Duration patience) {
  std::unique_lock lock(mutex_);
  closing_ = true;
  changed_.notify_one();
  ended_.wait_for(lock, patience, [&] { return is_done_; });
  given_up_ = true;
  changed_.notify_one();
  lock.unlock();
  if (thread_.joinable()) thread_.join();
  return waiting_.size() + lost_.size();
}

void Journal::run() {
  std::unique_lock lock(mutex_);
  const auto has_work = [&] { return !waiting_.empty() || closing_; };
  const auto has_enough = [&] { return waiting_.size() >= options_.most || closing_; };
  while (!given_up_) {
    changed_.wait_for(lock, std::min(lazy_every, options_.alive_every), has_work);
    if (waiting_.empty() && closing_) flush_lost();
    if (waiting_.empty() && lazy_.empty() && closing_) break;
    changed_.wait_for(lock, std::min(options_.gather, options_.alive_every), has_enough);
    std::move(lazy_.begin(), lazy_.end(), std::back_inserter(waiting_));
    lazy_.clear();
    const bool works = waiting_.empty() || given_up_ || commit(lock);
    if (works) {
      tell_alive(lock);
      continue;
    }
    changed_.wait_for(lock, retry_, [&] { return given_up_; });
  }
  is_done_ = true;
  ended_.notify_all();
}

void Journal::tell_alive(std::unique_lock<std::mutex>& lock) {
  if (!options_.alive || failure_) return;
  lock.unlock();
  options_.alive();
  lock.lock();
}

/// Stores the first of what waits. It stays in its place until it is durable.
bool Journal::commit(std::unique_lock<std::mutex>& lock) {
  const std::size_t count = one_by_one_ ? 1 : std::min(waiting_.size(), options_.most);
  std::vector<store::Entry> batch;
  batch.reserve(count);
  for (std::size_t index = 0; index < count; ++index) batch.push_back(waiting_[index].entry);
  lock.unlock();
  const auto stored = writer_->commit(batch);
  lock.lock();
  if (!stored && !note_failure(stored.error())) {
    tell_trouble(lock, stored.error());
    return false;
  }
  std::vector<Item> done;
  for (std::size_t index = 0; index < count; ++index) {
    done.push_back(std::move(waiting_.front()));
    waiting_.pop_front();
  }
  // What no store takes is missing: a gap says so, in front of the next event of its tool.
  const auto* lost = stored ? nullptr : std::get_if<store::NewEvent>(&done.front().entry);
  if (lost != nullptr) lose(*lost);
  const bool recovered = stored && std::exchange(failure_, std::nullopt);
  one_by_one_ = one_by_one_ && waiting_.size() > 0;
  retry_ = {};
  if (waiting_.empty()) flush_lost();
  lock.unlock();
  if (!stored) {
    Error left_out = stored.error();
    left_out.hint = "this one record is left out";
    trouble_(left_out);
  }
  if (recovered) trouble_(std::nullopt);
  for (std::size_t index = 0; stored && index < count; ++index) {
    const Told& told = done[index].told ? done[index].told : told_;
    told(done[index].entry, (*stored)[index]);
  }
  lock.lock();
  return true;
}

/// Whether what failed is given up: it is one entry, and no store would take it.
bool Journal::note_failure(const Error& error) {
  const ExitStatus status = error.status();
  const bool may_pass = status == ExitStatus::storage || status == ExitStatus::bad_file;
  if (!may_pass && one_by_one_) return true;
  one_by_one_ = one_by_one_ || !may_pass;
  retry_ = std::clamp(retry_ * 2, options_.first_retry, options_.last_retry);
  return false;
}

/// Once for each reason.
void Journal::tell_trouble(std::unique_lock<std::mutex>& lock, const std::optional<Error>& error) {
  const bool is_new = !failure_ || failure_->message != error->message;
  failure_ = error;
  if (!is_new) return;
  lock.unlock();
  trouble_(error);
  lock.lock();
}

}  // namespace spindle::work
