#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/store/writer.hpp"

namespace spindle::work {

/// How a journal stores.
struct JournalOptions {
  Duration gather = std::chrono::milliseconds(20);  ///< how long entries wait for others
  std::size_t most = 500;                           ///< entries of one transaction
  std::size_t capacity = 100'000;                   ///< entries that may wait
  Duration first_retry = std::chrono::milliseconds(100);
  Duration last_retry = std::chrono::seconds(5);
  /// Called by the journal's thread behind every commit, and about so often while nothing waits, as
  /// long as storing works. May be empty.
  std::function<void()> alive = {};
  Duration alive_every = std::chrono::seconds(10);
};

/// What waits to be stored, and the thread that stores it: all that waits in one transaction.
/// Never makes who adds wait. While the store cannot be written, entries wait in memory and the
/// transaction is tried again; where there is no room any more, an event becomes part of a gap,
/// which is stored in its place. Several threads may add.
class Journal {
 public:
  /// What became of an entry; called by the journal's thread, behind the commit, in order. An event
  /// may have got the gap of those that found no room.
  using Told = std::function<void(const store::Entry& entry, const store::Stored& stored)>;
  /// Called by the journal's thread when storing begins to fail, for another reason than before,
  /// and with no error when it works again.
  using Trouble = std::function<void(const std::optional<Error>& error)>;

  /// `told` is called of gaps that the journal itself made. `writer` must outlive it.
  Journal(store::Writer& writer, JournalOptions options, Told told, Trouble trouble);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  void add(store::Entry entry, Told told = {});
  /// The same of what need not be stored at once: it goes with what comes next.
  void add_lazily(store::Entry entry);

  /// Stores what waits, for at most so long, and ends the thread. Returns how many entries were
  /// left. Nothing is added behind it.
  std::size_t close(Duration patience);

  /// How many entries wait.
  [[nodiscard]] std::size_t waiting() const;
  /// Whether events or gaps of this tool wait, so that the store does not know its last one yet.
  [[nodiscard]] bool waits_for(store::RowId tool) const;

 private:
  struct Item {
    store::Entry entry;
    Told told = {};
  };
  /// Events of one tool that found no room.
  struct Lost {
    store::Gap gap = {};
    std::optional<store::EpochReason> begins = std::nullopt;
  };

  void take(Item item);
  void lose(const store::NewEvent& event);
  void find_lost_again(store::NewEvent& event);
  void flush_lost();
  void run();
  void tell_alive(std::unique_lock<std::mutex>& lock);
  bool commit(std::unique_lock<std::mutex>& lock);
  bool note_failure(const Error& error);
  void tell_trouble(std::unique_lock<std::mutex>& lock, const std::optional<Error>& error);

  store::Writer* writer_;
  JournalOptions options_;
  Told told_;
  Trouble trouble_;
  mutable std::mutex mutex_ = {};
  std::condition_variable changed_ = {};
  std::condition_variable ended_ = {};
  std::deque<Item> waiting_ = {};
  std::deque<Item> lazy_ = {};
  std::map<store::RowId, Lost> lost_ = {};
  std::optional<Error> failure_ = std::nullopt;
  Duration retry_ = {};
  bool one_by_one_ = false;  ///< one of the first that wait cannot be stored
  bool closing_ = false;
  bool given_up_ = false;
  bool is_done_ = false;
  std::thread thread_ = {};
};

}  // namespace spindle::work
