#include "spindle/link/shared_line.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "spindle/modbus/adu.hpp"

namespace spindle::link {
namespace {

/// How long a stop waits for the answer that another session waits for.
constexpr Duration longest_courtesy = std::chrono::milliseconds(100);

/// A session that takes nothing must not cost memory without end.
constexpr std::size_t most_kept = std::size_t{1} << 20U;

/// Whether the line itself is gone; a wait that ended is nothing to it.
bool ends_line(const Error& error) {
  return error.code != Errc::no_answer && error.code != Errc::interrupted &&
         error.code != Errc::terminated;
}

Error gave_way() {
  return {.code = Errc::no_answer,
          .message = "the answer was not waited for, because a stop went first",
          .hint = "try again"};
}

Error out_of_step(const std::string& reason) {
  return {.code = Errc::malformed_answer, .message = "what came is not Modbus TCP: " + reason};
}

}  // namespace

// ---- whose turn it is ----

void FairLock::lock(Lane lane, const std::function<void()>& call) {
  Waiter waiter;
  {
    const std::lock_guard guard(mutex_);
    if (!std::exchange(held_, true)) return;
    (lane == Lane::stop ? stops_ : usual_).push_back(&waiter);
  }
  if (call) call();
  std::unique_lock guard(mutex_);
  waiter.called.wait(guard, [&] { return waiter.has_turn; });
}

bool FairLock::try_lock() {
  const std::lock_guard guard(mutex_);
  return !std::exchange(held_, true);
}

void FairLock::unlock() {
  const std::lock_guard guard(mutex_);
  std::deque<Waiter*>& next = stops_.empty() ? usual_ : stops_;
  if (next.empty()) {
    held_ = false;
    return;
  }
  Waiter* const waiter = next.front();
  next.pop_front();
  waiter->has_turn = true;
  waiter->called.notify_one();  // the lock is held, so the waiter is still there
}

bool FairLock::is_wanted(Lane lane) const {
  const std::lock_guard guard(mutex_);
  return !waiting(lane).empty();
}

// ---- a share ----

class SharedLine::Share : public Transport {
 public:
  /// Called with the line's mutex locked.
  Share(SharedLine& line, Of of) : line_(&line), of_(of), opened_(line.opened_) {
    if (of_ == Of::others) return;
    ++line_->shares_;
    line_->hearing_.push_back(this);
  }
  Share(const Share&) = delete;
  Share& operator=(const Share&) = delete;
  ~Share() override;

  BusLease acquire_bus() override;
  void release_bus(const BusLease& left) override;
  void pass_on(ByteView frame) override { line_->deliver(frame, this); }
  void set_urgent() override;

  [[nodiscard]] std::string company() const override {
    const std::lock_guard lock(line_->mutex_);
    return line_->transport_ ? line_->transport_->company() : std::string();
  }
  [[nodiscard]] TimePoint late_until() const override {
    const std::lock_guard lock(line_->mutex_);
    if (!line_->transport_) return {};
    return std::max(line_->transport_->late_until(), line_->late_until_);
  }
  void leave_late(TimePoint until) override;
  [[nodiscard]] bool is_private() const override {
    const std::lock_guard lock(line_->mutex_);
    return line_->transport_ && line_->transport_->is_private();
  }
  [[nodiscard]] bool is_shared() const override { return true; }
  void introduce(const SessionOptions& options) override;
  void skip_verification() override {
    const std::lock_guard lock(line_->mutex_);
    if (line_->transport_) line_->transport_->skip_verification();
  }
  [[nodiscard]] bool asks_owner() const override {
    const std::lock_guard lock(line_->mutex_);
    return line_->transport_ && line_->transport_->asks_owner();
  }

  Result<void> send(ByteView bytes, TimePoint deadline) override {
    note_answering(false);
    return transport().and_then(
        [&](Transport* open) { return judged(open->send(bytes, deadline)); });
  }
  Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) override;
  void set_uninterruptible() override {
    shielded_ = true;
    set_urgent();
    if (!has_turn_) return;
    if (const auto open = transport()) (*open)->set_uninterruptible();
  }

