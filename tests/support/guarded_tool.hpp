#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "spindle/device/device.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/sim/bm_tool.hpp"
#include "spindle/sim/sim_transport.hpp"
#include "support/bm_profile.hpp"
#include "support/edit_list.hpp"
#include "support/fake_clock.hpp"

namespace spindle::test {

/// A clock whose sleeps no interrupt ends, beside the fake one.
class CalmClock final : public Clock {
 public:
  explicit CalmClock(FakeClock& clock) : clock_(&clock) {}
  [[nodiscard]] TimePoint now() const override { return clock_->now(); }
  [[nodiscard]] WallTime wall() const override { return clock_->wall(); }
  Result<void> sleep_until(TimePoint deadline) override {
    clock_->advance(deadline - clock_->now());
    return {};
  }

 private:
  FakeClock* clock_;
};

/// What the wire does with one request.
enum class Fate : std::uint8_t {
  passes,
  is_lost,         ///< the tool never hears of it
  has_no_answer,   ///< the tool does it, and its answer is lost
  closes_unheard,  ///< the connection ends, and the tool never heard of it
  closes_heard,    ///< the tool does it, and the connection ends
  is_only_echoed,  ///< answered as if it were done
  is_refused,      ///< exception 02
};

/// A simulated tool, every connection to it and everything that was written to it.
struct GuardedTool {
  static constexpr std::uint16_t arm = 4002;
  static constexpr std::uint16_t start = 4003;
  using Write = std::pair<std::uint16_t, std::uint16_t>;

  explicit GuardedTool(const sim::BmOptions& options = {}, sim::FaultPlan wire_faults = {})
      : faults(std::move(wire_faults)), bm(sim::make_bm_tool(profile, bm_start(), options)) {}

  Result<device::Device> open(Clock& on, const Interrupt& heeding) {
    const device::OpenTransport line = [&](const link::Endpoint&, const catalogue::LinkFacts&,
                                           Duration) -> Result<std::unique_ptr<link::Transport>> {
      if (!reachable) return tl::unexpected(Error{.code = Errc::connection_refused});
      return tap(on, heeding);
    };
    device::LinkOptions options{.answer_timeout = answer_timeout, .retries = retries};
    return device::Device::open({.text = "tcp://tool"}, profile, options, line, on);
  }
  device::Device open() { return std::move(open(clock, interrupt).value()); }

  /// Somebody else writes, past the wire.
  void write_past(std::uint16_t address, std::uint16_t value) {
    bm->answer({99}, {}, modbus::write_request({address}, value), clock.now());
  }
  [[nodiscard]] bool runs() {
    const auto answer = bm->answer(
        {99}, {}, modbus::read_request(modbus::RegisterTable::input, {3307}, 1), clock.now());
    return modbus::registers_of(answer.value()).front() != 0;
  }
  [[nodiscard]] std::size_t writes_of(std::uint16_t address, std::uint16_t value) const {
    std::size_t count = 0;
    for (const Write& write : writes) count += write == Write(address, value) ? 1U : 0U;
    return count;
  }
  [[nodiscard]] std::size_t starts() const { return writes_of(start, 1); }
  [[nodiscard]] std::size_t stops() const { return writes_of(start, 0); }
  [[nodiscard]] catalogue::Action start_action() const {
    return profile.find_action("start").value();
  }

  static catalogue::Profile confirming_profile() {
    catalogue::Profile made = bm_profile();
    for (std::size_t at = 0; at < made.actions.size(); ++at) {
      edit(made.actions, at, [](catalogue::Action& action) {
        if (action.name == "start") action.confirm = "status.running";
      });
    }
    return made;
  }

  Interrupt interrupt = Interrupt();
  const Interrupt never = Interrupt();
  FakeClock clock = FakeClock(interrupt);
  CalmClock calm = CalmClock(clock);
  catalogue::Profile profile = confirming_profile();
  sim::FaultPlan faults;
  sim::AnswerCounter answers = {};
  std::unique_ptr<sim::BmTool> bm;

  std::optional<Duration> answer_timeout = std::nullopt;
  std::optional<unsigned> retries = std::nullopt;
  bool reachable = true;
  /// Beside its answers the tool pushes an event each millisecond, without end.
  bool floods = false;
  std::uint16_t pushed_number = 1961;  ///< of these events
  std::uint16_t pushed_step = 0;       ///< from one to the next
  /// Asked for every request; empty: all pass.
  std::function<Fate(const modbus::Pdu&)> fate = {};
  std::vector<Write> writes = {};          ///< that reached the wire, in order
  std::vector<modbus::Pdu> requests = {};  ///< the same for all requests
  std::uint32_t connections = 0;           ///< ever opened
  int open_connections = 0;                ///< now
  int most_open_connections = 0;

