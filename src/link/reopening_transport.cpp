#include "spindle/link/reopening_transport.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "spindle/modbus/types.hpp"

namespace spindle::link {
namespace {

// MBAP: transaction, protocol, and the length of what follows.
constexpr std::size_t head_size = 6;
constexpr std::size_t length_at = 4;
constexpr std::size_t function_at = 7;
constexpr std::size_t longest_rest = 254;
constexpr std::size_t chunk_size = 512;

/// A tool that never falls silent must not keep a request from being sent.
constexpr int most_looks = 100;

bool is_closed(const Error& error) {
  return error.code == Errc::closed || error.code == Errc::reset;
}

/// Whether sending it twice does no more than sending it once.
bool changes_nothing(ByteView request) {
  return request.size() > function_at && modbus::is_read(request[function_at]);
}

}  // namespace

ReopeningTransport::ReopeningTransport(std::unique_ptr<Transport> transport, Open open,
                                       const Clock& clock, Trace trace)
    : transport_(std::move(transport)),
      open_(std::move(open)),
      clock_(&clock),
      trace_(std::move(trace)) {}

/// What has arrived is looked at first: where that is the end of the connection, the request can
/// not have been sent on it.
Result<void> ReopeningTransport::send(ByteView bytes, TimePoint deadline) {
  asked_again_ = false;
  for (int looks = 0; looks < most_looks; ++looks) {
    auto taken = take(clock_->now());
    if (taken && *taken > 0) continue;
    if (taken) break;
    if (!is_closed(taken.error())) return tl::unexpected(std::move(taken.error()));
    TRY(reopen(std::move(taken.error())));
    break;
  }
  // Its end may be on the way.
  if (hangs_up_ && !brought_nothing_ && !changes_nothing(bytes)) {
    TRY(reopen({.code = Errc::closed}));
  }
  request_.assign(bytes.begin(), bytes.end());
  auto sent = transport_->send(bytes, deadline);
  if (sent || !is_closed(sent.error())) return sent;
  return ask_again(std::move(sent.error()), deadline);
}

Result<std::size_t> ReopeningTransport::receive(std::span<std::uint8_t> into, TimePoint deadline) {
  while (true) {
    if (const std::size_t size = whole(); size > 0) {
      note_answer(ByteView(held_).first(size));
      return hand_over(into, size);
    }
    auto taken = take(deadline);
    if (taken && *taken == 0) return hand_over(into, held_.size());
    if (taken) continue;
    // A look at what is there already waits for no answer, so there is nothing to ask for again.
    const bool is_awaited = clock_->now() < deadline;
    if (!is_closed(taken.error()) || !is_awaited) return taken;
    TRY(ask_again(std::move(taken.error()), deadline));
  }
}

void ReopeningTransport::set_uninterruptible() {
  shielded_ = true;
  if (transport_) transport_->set_uninterruptible();
}

void ReopeningTransport::set_interruptible() {
  shielded_ = false;
  if (transport_) transport_->set_interruptible();
}

void ReopeningTransport::introduce(const SessionOptions& options) {
  introduced_ = options;
  if (transport_) transport_->introduce(options);
}

Result<std::size_t> ReopeningTransport::take(TimePoint deadline) {
  if (!transport_) return tl::unexpected(Error{.code = Errc::closed});
  std::array<std::uint8_t, chunk_size> chunk = {};
  auto received = transport_->receive(chunk, deadline);
  if (!received || *received == 0) return received;
  brought_nothing_ = false;
  held_.insert(held_.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(*received));
  return received;
}

Result<void> ReopeningTransport::reopen(Error why) {
  if (brought_nothing_) return tl::unexpected(std::move(why));
  hangs_up_ = true;
  if (trace_.decision) {
    trace_.decision(Decision::retry, "the tool closed the connection, which is opened once more");
  }
  const bool asked_owner = asks_owner();
  transport_.reset();  // a server may have room for one connection only
  auto opened = open_();
  if (!opened) {
    const bool ended =
        opened.error().code == Errc::interrupted || opened.error().code == Errc::terminated;
    return tl::unexpected(ended ? std::move(opened.error()) : std::move(why));
  }
  // Behind an owner there were ids, and the session relies on them.
  const bool has_ids_always = !introduced_ || has_ids(introduced_->rules);
  if (asked_owner && !(*opened)->asks_owner() && !has_ids_always) {
    return tl::unexpected(std::move(why));
  }
  transport_ = std::move(*opened);
  if (introduced_) transport_->introduce(*introduced_);
  if (shielded_) transport_->set_uninterruptible();
  brought_nothing_ = true;
  held_.resize(whole());  // the rest of a frame in part went with its connection
  return {};
}

Result<void> ReopeningTransport::ask_again(Error why, TimePoint deadline) {
  const bool again = std::exchange(asked_again_, true);
  if (again || !changes_nothing(request_)) return tl::unexpected(std::move(why));
  return reopen(std::move(why)).and_then([&] { return transport_->send(request_, deadline); });
}

std::size_t ReopeningTransport::hand_over(std::span<std::uint8_t> into, std::size_t size) {
  const std::size_t count = std::min(size, into.size());
  const auto end = held_.begin() + static_cast<std::ptrdiff_t>(count);
  std::copy(held_.begin(), end, into.begin());
  held_.erase(held_.begin(), end);
  return count;
}

/// What was answered is not asked again when the connection ends behind it. Not every server
/// repeats the transaction's number, but the function it does.
void ReopeningTransport::note_answer(ByteView frames) {
  for (std::size_t at = 0; frames.size() - at > function_at && request_.size() > function_at;) {
    const auto function =
        static_cast<std::uint8_t>(frames[at + function_at] & ~modbus::exception_bit);
    if (function == request_[function_at]) request_.clear();
    at += head_size + get_u16(frames, at + length_at);
    if (at > frames.size()) return;
  }
}

/// How many bytes of what is held are whole frames; all where that cannot be told.
std::size_t ReopeningTransport::whole() const {
  std::size_t at = 0;
  while (held_.size() - at >= head_size) {
    const std::size_t rest = get_u16(held_, at + length_at);
    if (rest == 0 || rest > longest_rest) return held_.size();
    if (held_.size() - at < head_size + rest) break;
    at += head_size + rest;
  }
  return at;
}

}  // namespace spindle::link