 private:
  friend class SharedLine;

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

  void take_turn();
  void end_turn();
  Result<std::size_t> receive_in_turn(std::span<std::uint8_t> into, TimePoint deadline);
  [[nodiscard]] TimePoint end_of_courtesy(TimePoint deadline);
  bool begin_listening();
  void end_listening();
  Result<std::size_t> listen(std::span<std::uint8_t> into, TimePoint deadline);
  Result<std::size_t> listen_once(std::span<std::uint8_t> into, TimePoint deadline);
  Result<void> split(ByteView bytes);
  std::size_t take_heard(std::span<std::uint8_t> into);
  void keep(ByteView frame);
  [[nodiscard]] bool is_alone() const {
    const std::lock_guard lock(line_->mutex_);
    const bool is_serial = line_->framing_ == modbus::Framing::rtu || line_->manners_.empty();
    return is_serial && line_->shares_ == 1 && of_ == Of::this_program;
  }
  [[nodiscard]] bool hears_frames() const {
    const std::lock_guard lock(line_->mutex_);
    return of_ == Of::this_program && line_->framing_ == modbus::Framing::tcp;
  }

  SharedLine* line_;
  Of of_;
  std::size_t opened_;
  Lane lane_ = Lane::usual;
  bool shielded_ = false;
  bool has_turn_ = false;
  std::optional<TimePoint> courtesy_until_ = std::nullopt;  ///< in this turn, for a stop that waits
  std::deque<Bytes> heard_ = {};                            ///< guarded by the line's mutex
  std::size_t heard_bytes_ = 0;                             ///< likewise
};

SharedLine::Share::~Share() {
  if (of_ == Of::others) return;
  const std::lock_guard opening(line_->opening_);
  std::unique_lock lock(line_->mutex_);
  std::erase(line_->hearing_, this);
  const bool is_last = opened_ == line_->opened_ && --line_->shares_ == 0;
  if (is_last && !line_->stays_open()) {
    line_->close_opening(lock, {.code = Errc::closed, .message = "the connection was given up"});
  }
}

void SharedLine::Share::take_turn() {
  line_->turn_.lock(lane_, [this] { line_->call_holder(lane_); });
  has_turn_ = true;
}

void SharedLine::Share::end_turn() {
  has_turn_ = false;
  courtesy_until_.reset();
  line_->turn_.unlock();
}

Transport::BusLease SharedLine::Share::acquire_bus() {
  take_turn();
  BusLease left = {.used_until = line_->left_.used_until, .late_until = line_->left_.late_until};
  left.dialogues = std::move(line_->left_.dialogues);
  if (line_->left_by_ < opened_) {  // that of a connection that is over
    line_->left_.stream.reset();
    line_->rest_.clear();
  }
  const std::lock_guard lock(line_->mutex_);
  for (const Bytes& frame : std::exchange(heard_, {})) {
    left.heard.insert(left.heard.end(), frame.begin(), frame.end());
  }
  heard_bytes_ = 0;
  if (line_->left_by_ <= opened_) {
    const Bytes rest = std::exchange(line_->rest_, {});
    left.stream = std::exchange(line_->left_.stream, std::nullopt);
    if (!rest.empty() && left.stream) left.stream->torn = 0;
    Bytes& into = left.stream ? left.stream->rest : left.heard;
    into.insert(into.end(), rest.begin(), rest.end());
  }
  if (shielded_ && opened_ == line_->opened_ && line_->transport_) {
    line_->transport_->set_uninterruptible();
  }
  return left;
}

void SharedLine::Share::release_bus(const BusLease& left) {
  line_->left_.dialogues = left.dialogues;
  line_->left_.used_until = std::max(line_->left_.used_until, left.used_until);
  line_->left_.late_until = std::max(line_->left_.late_until, left.late_until);
  if (opened_ >= line_->left_by_) {
    line_->left_.stream = left.stream;
    line_->left_by_ = opened_;
  }
  if (left.stream && left.stream->out_of_step) end_with(*left.stream->out_of_step);
  if (shielded_) {
    if (const auto open = transport()) (*open)->set_interruptible();
  }
  end_turn();
}

