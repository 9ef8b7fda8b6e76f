#include "spindle/work/discovery.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <utility>

#include "spindle/base/text.hpp"

namespace spindle::work {
namespace {

using link::NetworkInterface;

constexpr Duration second_question = std::chrono::seconds(1);

std::string in_words(const std::vector<NetworkInterface>& interfaces) {
  std::vector<std::string> names;
  for (const NetworkInterface& each : interfaces) {
    names.push_back(fmt::format("{} ({})", each.name, each.address));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

Error no_such_interface(const std::string& wanted, const std::vector<NetworkInterface>& all) {
  std::vector<std::string> names;
  for (const NetworkInterface& each : all) names.push_back(each.name);
  std::string hint = suggestion(wanted, names);
  if (hint.empty()) hint = all.empty() ? "there is none" : "there are " + in_words(all);
  return {.code = Errc::usage,
          .message = fmt::format("'{}' is no network interface with an IPv4 address", wanted),
          .hint = std::move(hint),
          .name = "--interface"};
}

/// Once, also where it has several addresses: one question reaches its network.
void add_once(const NetworkInterface& interface, std::vector<NetworkInterface>& to) {
  const bool is_known = std::any_of(to.begin(), to.end(), [&](const NetworkInterface& known) {
    return known.name == interface.name;
  });
  if (!is_known) to.push_back(interface);
}

/// The number of a question, another one at each start.
std::uint16_t first_number(const Clock& clock) {
  return static_cast<std::uint16_t>(clock.wall().time_since_epoch().count());
}

}  // namespace

Result<std::vector<NetworkInterface>> choose_interfaces(const std::vector<std::string>& wanted,
                                                        const link::Network& network) {
  if (!network.interfaces) {
    return tl::unexpected(
        Error{.code = Errc::no_route, .message = "this program cannot look at the network"});
  }
  TRY_LET(const auto all, network.interfaces());
  std::vector<NetworkInterface> chosen;
  for (const std::string& name : wanted) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const NetworkInterface& each) {
      return each.name == name || each.address == name;
    });
    if (found == all.end()) return tl::unexpected(no_such_interface(name, all));
    add_once(*found, chosen);
  }
  if (!wanted.empty()) return chosen;
  for (const NetworkInterface& each : all) {
    if (each.is_up && each.is_multicast) add_once(each, chosen);
  }
  if (!chosen.empty()) return chosen;
  return tl::unexpected(
      Error{.code = Errc::no_route,
            .message = "no network interface is up that can send to a group",
            .hint = all.empty() ? "connect this computer to the network of the tools"
                                : fmt::format("connect this computer to the network of the tools, "
                                              "or choose with --interface: {}",
                                              in_words(all))});
}

std::vector<catalogue::DiscoverySpec> discovery_specs(const files::ProfileStore& profiles) {
  std::vector<catalogue::DiscoverySpec> specs;
  std::set<std::tuple<std::string, unsigned, unsigned, unsigned>> known;
  for (const catalogue::Profile& profile : profiles.load_all()) {
    if (!profile.discovery) continue;
    const catalogue::DiscoverySpec& spec = *profile.discovery;
    if (known.emplace(spec.group.to_string(), spec.port, spec.ask, spec.answer).second) {
      specs.push_back(spec);
    }
  }
  return specs;
}

Result<ScanResult> scan_group(const catalogue::DiscoverySpec& spec,
                              const std::vector<NetworkInterface>& interfaces, Duration duration,
                              const Environment& environment,
                              const std::function<void(const Heard&)>& tell) {
  ScanResult result;
  TRY_LET(const auto sockets,
          environment.network.open(interfaces, spec.group.to_string(), spec.port, result.faults));
  const Clock& clock = environment.clock;
  const TimePoint end = clock.now() + duration;
  TimePoint next_question = clock.now();
  std::uint16_t number = first_number(clock);
  std::set<std::uint16_t> questions;
  device::FoundTools found;
  for (TimePoint now = clock.now(); now < end; now = clock.now()) {
    if (now >= next_question) {
      // The first question may be lost on its way, and few scans last longer than one more.
      next_question =
          now + (questions.empty() ? std::min(spec.every, second_question) : spec.every);
      questions.insert(++number);
      auto faults = sockets->send(device::discovery_question(spec, number));
      if (questions.size() == 1)
        std::move(faults.begin(), faults.end(), std::back_inserter(result.faults));
    }
    TRY_LET(const auto datagram, sockets->receive(std::min(end, next_question)));
    if (!datagram) continue;
    const auto tool = device::decode_found(spec, questions, datagram->bytes);
    if (!tool) {
      ++result.strange;
      continue;
    }
    switch (found.add(*tool)) {
      case device::FoundTools::Added::yes:
        tell({*tool, datagram->from, datagram->interface});
        break;
      case device::FoundTools::Added::no_room:
        ++result.left_out;
        break;
      case device::FoundTools::Added::known:
        break;
    }
  }
  return result;
}

}  // namespace spindle::work
