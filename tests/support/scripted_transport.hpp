#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "spindle/base/interrupt.hpp"
#include "spindle/link/transport.hpp"
#include "spindle/modbus/adu.hpp"
#include "support/fake_clock.hpp"

namespace spindle::test {

/// Something that reaches the client: bytes, or the end of the connection.
struct Arrival {
  Duration after;  ///< after the request has been sent
  std::variant<Bytes, Errc> what;
};

/// What the peer does about one request. It sees the request, so it can copy the transaction id.
using Reaction = std::function<std::vector<Arrival>(ByteView request)>;

struct Sent {
  TimePoint at;  ///< when the first byte left
  Bytes bytes;
};

/// The peer of a ScriptedTransport and all that happens between them. The test owns it, and it
/// outlives the transport.
struct Script {
  explicit Script(FakeClock& fake_clock) : clock(&fake_clock) {}

  /// Lets the peer react to the next request that has no reaction yet.
  void on_request(Reaction reaction) { reactions.push_back(std::move(reaction)); }

  /// Lets bytes arrive at a time of their own.
  void arrive(TimePoint when, Bytes bytes) { pending.emplace(when, std::move(bytes)); }

  FakeClock* clock;
  const Interrupt* interrupt = nullptr;       ///< the one that the clock has, too
  Duration sending_takes = Duration::zero();  ///< one send(), until the last byte has left
  std::size_t chunk = 4096;                   ///< the most that one receive() returns

  std::deque<Reaction> reactions = {};
  Reaction otherwise = {};  ///< reaction to requests for which none is left
  std::multimap<TimePoint, std::variant<Bytes, Errc>> pending = {};

  /// These bytes without end, one receive() after the other, each `flood_every`; like every
  /// transport's, they come even when the deadline has passed.
  Bytes flood = {};
  Duration flood_every = std::chrono::milliseconds(1);

  std::string company = {};   ///< another program that has the line open
  TimePoint late_until = {};  ///< what an earlier program left of late answers
  std::optional<TimePoint> left_late = std::nullopt;  ///< what this one leaves

  std::vector<Sent> sent = {};
  std::size_t receives = 0;
  bool shielded = false;
};

class ScriptedTransport final : public link::Transport {
 public:
  explicit ScriptedTransport(Script& script) : script_(&script) {}

  Result<void> send(ByteView bytes, TimePoint /*deadline*/) override {
    if (interrupted()) return tl::unexpected(script_->interrupt->error());
    script_->sent.push_back({script_->clock->now(), Bytes(bytes.begin(), bytes.end())});
    script_->clock->advance(script_->sending_takes);
    for (Arrival& arrival : react(bytes)) {
      if (arrival.what == std::variant<Bytes, Errc>(Bytes())) continue;
      script_->pending.emplace(script_->clock->now() + arrival.after, std::move(arrival.what));
    }
    return {};
  }

  Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) override {
    // Time stands still unless the client waits, so a loop without end would never be noticed.
    if (++script_->receives > 1'000'000) throw std::runtime_error("receives without end");
    while (true) {
      if (interrupted()) return tl::unexpected(script_->interrupt->error());
      const auto next = script_->pending.begin();
      const bool waiting = next != script_->pending.end();
      const TimePoint now = script_->clock->now();
      if (waiting && next->first <= now) return take(into);
      if (!script_->flood.empty()) return pour(into);
      if (now >= deadline) return 0;
      const TimePoint until = waiting ? std::min(deadline, next->first) : deadline;
      wait(until);
    }
  }

  void set_uninterruptible() override { script_->shielded = true; }
  [[nodiscard]] std::string company() const override { return script_->company; }
  [[nodiscard]] TimePoint late_until() const override { return script_->late_until; }
  void leave_late(TimePoint until) override { script_->left_late = until; }

 private:
  [[nodiscard]] bool interrupted() const {
    return !script_->shielded && script_->interrupt != nullptr && script_->interrupt->raised();
  }