void SharedLine::Share::set_urgent() {
  lane_ = Lane::stop;
  const std::lock_guard lock(line_->mutex_);
  if (line_->transport_) line_->transport_->set_urgent();
}

void SharedLine::Share::leave_late(TimePoint until) {
  const std::lock_guard lock(line_->mutex_);
  if (opened_ != line_->opened_ || !line_->transport_) return;
  line_->transport_->leave_late(until);
  if (line_->stays_ != Stays::while_shared) {
    line_->late_until_ = std::max(line_->late_until_, until);
  }
}

void SharedLine::Share::introduce(const SessionOptions& options) {
  std::function<void()> tell;
  {
    const std::lock_guard lock(line_->mutex_);
    if (of_ == Of::this_program) {
      // Without ids what comes late is told by the next one in its turn.
      const bool is_told_late =
          options.rules.framing == modbus::Framing::tcp && !has_ids(options.rules);
      line_->framing_ = is_told_late ? std::nullopt : std::optional(options.rules.framing);
      line_->manners_.insert_or_assign(options.unit, options);
      tell = std::exchange(line_->tell_introduced_, {});
    }
    if (line_->transport_) {
      if (line_->transport_->asks_owner()) line_->framing_ = modbus::Framing::tcp;
      line_->transport_->introduce(options);
    }
  }
  if (tell) tell();
}

Result<std::size_t> SharedLine::Share::receive(std::span<std::uint8_t> into, TimePoint deadline) {
  if (has_turn_) return receive_in_turn(into, deadline);
  if (hears_frames()) return listen(into, deadline);
  if (is_alone() && line_->turn_.try_lock()) {
    has_turn_ = true;
    {
      const std::lock_guard lock(line_->mutex_);
      line_->is_listened_to_ = true;
    }
    auto received = transport().and_then([&](Transport* open) {
      const bool is_wanted = line_->turn_.is_wanted();
      return judged(open->receive(into, is_wanted ? line_->clock_->now() : deadline));
    });
    {
      const std::lock_guard lock(line_->mutex_);
      line_->is_listened_to_ = false;
    }
    end_turn();
    return received;
  }
  // What comes now is for another session.
  return line_->clock_->sleep_until(deadline).map([] { return std::size_t{0}; });
}

/// A session that waits for its answer gives way to a stop, whose motor runs on meanwhile.
TimePoint SharedLine::Share::end_of_courtesy(TimePoint deadline) {
  if (lane_ == Lane::stop || !line_->turn_.is_wanted(Lane::stop)) return deadline;
  if (!courtesy_until_) courtesy_until_ = line_->clock_->now() + longest_courtesy;
  return std::min(deadline, *courtesy_until_);
}

Result<std::size_t> SharedLine::Share::receive_in_turn(std::span<std::uint8_t> into,
                                                       TimePoint deadline) {
  while (true) {
    TRY_LET(Transport * open, transport());
    const TimePoint until = end_of_courtesy(deadline);
    auto received = judged(open->receive(into, until));
    if (!received) return received;
    if (*received > 0) {
      note_answering(true);
      // The unit that speaks may finish: two at once would not be understood.
      if (courtesy_until_) courtesy_until_ = line_->clock_->now() + longest_courtesy;
      return received;
    }
    TRY(transport());  // it may have been closed meanwhile
    const TimePoint now = line_->clock_->now();
    if (now >= deadline) return std::size_t{0};
    if (courtesy_until_ && now >= *courtesy_until_) return tl::unexpected(gave_way());
  }
}

// ---- outside of the turns ----

