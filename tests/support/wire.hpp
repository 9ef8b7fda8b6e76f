#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "spindle/link/transport.hpp"
#include "spindle/modbus/adu.hpp"
#include "spindle/modbus/pdu.hpp"
#include "support/fake_clock.hpp"

namespace spindle::test {

/// What the wire does with one request.
enum class Fate : std::uint8_t {
  passes,
  is_lost,         ///< the device never hears of it
  has_no_answer,   ///< the device does it, and its answer is lost
  closes_unheard,  ///< the connection ends, and the device never heard of it
  closes_heard,    ///< the device does it, and the connection ends
  is_only_echoed,  ///< answered as if it were done
  is_refused,      ///< exception 02
};

/// Between the clients and a device: writes down every request, and lets things go wrong.
class Wire {
 public:
  struct Request {
    TimePoint at;
    modbus::Pdu pdu;

    /// Whether it begins with these two words, as a read of so many registers does.
    [[nodiscard]] bool is(std::uint8_t function, std::uint16_t first, std::uint16_t second) const {
      return pdu.function == function && get_u16(pdu.data, 0) == first &&
             get_u16(pdu.data, 2) == second;
    }
  };
  /// The address and the word of a write of one register.
  using Write = std::pair<std::uint16_t, std::uint16_t>;

  Wire(FakeClock& clock, modbus::Framing framing) : clock_(&clock), framing_(framing) {}

  /// Notes an attempt to connect. Until `unreachable_until` it fails.
  Result<void> attempt() {
    attempts.push_back(clock_->now());
    if (clock_->now() < unreachable_until) {
      return tl::unexpected(Error{.code = Errc::connection_refused});
    }
    return {};
  }
  /// A new connection over this wire, which outlives it.
  std::unique_ptr<link::Transport> tap(std::unique_ptr<link::Transport> inner);

  /// All connections end.
  void cut() { ++generation_; }

  [[nodiscard]] std::size_t count(modbus::FunctionCode function) const {
    return static_cast<std::size_t>(
        std::count_if(requests.begin(), requests.end(), [&](const Request& request) {
          return request.pdu.function == static_cast<std::uint8_t>(function);
        }));
  }
  /// The writes of one register each, in order.
  [[nodiscard]] std::vector<Write> writes() const {
    std::vector<Write> all;
    for (const Request& request : requests) {
      const auto parsed = modbus::parse_request(request.pdu);
      const auto* write = parsed ? std::get_if<modbus::WriteSingleRequest>(&*parsed) : nullptr;
      if (write != nullptr) all.emplace_back(write->address.value, write->value);
    }
    return all;
  }

  /// Asked for every request; empty: all pass.
  std::function<Fate(const modbus::Pdu&)> fate = {};
  /// Called just before the device gets a request, and just behind it.
  std::function<void(const modbus::Pdu&)> before = {};
  std::function<void(const modbus::Pdu&)> behind = {};
  /// What the device pushes each millisecond beside its answers, without end; empty: nothing.
  std::function<modbus::Pdu()> flood = {};
  TimePoint unreachable_until = TimePoint::min();

  std::vector<TimePoint> attempts = {};  ///< to connect
  std::vector<Request> requests = {};    ///< in order, lost ones included
  std::uint32_t connections = 0;         ///< ever opened
  int open_connections = 0;              ///< now
  int most_open_connections = 0;

 private:
  class Tap;

  FakeClock* clock_;
  modbus::Framing framing_;
  unsigned generation_ = 0;  ///< of connections; older ones are broken
};

class Wire::Tap final : public link::Transport {
 public:
  Tap(Wire& wire, std::unique_ptr<link::Transport> inner)
      : wire_(&wire), generation_(wire.generation_), inner_(std::move(inner)) {
    ++wire_->connections;
    wire_->most_open_connections =
        std::max(wire_->most_open_connections, ++wire_->open_connections);
  }
  ~Tap() override { --wire_->open_connections; }
  Tap(const Tap&) = delete;
  Tap& operator=(const Tap&) = delete;

  Result<void> send(ByteView bytes, TimePoint deadline) override {
    if (closed()) return tl::unexpected(Error{.code = Errc::closed});
    const auto deframing = modbus::deframe(wire_->framing_, modbus::Role::server, bytes);
    const modbus::Adu request = std::get<modbus::Deframed>(deframing).adu;
    tell(wire_->before, request.pdu);
    const Fate fate = wire_->fate ? wire_->fate(request.pdu) : Fate::passes;
    if (fate == Fate::passes || fate == Fate::has_no_answer || fate == Fate::closes_heard) {
      if (auto sent = inner_->send(bytes, deadline); !sent) return sent;
    }
    wire_->requests.push_back({wire_->clock_->now(), request.pdu});
    tell(wire_->behind, request.pdu);
    deaf_ = fate == Fate::has_no_answer || fate == Fate::is_lost;
    closed_ = fate == Fate::closes_heard || fate == Fate::closes_unheard;
    if (fate == Fate::is_only_echoed) canned_ = Bytes(bytes.begin(), bytes.end());
    if (fate == Fate::is_refused) {
      modbus::Adu refusal = request;
      refusal.pdu = modbus::exception_response(request.pdu.function, 2);
      canned_ = modbus::frame(wire_->framing_, refusal);
    }
    return {};
  }

  Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) override {
    if (closed()) return tl::unexpected(Error{.code = Errc::closed});
    if (!canned_.empty()) return give(std::exchange(canned_, {}), into);
    while (true) {
      const bool floods = static_cast<bool>(wire_->flood);
      auto count = inner_->receive(into, floods ? wire_->clock_->now() : deadline);
      const bool silent = count && *count == 0;
      if (silent && floods) return push(into);
      if (!count || silent || !deaf_) return count;
    }
  }

  void set_uninterruptible() override { inner_->set_uninterruptible(); }
  [[nodiscard]] bool is_private() const override { return inner_->is_private(); }

 private:
  using Hook = std::function<void(const modbus::Pdu&)>;

  [[nodiscard]] bool closed() const { return closed_ || generation_ != wire_->generation_; }
  static void tell(Hook hook, const modbus::Pdu& request) {  // a copy: it may take itself away
    if (hook) hook(request);
  }
  static std::size_t give(const Bytes& bytes, std::span<std::uint8_t> into) {
    std::copy(bytes.begin(), bytes.end(), into.begin());
    return bytes.size();
  }
  std::size_t push(std::span<std::uint8_t> into) {
    const Bytes bytes = modbus::frame(wire_->framing_, {{1}, {}, wire_->flood()});
    wire_->clock_->advance(std::chrono::milliseconds(1));  // which may end the flood
    return give(bytes, into);
  }

  Wire* wire_;
  unsigned generation_;
  std::unique_ptr<link::Transport> inner_;
  Bytes canned_ = {};
  bool deaf_ = false;
  bool closed_ = false;
};

inline std::unique_ptr<link::Transport> Wire::tap(std::unique_ptr<link::Transport> inner) {
  return std::make_unique<Tap>(*this, std::move(inner));
}

/// This fate for the next so many requests that `concerns` chooses; all else passes.
inline std::function<Fate(const modbus::Pdu&)> next_meet(
    Fate fate, unsigned times, std::function<bool(const modbus::Pdu&)> concerns = {}) {
  return [=, left = times](const modbus::Pdu& request) mutable {
    if (left == 0 || (concerns && !concerns(request))) return Fate::passes;
    --left;
    return fate;
  };
}

}  // namespace spindle::test
