#include "spindle/link/shared_line.hpp"

#include <algorithm>
#include <utility>

namespace spindle::link {
namespace {

/// Whether the line itself is gone; a wait that ended is nothing to it.
bool ends_line(const Error& error) {
  return error.code != Errc::no_answer && error.code != Errc::interrupted &&
         error.code != Errc::terminated;
}

}  // namespace

class SharedLine::Share : public Transport {
 public:
  /// Called with the line's mutex locked.
  explicit Share(SharedLine& line) : line_(&line), opened_(line.opened_) { ++line_->shares_; }
  Share(const Share&) = delete;
  Share& operator=(const Share&) = delete;
  ~Share() override {
    const std::lock_guard lock(line_->mutex_);
    const bool is_last = opened_ == line_->opened_ && --line_->shares_ == 0;
    if (is_last && !line_->stays_open()) line_->transport_.reset();
  }

  BusLease acquire_bus() override {
    turn_ = std::unique_lock(line_->turn_);
    BusLease left = line_->left_;
    if (line_->left_by_ != opened_) left.stream.reset();  // that of a connection that is over
    return left;
  }
  void release_bus(const BusLease& left) override {
    line_->left_.used_until = std::max(line_->left_.used_until, left.used_until);
    line_->left_.late_until = std::max(line_->left_.late_until, left.late_until);
    if (opened_ >= line_->left_by_) {
      line_->left_.stream = left.stream;
      line_->left_by_ = opened_;
    }
    if (left.stream && left.stream->out_of_step) end_with(*left.stream->out_of_step);
    turn_.unlock();
  }

  [[nodiscard]] std::string company() const override {
    const std::lock_guard lock(line_->mutex_);
    return line_->transport_ ? line_->transport_->company() : std::string();
  }
  [[nodiscard]] TimePoint late_until() const override {
    const std::lock_guard lock(line_->mutex_);
    if (!line_->transport_) return {};
    return std::max(line_->transport_->late_until(), line_->late_until_);
  }
  void leave_late(TimePoint until) override {
    const std::lock_guard lock(line_->mutex_);
    if (opened_ != line_->opened_ || !line_->transport_) return;
    line_->transport_->leave_late(until);
    if (line_->stays_ != Stays::while_shared) {
      line_->late_until_ = std::max(line_->late_until_, until);
    }
  }
  [[nodiscard]] bool is_private() const override {
    const std::lock_guard lock(line_->mutex_);
    return line_->transport_ && line_->transport_->is_private();
  }
  [[nodiscard]] bool is_shared() const override { return true; }

  Result<void> send(ByteView bytes, TimePoint deadline) override {
    note_answering(false);
    return transport().and_then(
        [&](Transport* open) { return judged(open->send(bytes, deadline)); });
  }

  Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) override {
    if (!turn_.owns_lock()) {  // what comes now is for another session
      return line_->clock_->sleep_until(deadline).map([] { return std::size_t{0}; });
    }
    auto received = transport().and_then(
        [&](Transport* open) { return judged(open->receive(into, deadline)); });
    if (received && *received > 0) note_answering(true);
    return received;
  }

  void set_uninterruptible() override {}

 private:
  /// Stays as long as this share is in its turn: only then it can find out that the line is broken.
  Result<Transport*> transport() const {
    const std::lock_guard lock(line_->mutex_);
    if (opened_ == line_->opened_ && line_->transport_) return line_->transport_.get();
    return tl::unexpected(line_->broken_.value_or(Error{.code = Errc::closed}));
  }

  template <typename Value>
  Result<Value> judged(Result<Value> done) {
    if (!done && ends_line(done.error())) end_with(done.error());
    return done;
  }

  /// For all who share this opening.
  void end_with(const Error& error) {
    const std::lock_guard lock(line_->mutex_);
    if (opened_ != line_->opened_ || !line_->transport_) return;
    line_->broken_ = error;
    line_->transport_.reset();
  }

  void note_answering(bool is_answering) {
    const std::lock_guard lock(line_->mutex_);
    line_->is_answering_ = is_answering;
  }

  SharedLine* line_;
  std::size_t opened_;
  std::unique_lock<FairLock> turn_ = {};
};

Result<std::unique_ptr<Transport>> SharedLine::join(const Open& open) {
  const std::lock_guard lock(mutex_);
  if (transport_ == nullptr) {
    auto opened = open();
    if (!opened) return opened;
    transport_ = std::move(*opened);
    shares_ = 0;
    is_answering_ = true;
    late_until_ = {};
    ++opened_;
  }
  return std::make_unique<Share>(*this);
}

}  // namespace spindle::link