std::size_t SharedLine::Share::take_heard(std::span<std::uint8_t> into) {
  const std::lock_guard lock(line_->mutex_);
  std::size_t size = 0;
  while (!heard_.empty() && size + heard_.front().size() <= into.size()) {
    const Bytes& frame = heard_.front();
    std::copy(frame.begin(), frame.end(), into.begin() + static_cast<std::ptrdiff_t>(size));
    size += frame.size();
    heard_bytes_ -= frame.size();
    heard_.pop_front();
  }
  return size;
}

/// Called with the line's mutex locked.
void SharedLine::Share::keep(ByteView frame) {
  heard_.emplace_back(frame.begin(), frame.end());
  heard_bytes_ += frame.size();
  while (heard_bytes_ > most_kept) {
    heard_bytes_ -= heard_.front().size();
    heard_.pop_front();
    ++line_->dropped_;
  }
}

bool SharedLine::Share::begin_listening() {
  const std::lock_guard lock(line_->mutex_);
  if (line_->listener_ != nullptr) return false;
  line_->listener_ = this;
  return true;
}

void SharedLine::Share::end_listening() {
  const std::lock_guard lock(line_->mutex_);
  line_->listener_ = nullptr;
}

/// Until a frame is there, or the deadline: in turns, so that no request waits for this one.
Result<std::size_t> SharedLine::Share::listen(std::span<std::uint8_t> into, TimePoint deadline) {
  while (true) {
    if (const std::size_t size = take_heard(into); size > 0) return size;
    TRY(transport());
    if (!begin_listening()) {
      TRY(line_->clock_->sleep_until(deadline));
      return take_heard(into);
    }
    auto received = listen_once(into, deadline);
    end_listening();
    if (!received || *received > 0 || line_->clock_->now() >= deadline) return received;
  }
}

Result<std::size_t> SharedLine::Share::listen_once(std::span<std::uint8_t> into,
                                                   TimePoint deadline) {
  // Who only looks at what is there waits for no answer of another one.
  if (line_->clock_->now() < deadline) {
    take_turn();
  } else if (line_->turn_.try_lock()) {
    has_turn_ = true;
  } else {
    return take_heard(into);
  }
  {
    const std::lock_guard lock(line_->mutex_);
    line_->is_listened_to_ = true;
  }
  std::array<std::uint8_t, 2 * modbus::max_adu_size> chunk;  // NOLINT: filled by receive()
  auto received = transport().and_then([&](Transport* open) -> Result<std::size_t> {
    // What was heard in the turn of another one comes first.
    if (const std::size_t size = take_heard(into); size > 0) return size;
    if (shielded_) open->set_uninterruptible();
    const bool is_wanted = line_->turn_.is_wanted();
    TRY_LET(const std::size_t count,
            judged(open->receive(chunk, is_wanted ? line_->clock_->now() : deadline)));
    if (shielded_) open->set_interruptible();
    if (count == 0) return count;
    TRY(judged(split(ByteView(chunk).first(count))));
    return take_heard(into);
  });
  {
    const std::lock_guard lock(line_->mutex_);
    line_->is_listened_to_ = false;
  }
  end_turn();
  return received;
}

/// Whole frames go to all who hear; the rest stays with the line.
Result<void> SharedLine::Share::split(ByteView bytes) {
  Bytes& rest = line_->rest_;
  auto& stream = line_->left_.stream;
  if (line_->left_by_ != opened_) {
    rest.clear();
    stream.reset();
    line_->left_by_ = opened_;
  }
  if (stream) {
    rest.insert(rest.begin(), stream->rest.begin(), stream->rest.end());
    stream->rest.clear();
    stream->torn = 0;
  }
  rest.insert(rest.end(), bytes.begin(), bytes.end());
  line_->left_.used_until = line_->clock_->now();
  while (!rest.empty()) {
    const auto found = modbus::deframe(modbus::Framing::tcp, modbus::Role::client, rest);
    if (const auto* junk = std::get_if<modbus::Junk>(&found)) {
      return tl::unexpected(out_of_step(junk->reason));
    }
    const auto* frame = std::get_if<modbus::Deframed>(&found);
    if (frame == nullptr) break;
    line_->deliver(ByteView(rest).first(frame->consumed), nullptr);
    rest.erase(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(frame->consumed));
  }
  return {};
}