 private:
  class Tap;
  std::unique_ptr<link::Transport> tap(Clock& on, const Interrupt& heeding);
};

/// Between the client and the tool: writes down, and lets things go wrong.
class GuardedTool::Tap final : public link::Transport {
 public:
  Tap(GuardedTool& tool, std::unique_ptr<link::Transport> inner)
      : tool_(&tool), inner_(std::move(inner)) {
    ++tool_->connections;
    tool_->most_open_connections =
        std::max(tool_->most_open_connections, ++tool_->open_connections);
  }
  ~Tap() override { --tool_->open_connections; }
  Tap(const Tap&) = delete;
  Tap& operator=(const Tap&) = delete;

  Result<void> send(ByteView bytes, TimePoint deadline) override {
    if (closed_) return tl::unexpected(Error{.code = Errc::closed});
    const auto deframing = modbus::deframe(modbus::Framing::tcp, modbus::Role::server, bytes);
    const modbus::Adu request = std::get<modbus::Deframed>(deframing).adu;
    const Fate fate = tool_->fate ? tool_->fate(request.pdu) : Fate::passes;
    const bool heard =
        fate == Fate::passes || fate == Fate::has_no_answer || fate == Fate::closes_heard;
    if (heard) {
      if (auto sent = inner_->send(bytes, deadline); !sent) return sent;
    }
    note(request.pdu);
    deaf_ = fate == Fate::has_no_answer || fate == Fate::is_lost;
    closed_ = fate == Fate::closes_heard || fate == Fate::closes_unheard;
    if (fate == Fate::is_only_echoed) canned_ = Bytes(bytes.begin(), bytes.end());
    if (fate == Fate::is_refused) {
      modbus::Adu refusal = request;
      refusal.pdu = modbus::exception_response(request.pdu.function, 2);
      canned_ = modbus::frame(modbus::Framing::tcp, refusal);
    }
    return {};
  }

  Result<std::size_t> receive(std::span<std::uint8_t> into, TimePoint deadline) override {
    if (closed_) return tl::unexpected(Error{.code = Errc::closed});
    if (!canned_.empty()) {
      const Bytes bytes = std::exchange(canned_, {});
      std::copy(bytes.begin(), bytes.end(), into.begin());
      return bytes.size();
    }
    while (true) {
      auto count = inner_->receive(into, tool_->floods ? tool_->clock.now() : deadline);
      const bool silent = count && *count == 0;
      if (silent && tool_->floods) return push(into);
      if (!count || silent || !deaf_) return count;
    }
  }

  void shield() override { inner_->shield(); }

 private:
  /// Something that is no result, as a change of direction.
  std::size_t push(std::span<std::uint8_t> into) {
    tool_->clock.advance(std::chrono::milliseconds(1));
    modbus::Adu event{.transaction = {1}, .unit = {}, .pdu = {.function = 4, .data = {28}}};
    event.pdu.data.resize(29);
    tool_->pushed_number = static_cast<std::uint16_t>(tool_->pushed_number + tool_->pushed_step);
    event.pdu.data[1] = static_cast<std::uint8_t>(tool_->pushed_number >> 8U);
    event.pdu.data[2] = static_cast<std::uint8_t>(tool_->pushed_number);
    event.pdu.data[26] = 3;
    const Bytes bytes = modbus::frame(modbus::Framing::tcp, event);
    std::copy(bytes.begin(), bytes.end(), into.begin());
    return bytes.size();
  }

  void note(const modbus::Pdu& request) {
    tool_->requests.push_back(request);
    const auto parsed = modbus::parse_request(request);
    if (!parsed) return;
    if (const auto* write = std::get_if<modbus::WriteSingleRequest>(&*parsed)) {
      tool_->writes.emplace_back(write->address.value, write->value);
    }
  }

  GuardedTool* tool_;
  std::unique_ptr<link::Transport> inner_;
  Bytes canned_ = {};
  bool deaf_ = false;
  bool closed_ = false;
};

inline std::unique_ptr<link::Transport> GuardedTool::tap(Clock& on, const Interrupt& heeding) {
  return std::make_unique<Tap>(
      *this, sim::make_sim_transport(*bm, {connections + 1}, modbus::Framing::tcp, faults, answers,
                                     on, heeding));
}

/// The fate of writes of one value to the start register, so often; all else passes.
inline std::function<Fate(const modbus::Pdu&)> fate_of(std::uint16_t value, Fate fate,
                                                       unsigned times = 1'000'000) {
  return [=, left = times](const modbus::Pdu& request) mutable {
    if (request != modbus::write_request({GuardedTool::start}, value) || left == 0) {
      return Fate::passes;
    }
    --left;
    return fate;
  };
}

}  // namespace spindle::test
