#include "posix/owner_transport.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "posix/descriptor.hpp"
#include "posix/reading.hpp"
#include "posix/runtime_folder.hpp"
#include "posix/wait.hpp"
#include "spindle/link/owner_notes.hpp"
#include "spindle/modbus/adu.hpp"

namespace spindle::posix {
namespace {

// The owner says hello at once, or it is stopped or hangs.
constexpr Duration patience = std::chrono::seconds(1);
constexpr Duration patience_of_stop = std::chrono::milliseconds(300);

// Beyond the time for the answer: how long the turns of others may take.
constexpr Duration longest_turns = std::chrono::seconds(30);
constexpr Duration longest_turns_of_stop = std::chrono::milliseconds(500);

/// How often it is looked whether the owner still runs.
constexpr Duration look_interval = std::chrono::milliseconds(200);

// A link that is being opened anew is hardly worth an error.
constexpr Duration retry_pause = std::chrono::milliseconds(100);
constexpr int most_retries = 3;

struct Owner {
  Descriptor socket;
  pid_t process = 0;
  bool serial = false;
};

/// Whether a signal stopped the process, such as Ctrl-Z.
bool is_stopped(pid_t process) {
  const std::string status = text_of(fmt::format("/proc/{}/stat", process));
  const std::size_t name_end = status.rfind(')');
  if (name_end == std::string::npos || name_end + 2 >= status.size()) return false;
  const char state = status[name_end + 2];
  return state == 'T' || state == 't';
}

class OwnerTransport final : public link::Transport {
 public:
  OwnerTransport(Owner owner, link::Claim claim, const Clock& clock, const Interrupt& interrupt)
      : owner_(std::move(owner)), clock_(&clock), wait_(clock, interrupt) {
    haste_.urgent = claim == link::Claim::beside;
  }

  Result<void> send(ByteView bytes, TimePoint deadline) override;
  Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) override;
  void set_uninterruptible() override {
    wait_.set_uninterruptible();
    haste_.urgent = true;
  }
  void set_interruptible() override { wait_.set_interruptible(); }
  void set_urgent() override { haste_.urgent = true; }
  void wake() override { wait_.wake(); }
  void introduce(const link::SessionOptions& options) override;
  void skip_verification() override { haste_.unverified = true; }
  [[nodiscard]] bool asks_owner() const override { return true; }

 private:
  /// A request whose answer has not come.
  struct Pending {
    modbus::TransactionId transaction;
    TimePoint until;
  };

  Result<void> put(ByteView packet, TimePoint deadline) const;
  Result<void> say_haste(Duration answer_timeout, TimePoint deadline);
  Result<bool> take_packet(TimePoint until);
  Result<void> await_sent();
  Result<void> check_owner() const;
  [[nodiscard]] Error ended() const;

