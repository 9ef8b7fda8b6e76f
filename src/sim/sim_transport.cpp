#include "spindle/sim/sim_transport.hpp"

#include <algorithm>
#include <utility>

namespace spindle::sim {
namespace {

constexpr Duration base_latency = std::chrono::microseconds(100);

FaultPlan with_base_latency(FaultPlan plan) {
  plan.push_back({.kind = FaultKind::latency, .duration = base_latency});
  return plan;
}

class SimTransport final : public link::Transport {
 public:
  SimTransport(Server& server, ConnectionId connection, modbus::Framing framing, FaultPlan faults,
               AnswerCounter* counter, Clock& clock, const Interrupt& interrupt,
               const LineModel& line, std::unique_ptr<Server> own = nullptr)
      : own_server_(std::move(own)),
        server_(&server),
        connection_(connection),
        faults_(with_base_latency(std::move(faults))),
        clock_(&clock),
        interrupt_(&interrupt),
        peer_(server, connection, framing, faults_, counter == nullptr ? own_counter_ : *counter,
              line) {}

  Result<void> send(ByteView bytes, TimePoint deadline) override;
  Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) override;
  [[nodiscard]] bool is_private() const override { return true; }
  void set_uninterruptible() override { shielding_ = Shielding::on; }

 private:
  [[nodiscard]] bool interrupted() const {
    return shielding_ == Shielding::off && interrupt_->raised();
  }
  [[nodiscard]] TimePoint now() const { return clock_->now() + skipped_; }
  void settle();
  Result<void> wait(TimePoint until);
  std::size_t hand_over(std::span<std::uint8_t> into);

  enum class Shielding : std::uint8_t { off, on };

  std::unique_ptr<Server> own_server_;
  AnswerCounter own_counter_ = {};
  Server* server_;
  ConnectionId connection_;
  FaultPlan faults_;
  Clock* clock_;
  const Interrupt* interrupt_;
  Peer peer_;
  Bytes unread_ = {};
  // After an interrupt no wait sleeps any more, but the tool's time still has to pass.
  Duration skipped_ = Duration::zero();
  Shielding shielding_ = Shielding::off;
};

Error closed_error() { return {.code = Errc::closed}; }

Result<void> SimTransport::send(ByteView bytes, TimePoint /*deadline*/) {
  if (interrupted()) return tl::unexpected(interrupt_->error());
  settle();
  if (peer_.closed(now())) return tl::unexpected(closed_error());
  peer_.receive(bytes, now());
  settle();
  return {};
}

Result<std::size_t> SimTransport::receive(std::span<std::uint8_t> into, TimePoint deadline) {
  const TimePoint end = deadline + skipped_;
  for (;;) {
    if (interrupted()) return tl::unexpected(interrupt_->error());
    settle();
    if (const std::size_t count = hand_over(into); count > 0) return count;
    if (peer_.closed(now())) return tl::unexpected(closed_error());
    if (now() >= end) return 0;

    const TimePoint tool = server_->next_change().value_or(end);
    auto waited = wait(std::min({end, tool, peer_.next_due().value_or(end)}));
    if (!waited) return tl::unexpected(std::move(waited.error()));
  }
}

// The tool lives up to now; what it sends unasked takes as long as an answer.
void SimTransport::settle() {
  server_->advance(now());
  for (const Push& push : server_->take_pushes(connection_)) {
    peer_.push(push.pdu, now() + base_latency);
  }
}

Result<void> SimTransport::wait(TimePoint until) {
  auto slept = clock_->sleep_until(until - skipped_);
  if (slept || shielding_ == Shielding::off) return slept;
  skipped_ += std::max(Duration::zero(), until - now());
  return {};
}

std::size_t SimTransport::hand_over(std::span<std::uint8_t> into) {
  if (unread_.empty()) unread_ = peer_.take(now());
  const std::size_t count = std::min(into.size(), unread_.size());
  const auto end = unread_.begin() + static_cast<std::ptrdiff_t>(count);
  std::copy(unread_.begin(), end, into.begin());
  unread_.erase(unread_.begin(), end);
  return count;
}

}  // namespace

std::unique_ptr<link::Transport> make_sim_transport(std::unique_ptr<Server> server,
                                                    modbus::Framing framing, FaultPlan faults,
                                                    Clock& clock, const Interrupt& interrupt,
                                                    const LineModel& line) {
  Server& tool = *server;
  return std::make_unique<SimTransport>(tool, ConnectionId{1}, framing, std::move(faults), nullptr,
                                        clock, interrupt, line, std::move(server));
}

std::unique_ptr<link::Transport> make_sim_transport(Server& server, ConnectionId connection,
                                                    modbus::Framing framing, FaultPlan faults,
                                                    AnswerCounter& counter, Clock& clock,
                                                    const Interrupt& interrupt,
                                                    const LineModel& line) {
  return std::make_unique<SimTransport>(server, connection, framing, std::move(faults), &counter,
                                        clock, interrupt, line);
}

}  // namespace spindle::sim