  void wait(TimePoint until) {
    // Ends early when the clock hears of the interrupt; a shielded wait does not.
    if (script_->shielded || !script_->clock->sleep_until(until)) {
      if (!interrupted()) script_->clock->advance(until - script_->clock->now());
    }
  }

  std::vector<Arrival> react(ByteView request) {
    if (script_->reactions.empty()) {
      return script_->otherwise ? script_->otherwise(request) : std::vector<Arrival>();
    }
    const Reaction reaction = std::move(script_->reactions.front());
    script_->reactions.pop_front();
    return reaction(request);
  }

  Result<std::size_t> take(std::span<std::uint8_t> into) {
    const auto next = script_->pending.begin();
    if (const Errc* end = std::get_if<Errc>(&next->second)) {
      return tl::unexpected(Error{.code = *end});
    }
    Bytes& bytes = std::get<Bytes>(next->second);
    const std::size_t count = std::min({into.size(), script_->chunk, bytes.size()});
    const auto end = bytes.begin() + static_cast<std::ptrdiff_t>(count);
    std::copy(bytes.begin(), end, into.begin());
    bytes.erase(bytes.begin(), end);
    if (bytes.empty()) script_->pending.erase(next);
    return count;
  }

  Result<std::size_t> pour(std::span<std::uint8_t> into) {
    script_->clock->advance(script_->flood_every);
    const std::size_t count = std::min({into.size(), script_->chunk, script_->flood.size()});
    const auto middle = script_->flood.begin() + static_cast<std::ptrdiff_t>(count);
    std::copy(script_->flood.begin(), middle, into.begin());
    std::rotate(script_->flood.begin(), middle, script_->flood.end());
    return count;
  }

  Script* script_;
};

inline std::unique_ptr<link::Transport> transport_to(Script& script) {
  return std::make_unique<ScriptedTransport>(script);
}

/// A script with the clock and the interrupt that both ends go by.
struct ScriptedPeer {
  ScriptedPeer() { script.interrupt = &interrupt; }

  Interrupt interrupt = Interrupt();
  FakeClock clock = FakeClock(interrupt);
  Script script = Script(clock);
};

/// The request as its receiver understands it; an RTU request has no id.
inline modbus::Adu request_of(modbus::Framing framing, ByteView bytes) {
  const auto deframing = modbus::deframe(framing, modbus::Role::server, bytes);
  return std::get<modbus::Deframed>(deframing).adu;
}

/// The frame of a response with id and unit of the request.
inline Bytes response_to(modbus::Framing framing, ByteView request, modbus::Pdu pdu) {
  modbus::Adu adu = request_of(framing, request);
  adu.pdu = std::move(pdu);
  return modbus::frame(framing, adu);
}

/// Answers with `pdu` after a while.
inline Reaction answer(modbus::Framing framing, Duration after, modbus::Pdu pdu) {
  return [=](ByteView request) {
    return std::vector<Arrival>{{after, response_to(framing, request, pdu)}};
  };
}

/// Says these bytes after a while, whatever was asked.
inline Reaction say(Duration after, Bytes bytes) {
  return [after, bytes = std::move(bytes)](ByteView) {
    return std::vector<Arrival>{{after, bytes}};
  };
}

/// Answers one request after the other, and none before it is no longer held up.
class Queue {
 public:
  Queue(const FakeClock& clock, TimePoint held_up_until, std::function<Bytes(ByteView)> response)
      : clock_(&clock), free_at_(held_up_until), response_(std::move(response)) {}

  std::vector<Arrival> answer(ByteView request) {
    constexpr Duration takes = std::chrono::milliseconds(3);
    free_at_ = std::max(free_at_, clock_->now()) + takes;
    return {{free_at_ - clock_->now(), response_(request)}};
  }

 private:
  const FakeClock* clock_;
  TimePoint free_at_;
  std::function<Bytes(ByteView)> response_;
};

inline Reaction silence() {
  return [](ByteView) { return std::vector<Arrival>(); };
}

}  // namespace spindle::test
