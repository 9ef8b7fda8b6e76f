#include "roster.hpp"

#include <algorithm>
#include <utility>

namespace spindle::commands {
namespace {

/// Whether two tools may be one tool, or can only be connected one after the other.
bool conflict(const Target& one, const Target& other) {
  if (one.shown == other.shown) return true;
  const link::Endpoint& a = one.endpoint;
  const link::Endpoint& b = other.endpoint;
  if (a.text == b.text) return true;
  const std::string line = shared_connection(a);
  if (!line.empty() && line == shared_connection(b)) return true;
  return !a.host.empty() && a.host == b.host && a.port == b.port;
}

}  // namespace

Roster::~Roster() {
  want({});
  join();
}

Roster::Change Roster::want(std::vector<WatchedTool> tools) {
  const std::lock_guard lock(mutex_);
  Change change;
  std::vector<WatchedTool> before = std::exchange(wanted_, std::move(tools));
  const auto find = [](const std::vector<WatchedTool>& all, const std::string& name) {
    return std::find_if(all.begin(), all.end(),
                        [&](const WatchedTool& tool) { return tool.target().shown == name; });
  };
  for (const WatchedTool& old : before) {
    const auto still = find(wanted_, old.target().shown);
    if (still == wanted_.end()) {
      ++change.left;
      leave(old.target().shown);
    } else if (still->target() == old.target()) {
      ++change.kept;
    } else {
      ++change.changed;
      leave(old.target().shown);
    }
  }
  change.begun = wanted_.size() - change.kept - change.changed;
  // What ended by itself may go now that what was wrong was mended.
  for (const auto& seat : seats_) {
    if (seat->is_done) seat->task.leaving_.store(true);
  }
  follow();
  return change;
}

void Roster::allow(std::optional<std::set<std::string>> names) {
  const std::lock_guard lock(mutex_);
  allowed_ = std::move(names);
  for (const WatchedTool& tool : wanted_) {
    if (!may_watch(tool.target().shown)) leave(tool.target().shown);
  }
  follow();
}

Roster::Standing Roster::standing() {
  const std::lock_guard lock(mutex_);
  Standing standing = {.wanted = wanted_.size()};
  for (const WatchedTool& tool : wanted_) {
    if (!may_watch(tool.target().shown)) ++standing.paused;
  }
  for (const auto& seat : seats_) {
    if (seat->is_done || seat->task.is_leaving()) continue;
    ++standing.watched;
    if (!seat->task.tried_.load()) ++standing.untried;
  }
  return standing;
}

bool Roster::is_idle() {
  const std::lock_guard lock(mutex_);
  sweep();
  return std::all_of(seats_.begin(), seats_.end(), [](const auto& seat) { return seat->is_done; });
}

void Roster::join() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] {
    return std::all_of(seats_.begin(), seats_.end(),
                       [](const auto& seat) { return seat->is_done; });
  });
  for (const auto& seat : seats_) seat->task.leaving_.store(true);
  sweep();
}

bool Roster::may_watch(const std::string& name) const {
  return !allowed_ || allowed_->contains(name);
}

/// The one that has not to leave.
Roster::Seat* Roster::seat_of(const std::string& name) const {
  const auto found = std::find_if(seats_.begin(), seats_.end(), [&](const auto& seat) {
    return seat->entry.shown == name && !seat->task.is_leaving();
  });
  return found == seats_.end() ? nullptr : found->get();
}

bool Roster::leave(const std::string& name) {
  Seat* const seat = seat_of(name);
  if (seat == nullptr) return false;
  seat->task.leaving_.store(true);
  changed_.notify_all();
  return true;
}

/// Begins what is wanted, allowed and not there.
void Roster::follow() {
  sweep();
  for (const WatchedTool& tool : wanted_) {
    const std::string& name = tool.target().shown;
    if (may_watch(name) && seat_of(name) == nullptr) begin(tool);
  }
}

void Roster::begin(const WatchedTool& tool) {
  Seat& seat = *seats_.emplace_back(std::make_unique<Seat>(tool));
  seat.thread = std::thread([this, &seat] { run(seat); });
}

void Roster::run(Seat& seat) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return seat.task.is_leaving() || !has_to_wait(seat); });
  if (!seat.task.is_leaving()) {
    lock.unlock();
    watch_(seat.tool, seat.task);
    lock.lock();
  }
  seat.is_done = true;
  changed_.notify_all();
}

/// Only those that began before it, so that no two wait for each other.
bool Roster::has_to_wait(const Seat& seat) const {
  for (const auto& other : seats_) {
    if (other.get() == &seat) return false;
    const bool leaves = other->task.is_leaving() && !other->is_done;
    if (leaves && conflict(other->entry, seat.entry)) return true;
  }
  return false;
}

/// Takes away those that have left.
void Roster::sweep() {
  const auto gone = std::stable_partition(seats_.begin(), seats_.end(), [](const auto& seat) {
    return !(seat->is_done && seat->task.is_leaving());
  });
  // Their threads say nothing behind that they are done.
  std::for_each(gone, seats_.end(), [](const auto& seat) { seat->thread.join(); });
  seats_.erase(gone, seats_.end());
}

}  // namespace spindle::commands
