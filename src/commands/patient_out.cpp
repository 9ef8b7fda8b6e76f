#include "patient_out.hpp"

#include <string_view>
#include <utility>

namespace spindle::commands {
namespace {

/// How long the thread waits for a reader before it looks whether it is still wanted.
constexpr Duration patience = std::chrono::milliseconds(100);

/// After a signal: a reader who took nothing so often takes no more.
constexpr unsigned last_stalls = 3;

}  // namespace

PatientOut::PatientOut(report::Streams& streams, const Interrupt& interrupt, std::size_t capacity)
    : streams_(&streams), interrupt_(&interrupt), capacity_(capacity) {
  if (!streams.out_for) return;
  out_ = std::exchange(streams.out, [this](std::string_view text) { return push(text); });
  err_ = std::exchange(streams.err, [this](std::string_view text) {
    flush();
    err_(text);
  });
  writer_ = std::thread([this] { write_on(); });
}

PatientOut::~PatientOut() {
  if (!writer_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  pushed_.notify_all();
  writer_.join();
  streams_->out = std::move(out_);
  streams_->err = std::move(err_);
}

Result<void> PatientOut::push(std::string_view text) {
  {
    const std::lock_guard lock(mutex_);
    if (failure_) return tl::unexpected(*failure_);
    if (text.empty()) return {};
    waiting_.emplace_back(text);
    if (waiting_.size() >= capacity_) full_ = true;
  }
  pushed_.notify_all();
  return {};
}

bool PatientOut::is_full() {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() <= capacity_ - capacity_ / 4) full_ = false;
  return full_ && !failure_;
}

void PatientOut::flush() {
  std::unique_lock lock(mutex_);
  written_.wait(lock, [this] { return is_idle() || stalls_ > 0; });
}

Result<std::size_t> PatientOut::drain() {
  std::unique_lock lock(mutex_);
  while (!is_idle()) {
    if (interrupt_->signalled() && stalls_ >= last_stalls) break;
    written_.wait_for(lock, patience);
  }
  if (failure_) return tl::unexpected(*failure_);
  return waiting_.size();
}

void PatientOut::write_on() {
  std::size_t taken = 0;  // of the first piece
  std::unique_lock lock(mutex_);
  while (true) {
    pushed_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
    if (ending_) return;
    // Only this thread takes pieces away, and adding some moves none.
    const std::string_view rest = std::string_view(waiting_.front()).substr(taken);
    lock.unlock();
    auto written = streams_->out_for(rest, patience);
    lock.lock();
    if (!written) {
      failure_ = std::move(written.error());
      waiting_.clear();
      written_.notify_all();
      return;
    }
    stalls_ = *written == 0 ? stalls_ + 1 : 0;
    taken += *written;
    if (taken == waiting_.front().size()) {
      waiting_.pop_front();
      taken = 0;
    }
    written_.notify_all();
  }
}

}  // namespace spindle::commands