  Owner owner_;
  const Clock* clock_;
  LineWait wait_;
  link::Haste haste_ = {};
  std::optional<link::Haste> told_ = std::nullopt;
  std::optional<Pending> pending_ = std::nullopt;
  Bytes held_ = {};  ///< frames that were received and not handed over
};

Error OwnerTransport::ended() const {
  return {
      .code = Errc::closed,
      .message = fmt::format("the spindle that has the line ended (process {})", owner_.process),
      .hint = "try again: then the line is free"};
}

Result<void> OwnerTransport::check_owner() const {
  if (!is_stopped(owner_.process)) return {};
  return tl::unexpected(Error{
      .code = Errc::closed,
      .message =
          fmt::format("the spindle that has the line is stopped (process {})", owner_.process),
      .hint = fmt::format("'kill -CONT {}' lets it go on", owner_.process)});
}

Result<void> OwnerTransport::put(ByteView packet, TimePoint deadline) const {
  while (true) {
    TRY(wait_.check());
    if (::send(owner_.socket.number(), packet.data(), packet.size(), MSG_NOSIGNAL) >= 0) return {};
    if (errno == EINTR) continue;
    if (errno != EAGAIN) return tl::unexpected(ended());
    TRY_LET(const bool ready, wait_.until_ready({owner_.socket.number(), POLLOUT}, deadline));
    if (ready) continue;
    TRY(check_owner());
    return tl::unexpected(
        Error{.code = Errc::no_answer,
              .message = fmt::format("the spindle that has the line takes no request (process {})",
                                     owner_.process)});
  }
}

Result<void> OwnerTransport::say_haste(Duration answer_timeout, TimePoint deadline) {
  haste_.answer_timeout = answer_timeout;
  const bool is_told = told_ && told_->answer_timeout == answer_timeout &&
                       told_->urgent == haste_.urgent && told_->unverified == haste_.unverified;
  if (is_told) return {};
  return put(link::encode(haste_), deadline).map([&] { told_ = haste_; });
}

void OwnerTransport::introduce(const link::SessionOptions& options) {
  // What is wrong shows when the first request is sent.
  static_cast<void>(put(link::encode(link::Manner{options}), clock_->now() + patience));
}

Result<void> OwnerTransport::send(ByteView bytes, TimePoint deadline) {
  // Whole milliseconds: what a session asks for is one, and the clock went on since.
  const auto whole = std::chrono::round<std::chrono::milliseconds>(deadline - clock_->now());
  TRY(say_haste(std::max<Duration>(whole, std::chrono::milliseconds(1)), deadline));
  const auto request = link::one_frame(bytes);
  TRY(put(bytes, deadline));
  if (!request) return {};
  const Duration turns = haste_.urgent ? longest_turns_of_stop : longest_turns;
  pending_ = Pending{.transaction = request->transaction, .until = deadline + turns};
  const bool is_to_all = owner_.serial && request->unit == modbus::UnitId{};
  return is_to_all ? await_sent() : Result<void>();
}

/// No unit answers what is sent to all, but the owner says when it was sent.
Result<void> OwnerTransport::await_sent() {
  while (pending_) {
    if (clock_->now() >= pending_->until) {
      return tl::unexpected(Error{.code = Errc::no_answer,
                                  .message = "the spindle that has the line did not send it"});
    }
    TRY(take_packet(std::min(pending_->until, clock_->now() + look_interval)));
    if (pending_) {
      TRY(check_owner());
    }
  }
  return {};
}

/// Takes one packet; false when none came in time. Error: what became of the request.
Result<bool> OwnerTransport::take_packet(TimePoint until) {
  std::array<std::uint8_t, link::max_owner_packet> packet;  // NOLINT: filled by recv()
  ssize_t size = -1;
  while (true) {
    TRY(wait_.check());
    size = ::recv(owner_.socket.number(), packet.data(), packet.size(), 0);
    if (size >= 0) break;
    if (errno == EINTR) continue;
    if (errno != EAGAIN) return tl::unexpected(ended());
    TRY_LET(const bool ready, wait_.until_ready({owner_.socket.number(), POLLIN}, until));
    if (!ready) return false;
  }
  if (size == 0) return tl::unexpected(ended());
  const ByteView bytes = ByteView(packet).first(static_cast<std::size_t>(size));
  if (const auto note = link::decode_owner_note(bytes)) {
    const auto* unanswered = std::get_if<link::Unanswered>(&*note);
    const bool is_ours =
        unanswered != nullptr && pending_ && pending_->transaction == unanswered->request;
    if (!is_ours) return true;
    pending_.reset();
    if (unanswered->error) return tl::unexpected(*unanswered->error);
    return true;
  }
  if (const auto frame = link::one_frame(bytes)) {
    if (pending_ && frame->transaction == pending_->transaction) pending_.reset();
    held_.insert(held_.end(), bytes.begin(), bytes.end());
  }
  return true;
}

/// A request that waits for its turn is none that got no answer, so the owner says when its time is
/// over.
Result<std::size_t> OwnerTransport::receive(std::span<std::uint8_t> into, TimePoint deadline) {
  while (held_.empty()) {
    const TimePoint now = clock_->now();
    const bool is_late = pending_ && now >= deadline;
    if (is_late && now >= pending_->until) {
      pending_.reset();
      return tl::unexpected(
          Error{.code = Errc::closed,
                .message = fmt::format("the spindle that has the line does not answer (process {})",
                                       owner_.process),
                .hint = "end it, or wait until others ask less"});
    }
    if (is_late) {
      TRY(check_owner());
    }
    const TimePoint until = is_late ? std::min(pending_->until, now + look_interval) : deadline;
    TRY_LET(const bool taken, take_packet(until));
    if (!taken && !pending_) return std::size_t{0};
    if (!taken && clock_->now() < until) return std::size_t{0};  // woken
  }
  const std::size_t count = std::min(into.size(), held_.size());
  const auto end = held_.begin() + static_cast<std::ptrdiff_t>(count);
  std::copy(held_.begin(), end, into.begin());
  held_.erase(held_.begin(), end);
  return count;
}

// ---- finding it ----

/// The program at the other end of a socket in this folder, where it can be believed.
std::optional<Owner> connect_in(const OwnerFolder& folder, const std::string& name) {
  const auto path = socket_path(folder.path, name);
  if (!path) return std::nullopt;
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  std::copy(path->begin(), path->end(), address.sun_path);
  Descriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const auto* const to = reinterpret_cast<const sockaddr*>(&address);
  if (!socket.valid() || ::connect(socket.number(), to, sizeof address) != 0) return std::nullopt;
  ucred peer = {};
  socklen_t size = sizeof peer;
  if (::getsockopt(socket.number(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    return std::nullopt;
  }
  if (peer.uid != folder.owner && peer.uid != 0) return std::nullopt;
  // What leaves a tool safe opens lines of its own.
  if (peer.pid == ::getpid()) return std::nullopt;
  return Owner{.socket = std::move(socket), .process = peer.pid};
}

std::optional<Owner> find_owner(const std::string& name) {
  for (const OwnerFolder& folder : owner_folders()) {
    if (auto owner = connect_in(folder, name)) return owner;
  }
  return std::nullopt;
}

/// What the owner says to a hello; empty where it does not answer.
Result<std::optional<link::Welcome>> greet(const Owner& owner, link::Claim claim,
                                           const Clock& clock, const Interrupt& interrupt) {
  const bool is_stop = claim == link::Claim::beside;
  const Bytes hello = link::encode(link::Hello{.urgent = is_stop});
  const int socket = owner.socket.number();
  if (::send(socket, hello.data(), hello.size(), MSG_NOSIGNAL) < 0) return std::nullopt;
  const LineWait wait(clock, interrupt);
  const TimePoint limit = clock.now() + (is_stop ? patience_of_stop : patience);
  while (clock.now() < limit) {
    if (is_stopped(owner.process)) return std::nullopt;
    TRY_LET(const bool ready,
            wait.until_ready({socket, POLLIN}, std::min(limit, clock.now() + look_interval)));
    if (!ready) continue;
    std::array<std::uint8_t, link::max_owner_packet> packet;  // NOLINT: filled by recv()
    const ssize_t size = ::recv(socket, packet.data(), packet.size(), 0);
    if (size <= 0) return std::nullopt;
    const auto note =
        link::decode_owner_note(ByteView(packet).first(static_cast<std::size_t>(size)));
    const auto* welcome = note ? std::get_if<link::Welcome>(&*note) : nullptr;
    return welcome == nullptr ? std::nullopt : std::optional(*welcome);
  }
  return std::nullopt;
}

Error without_link(const link::Welcome& welcome, pid_t process) {
  Error error = *welcome.trouble;
  error.message =
      fmt::format("the spindle that has the line has no link to the tool (process {}): {}", process,
                  message_of(*welcome.trouble));
  return error;
}

}  // namespace

std::optional<Result<std::unique_ptr<link::Transport>>> ask_owner(const std::string& name,
                                                                  link::Claim claim, Clock& clock,
                                                                  const Interrupt& interrupt) {
  for (int retries = 0;; ++retries) {
    auto owner = find_owner(name);
    if (!owner) return std::nullopt;
    const auto welcome = greet(*owner, claim, clock, interrupt);
    if (!welcome) return tl::unexpected(welcome.error());
    if (!*welcome) return std::nullopt;
    if (!(*welcome)->trouble) {
      owner->serial = (*welcome)->serial;
      return std::make_unique<OwnerTransport>(std::move(*owner), claim, clock, interrupt);
    }
    if (claim == link::Claim::beside) return std::nullopt;
    if (retries == most_retries) return tl::unexpected(without_link(**welcome, owner->process));
    const auto slept = clock.sleep_until(clock.now() + retry_pause);
    if (!slept) return tl::unexpected(slept.error());
  }
}

}  // namespace spindle::posix
