#include "spindle/link/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace spindle::link {
namespace {

// Somebody who watches takes events at once; this bounds memory when nobody does.
constexpr std::size_t max_queued = 4096;
constexpr std::uint16_t first_transaction = 0x8000;

std::string describe_frame(const modbus::Adu& adu) {
  return fmt::format("id {:04X}, unit {}, function {:02X}, data {}", adu.transaction.value,
                     adu.unit.value, adu.pdu.function, to_hex(adu.pdu.data));
}

}  // namespace

struct Session::Outstanding {
  modbus::Adu request;
  TimePoint sent;
  TimePoint deadline;
  std::optional<modbus::Pdu> answer = std::nullopt;
  std::string broken = {};  ///< what came with our id and was no answer
};

Session::Session(std::unique_ptr<Transport> transport, Clock& clock, SessionOptions options,
                 Trace trace)
    : transport_(std::move(transport)),
      clock_(&clock),
      options_(std::move(options)),
      trace_(std::move(trace)) {}

Result<modbus::Pdu> Session::transact(const modbus::Pdu& request) {
  if (quarantined_) {
    if (auto left = leave_quarantine(); !left) return tl::unexpected(left.error());
  }
  return exchange(request);
}

Result<modbus::Pdu> Session::exchange(const modbus::Pdu& request) {
  Outstanding outstanding{
      .request = {.transaction = {next_transaction_}, .unit = options_.unit, .pdu = request},
      .sent = {},
      .deadline = {}};
  next_transaction_ = next_transaction_ == 0xFFFF
                          ? first_transaction
                          : static_cast<std::uint16_t>(next_transaction_ + 1);
  ++counters_.requests;
  auto answer = send(outstanding.request).and_then([&] {
    outstanding.sent = clock_->now();
    outstanding.deadline = std::max(outstanding.sent, last_activity_) + options_.answer_timeout;
    return await(outstanding);
  });
  if (answer) {
    last_round_trip_ = clock_->now() - outstanding.sent;
    return answer;
  }
  Error error = std::move(answer.error());
  if (error.tried.empty()) error.tried = modbus::describe_request(request);
  return tl::unexpected(std::move(error));
}

Result<void> Session::broadcast(const modbus::Pdu& request) {
  if (quarantined_) {
    if (auto left = leave_quarantine(); !left) return left;
  }
  ++counters_.requests;
  return send({.transaction = {}, .unit = {}, .pdu = request}).map([&] {
    last_activity_ += options_.broadcast_gap;
  });
}

Result<std::optional<Spontaneous>> Session::next_spontaneous(TimePoint deadline) {
  while (queue_.empty()) {
    auto frame = take_frame();
    if (!frame) return tl::unexpected(std::move(frame.error()));
    if (*frame) {
      sort(**frame, nullptr);
      continue;
    }
    auto more = fill(deadline);
    if (!more) return tl::unexpected(std::move(more.error()));
    if (!*more) return std::nullopt;
  }
  std::optional<Spontaneous> oldest = std::move(queue_.front());
  queue_.pop_front();
  return oldest;
}

Result<void> Session::send(const modbus::Adu& adu) {
  if (auto kept = keep_gap(); !kept) return kept;
  const Bytes bytes = modbus::frame(options_.rules.framing, adu);
  if (trace_.bytes) trace_.bytes(Direction::sent, bytes);
  decide(Decision::request, adu);
  auto sent = transport_->send(bytes, clock_->now() + options_.answer_timeout);
  // Where the port returns before the last bit has left, the time on the wire is the lower bound.
  last_activity_ =
      clock_->now() + options_.character_time * static_cast<Duration::rep>(bytes.size());
  return sent;
}

Result<modbus::Pdu> Session::await(Outstanding& outstanding) {
  while (true) {
    auto frame = take_frame();
    if (!frame) return tl::unexpected(std::move(frame.error()));
    if (*frame) {
      sort(**frame, &outstanding);
      if (outstanding.answer) return std::move(*outstanding.answer);
      // An endless stream of strays must not keep the caller beyond the deadline.
      if (clock_->now() < outstanding.deadline) continue;
      return tl::unexpected(timeout_error(outstanding));
    }
    auto more = fill(outstanding.deadline);
    if (!more) return tl::unexpected(std::move(more.error()));
    if (*more) continue;
    const Error error = timeout_error(outstanding);
    if (options_.rules.framing == modbus::Framing::rtu) {
      quarantined_ = true;
      buffer_.clear();
    }
    return tl::unexpected(error);
  }
}

/// Appends what has arrived; false at the deadline.
Result<bool> Session::fill(TimePoint deadline) {
  std::array<std::uint8_t, 2 * modbus::max_adu_size> chunk;  // NOLINT: filled by receive()
  auto count = transport_->receive(chunk, deadline);
  if (!count) return tl::unexpected(std::move(count.error()));
  if (*count == 0) return false;
  const ByteView bytes = ByteView(chunk).first(*count);
  if (trace_.bytes) trace_.bytes(Direction::received, bytes);
  if (options_.rules.framing == modbus::Framing::rtu) last_activity_ = clock_->now();
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  return true;
}