// ---- the line ----

void SharedLine::deliver(ByteView frame, const Share* but_not) {
  const std::lock_guard lock(mutex_);
  for (Share* share : hearing_) {
    if (share != but_not && share->opened_ == opened_) share->keep(frame);
  }
  for (Ear* ear : ears_) ear->hear_(frame);
}

/// Wakes the share that listens outside of the turns, or that a stop waits for.
void SharedLine::call_holder(Lane lane) {
  const std::lock_guard lock(mutex_);
  if (transport_ && (is_listened_to_ || lane == Lane::stop)) transport_->wake();
}

Result<std::unique_ptr<Transport>> SharedLine::join(const Open& open) {
  const std::lock_guard opening(opening_);
  std::unique_lock lock(mutex_);
  if (transport_ == nullptr) {
    lock.unlock();  // others are told meanwhile that it is not open
    auto opened = open();
    lock.lock();
    if (!opened) {
      broken_ = opened.error();
      return opened;
    }
    transport_ = std::move(*opened);
    shares_ = 0;
    is_answering_ = true;
    late_until_ = {};
    manners_.clear();
    ++opened_;
  }
  return std::make_unique<Share>(*this, Of::this_program);
}

Result<std::unique_ptr<Transport>> SharedLine::join_open() {
  const std::lock_guard lock(mutex_);
  if (transport_ && !manners_.empty()) return std::make_unique<Share>(*this, Of::others);
  const Error not_yet = {.code = Errc::closed, .message = "not connected yet"};
  return tl::unexpected(transport_ ? not_yet : broken_.value_or(not_yet));
}

void SharedLine::when_introduced(std::function<void()> tell) {
  const std::lock_guard lock(mutex_);
  tell_introduced_ = std::move(tell);
}

std::size_t SharedLine::opening() const {
  const std::lock_guard lock(mutex_);
  return opened_;
}

std::optional<Error> SharedLine::trouble() const {
  const std::lock_guard lock(mutex_);
  if (transport_) return std::nullopt;
  return broken_.value_or(Error{.code = Errc::closed, .message = "not connected yet"});
}

std::optional<SessionOptions> SharedLine::manner_with(modbus::UnitId unit) const {
  const std::lock_guard lock(mutex_);
  if (manners_.empty()) return std::nullopt;
  const auto known = manners_.find(unit);
  return known == manners_.end() ? manners_.begin()->second : known->second;
}

std::uint64_t SharedLine::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

void SharedLine::close(const Error& why) {
  const std::lock_guard opening(opening_);
  std::unique_lock lock(mutex_);
  close_opening(lock, why);
}

void SharedLine::close_unused(const Error& why) {
  const std::lock_guard opening(opening_);
  std::unique_lock lock(mutex_);
  if (shares_ == 0) close_opening(lock, why);
}

/// Who is in a turn notices that the transport is gone, and lets go of it before it is destroyed.
void SharedLine::close_opening(std::unique_lock<std::mutex>& lock, const Error& why) {
  if (!transport_) return;
  const std::unique_ptr<Transport> ending = std::move(transport_);
  broken_ = why;
  ending->wake();
  lock.unlock();
  turn_.lock(Lane::stop);
  turn_.unlock();
}

std::unique_ptr<SharedLine::Ear> SharedLine::listen(std::function<void(ByteView frame)> hear) {
  return std::make_unique<Ear>(*this, std::move(hear));
}

SharedLine::Ear::Ear(SharedLine& line, std::function<void(ByteView frame)> hear)
    : line_(&line), hear_(std::move(hear)) {
  const std::lock_guard lock(line_->mutex_);
  line_->ears_.push_back(this);
}

SharedLine::Ear::~Ear() {
  const std::lock_guard lock(line_->mutex_);
  std::erase(line_->ears_, this);
}

}  // namespace spindle::link
