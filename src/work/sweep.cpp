#include "spindle/work/sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <thread>
#include <utility>

#include "spindle/work/connect.hpp"

namespace spindle::work {
namespace {

// At most so many connections are under way at once, however fast they are begun.
constexpr std::size_t most_at_once = 64;

// A network of a plant answers in milliseconds; an address without a computer never does.
constexpr Duration usual_patience = std::chrono::seconds(1);

constexpr int widest_prefix = 16;
// With a shorter one, the first address names the network, and the last one all of it.
constexpr int longest_network = 30;

// RFC 6890: "this network", and RFC 5771 and 1112: groups and what is reserved.
constexpr std::uint32_t this_network_end = 0x01000000;
constexpr std::uint32_t groups_begin = 0xE0000000;

/// The addresses that computers can have.
Ipv4Network hosts_of(const Ipv4Network& network) {
  if (network.prefix > longest_network) return network;
  return {network.first + 1, network.last - 1, network.prefix};
}

/// How a connection or a question ended.
enum class Found : std::uint8_t { nothing, open, modbus };

bool is_interrupted(const Error& error) {
  return error.code == Errc::interrupted || error.code == Errc::terminated;
}

/// Whether the failure says that there is a port which takes connections.
bool is_open(const Error& error) { return error.status() != ExitStatus::unreachable; }

/// One sweep. Its threads share the place of the next address, the pace, and the listener.
class Sweep {
 public:
  Sweep(const SweepPlan& plan, const Environment& environment,
        const std::function<void(const SweptTool&)>& tell, const link::Progress& progress)
      : plan_(&plan),
        hosts_(hosts_of(plan.network)),
        environment_(environment),
        tell_(&tell),
        progress_(&progress) {
    CommonOptions& common = environment_.common;
    if (!common.connect_timeout) common.connect_timeout = usual_patience;
    common.retries = 0;
    result_.addresses = std::size_t{hosts_.last} - hosts_.first + 1;
  }

  SweepResult run() {
    const std::size_t threads =
        std::min({std::size_t{plan_->rate}, most_at_once, result_.addresses});
    {
      std::vector<std::jthread> others;
      others.reserve(threads - 1);
      for (std::size_t other = 1; other < threads; ++other) others.emplace_back([this] { work(); });
      work();
    }
    return std::move(result_);
  }

 private:
  void work() {
    for (std::size_t at = next_++; at < result_.addresses && !ended_; at = next_++) {
      const auto address = static_cast<std::uint32_t>(hosts_.first + at);
      for (const std::uint16_t port : plan_->ports) {
        if (!ended_) ask_port(ipv4_text(address), port);
      }
      if (!ended_) count_address();
    }
  }

  void count_address() {
    const std::lock_guard lock(mutex_);
    ++result_.asked;
    if (*progress_) (*progress_)(result_.asked, result_.addresses);
  }

  /// Waits until the next connection may be begun.
  bool take_pace() {
    TimePoint at;
    {
      const std::lock_guard lock(mutex_);
      at = std::max(environment_.clock.now(), next_start_);
      next_start_ = at + Duration(std::chrono::seconds(1)) / plan_->rate;
    }
    return keep(environment_.clock.sleep_until(at));
  }

  /// Whether it goes on; remembers why it does not.
  bool keep(const Result<void>& done) {
    if (done) return true;
    const std::lock_guard lock(mutex_);
    ended_ = true;
    if (!result_.error) result_.error = done.error();
    return false;
  }

  void ask_port(const std::string& address, std::uint16_t port) {
    if (plan_->units.empty()) {
      note(ask_unit(address, port, std::nullopt));
      return;
    }
    Found found = Found::nothing;
    for (const modbus::UnitId unit : plan_->units) {
      const Found now = ask_unit(address, port, unit);
      found = std::max(found, now);
      if (now == Found::nothing || ended_) break;
    }
    note(found);
  }

  void note(Found found) {
    const std::lock_guard lock(mutex_);
    if (found == Found::open) ++result_.open;
  }

  Found ask_unit(const std::string& address, std::uint16_t port,
                 std::optional<modbus::UnitId> unit) {
    if (!take_pace()) return Found::nothing;
    std::string url = fmt::format("tcp://{}:{}", address, port);
    if (unit) url += fmt::format("?unit={}", unit->value);
    const auto endpoint = link::parse_endpoint(url);
    if (!endpoint) return Found::nothing;
    SweptTool swept{.target = {.shown = url, .endpoint = *endpoint},
                    .address = address,
                    .port = port,
                    .unit = unit};
    auto tool = connect(swept.target, catalogue::Profile(), environment_);
    if (!tool) return judge(tool.error());
    const auto answer = tool->device.report_server_id();
    if (!answer && answer.error().code != Errc::exception_response) return judge(answer.error());
    if (!answer && is_gateway_silence(answer.error())) return Found::modbus;
    if (answer) {
      auto identification = match_identity(*answer, {}, environment_);
      if (identification) swept.identification = std::move(*identification);
    }
    const std::lock_guard lock(mutex_);
    ++result_.found;
    (*tell_)(swept);
    return Found::modbus;
  }

  /// A gateway says for a unit that it cannot reach it.
  static bool is_gateway_silence(const Error& error) {
    using enum modbus::ExceptionCode;
    return error.exception == static_cast<std::uint8_t>(gateway_path_unavailable) ||
           error.exception == static_cast<std::uint8_t>(gateway_target_failed_to_respond);
  }

  Found judge(const Error& error) {
    if (is_interrupted(error)) static_cast<void>(keep(tl::unexpected(error)));
    return is_open(error) ? Found::open : Found::nothing;
  }

  const SweepPlan* plan_;
  Ipv4Network hosts_;
  Environment environment_;
  const std::function<void(const SweptTool&)>* tell_;
  const link::Progress* progress_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<bool> ended_ = false;
  std::mutex mutex_ = {};
  TimePoint next_start_ = {};
  SweepResult result_ = {};
};

Error no_network(const std::string& text, std::string why, std::string hint) {
  return {.code = Errc::usage, .message = std::move(why), .hint = std::move(hint), .name = text};
}

}  // namespace

Result<Ipv4Network> parse_sweep(const std::string& text) {
  const auto network = parse_ipv4_network(text);
  if (!network) {
    return tl::unexpected(no_network(text, "this is no IPv4 network",
                                     "write its first address and how many bits all have in "
                                     "common: 192.168.10.0/24"));
  }
  if (network->prefix < widest_prefix) {
    return tl::unexpected(
        no_network(text,
                   fmt::format("{} addresses are more than a sweep asks: at most a /{}, 65,536",
                               std::uint64_t{network->last} - network->first + 1, widest_prefix),
                   "name the part in which the tools are"));
  }
  if (network->first < this_network_end || network->last >= groups_begin) {
    return tl::unexpected(
        no_network(text, "no tool can have such an address", "name the network of the tools"));
  }
  return *network;
}

SweepResult sweep_network(const SweepPlan& plan, const Environment& environment,
                          const std::function<void(const SweptTool&)>& tell,
                          const link::Progress& progress) {
  return Sweep(plan, environment, tell, progress).run();
}

}  // namespace spindle::work
