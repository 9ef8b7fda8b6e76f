#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "spindle/base/interrupt.hpp"
#include "spindle/report/streams.hpp"

namespace spindle::commands {

/// As long as it lives, what is written to standard output waits in a queue for a thread of its
/// own, so that a reader who takes nothing holds up no watch of a tool. Order stays, and each
/// piece is written as soon as those before it are. Where the streams have no `out_for`, everything
/// is written at once, as ever.
///
/// What is written to standard error waits for the queue first, though for no reader who takes
/// nothing. The streams must outlive it. Several threads may write.
class PatientOut {
 public:
  /// How many pieces may wait. write() takes more than that, so that last words always find room:
  /// who tells much asks is_full() first.
  static constexpr std::size_t usual_capacity = 4096;

  PatientOut(report::Streams& streams, const Interrupt& interrupt,
             std::size_t capacity = usual_capacity);
  ~PatientOut();
  PatientOut(const PatientOut&) = delete;
  PatientOut& operator=(const PatientOut&) = delete;

  /// From when the queue is full until a quarter of it is free again.
  [[nodiscard]] bool is_full();

  /// Waits until all is written, or no reader seems to take it.
  void flush();

  /// Waits until all is written, for as long as that takes; after a signal only as long as a reader
  /// takes it. Returns how many pieces are left. Fails as `Streams::out` does.
  Result<std::size_t> drain();

 private:
  Result<void> push(std::string_view text);
  void write_on();
  [[nodiscard]] bool is_idle() const { return waiting_.empty() || failure_; }

  report::Streams* streams_;
  const Interrupt* interrupt_;
  std::size_t capacity_;
  std::function<Result<void>(std::string_view)> out_ = {};
  std::function<void(std::string_view)> err_ = {};
  std::mutex mutex_ = {};
  std::condition_variable pushed_ = {};
  std::condition_variable written_ = {};
  std::deque<std::string> waiting_ = {};  ///< the first one until it is written whole
  std::optional<Error> failure_ = std::nullopt;
  unsigned stalls_ = 0;  ///< how often in a row the reader took nothing
  bool full_ = false;
  bool ending_ = false;
  std::thread writer_ = {};
};

}  // namespace spindle::commands