/// The next complete frame in the buffer, if there is one.
Result<std::optional<modbus::Adu>> Session::take_frame() {
  while (!buffer_.empty()) {
    auto deframing = modbus::deframe(options_.rules.framing, modbus::Role::client, buffer_);
    if (std::holds_alternative<modbus::NeedMore>(deframing)) return std::nullopt;
    if (auto* frame = std::get_if<modbus::Deframed>(&deframing)) {
      counters_.noise_bytes += frame->skipped;
      buffer_.erase(buffer_.begin(),
                    buffer_.begin() + static_cast<std::ptrdiff_t>(frame->consumed));
      return std::move(frame->adu);
    }
    const auto& junk = std::get<modbus::Junk>(deframing);
    if (trace_.decision) trace_.decision(Decision::junk, junk.reason);
    if (options_.rules.framing == modbus::Framing::tcp) {
      // Left in the buffer: every later attempt on this connection fails alike, until it is
      // reopened.
      return tl::unexpected(
          Error{.code = Errc::malformed_answer,
                .message = fmt::format("what came is not Modbus TCP: {}", junk.reason),
                .hint = "is this a Modbus TCP port? the connection has to be opened anew"});
    }
    counters_.noise_bytes += junk.size;
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(junk.size));
  }
  return std::nullopt;
}

void Session::sort(const modbus::Adu& received, Outstanding* outstanding) {
  const modbus::Adu* request = outstanding == nullptr ? nullptr : &outstanding->request;
  switch (judge(request, received, options_.rules)) {
    case Verdict::answer:
      decide(Decision::answer, received);
      outstanding->answer = received.pdu;
      return;
    case Verdict::exception_response:
      decide(Decision::exception_response, received);
      outstanding->answer = received.pdu;
      return;
    case Verdict::spontaneous:
      decide(Decision::spontaneous, received);
      keep(received.pdu);
      return;
    case Verdict::broken:
      decide(Decision::broken, received);
      outstanding->broken = describe_frame(received);
      ++counters_.strays;
      return;
    case Verdict::stray:
      decide(Decision::stray, received);
      ++counters_.strays;
      return;
  }
}

void Session::keep(const modbus::Pdu& pdu) {
  ++counters_.spontaneous;
  if (queue_.size() == max_queued) {
    queue_.pop_front();
    ++counters_.overflowed;
  }
  queue_.push_back({.pdu = pdu, .arrival = clock_->now(), .wall = clock_->wall()});
}

Result<void> Session::keep_gap() {
  if (options_.gap == Duration::zero()) return {};
  const TimePoint earliest = last_activity_ + options_.gap;
  return clock_->now() < earliest ? clock_->sleep_until(earliest) : Result<void>();
}

/// RTU has no ids: a late answer would be taken for the next one. Wait until it can no longer come,
/// then prove the line.
Result<void> Session::leave_quarantine() {
  const TimePoint end = clock_->now() + options_.answer_timeout;
  if (trace_.decision)
    trace_.decision(Decision::quarantine, "waiting until no late answer can come");
  const TimePoint limit = end + options_.answer_timeout * 4;  // a line that never falls silent
  while (true) {
    const TimePoint silent = std::max(end, last_activity_ + options_.gap);
    auto more = fill(silent);
    if (!more) return tl::unexpected(std::move(more.error()));
    buffer_.clear();
    if (!*more) break;
    if (clock_->now() > limit) {
      return tl::unexpected(Error{.code = Errc::malformed_answer,
                                  .message = "the line never falls silent",
                                  .hint = "another master, noise or a wrong rate?"});
    }
  }
  quarantined_ = false;
  if (options_.proof == SessionOptions::Proof::none) return {};
  // The word changes with every request, so an old answer can not pass for this one.
  auto proved = exchange(modbus::loopback_request(next_transaction_));
  if (!proved) {
    quarantined_ = true;
    return tl::unexpected(std::move(proved.error()));
  }
  return {};
}

Error Session::timeout_error(const Outstanding& outstanding) const {
  const std::string tried = modbus::describe_request(outstanding.request.pdu);
  Error error{.code = Errc::no_answer, .tried = tried, .waited = options_.answer_timeout};
  if (!outstanding.broken.empty()) {
    error.code = Errc::malformed_answer;
    error.message =
        fmt::format("the answer to '{}' does not fit the request ({})", tried, outstanding.broken);
    return error;
  }
  if (buffer_.empty()) return error;
  error.code = Errc::incomplete_answer;
  error.message = fmt::format("only part of an answer to '{}' came ({})", tried, to_hex(buffer_));
  if (options_.rules.framing == modbus::Framing::rtu && buffer_.size() >= 5) {
    error.code = Errc::bad_checksum;
    error.message =
        fmt::format("no answer to '{}' with a right checksum ({})", tried, to_hex(buffer_));
  }
  return error;
}

void Session::decide(Decision decision, const modbus::Adu& adu) const {
  if (trace_.decision) trace_.decision(decision, describe_frame(adu));
}

}  // namespace spindle::link
