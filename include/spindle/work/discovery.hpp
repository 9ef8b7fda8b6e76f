#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "spindle/device/discovery.hpp"
#include "spindle/work/environment.hpp"

namespace spindle::work {

/// The interfaces on which tools are asked for: those of these names or addresses, or without any
/// all that are up and can send to groups. Errors: `usage` for one that is not there, with those
/// that are; `no_route` where there is none.
Result<std::vector<link::NetworkInterface>> choose_interfaces(
    const std::vector<std::string>& wanted, const link::Network& network);

/// Each way in which a profile says that its tools are found, once.
std::vector<catalogue::DiscoverySpec> discovery_specs(const files::ProfileStore& profiles);

/// A tool that answered, and from where.
struct Heard {
  device::FoundTool tool;
  std::string from;       ///< address of the sender; what the tool says may be another one
  std::string interface;  ///< that heard it first
};

/// What a scan came to.
struct ScanResult {
  std::size_t strange = 0;         ///< datagrams that are no answer
  std::size_t left_out = 0;        ///< answers of more tools than are told
  std::vector<Error> faults = {};  ///< of single interfaces
};

/// Asks on all these interfaces and listens for `duration`; asks anew as often as the profile says.
/// Tells each tool once, at once. Errors: an interrupt; none of the interfaces can be used.
Result<ScanResult> scan_group(const catalogue::DiscoverySpec& spec,
                              const std::vector<link::NetworkInterface>& interfaces,
                              Duration duration, const Environment& environment,
                              const std::function<void(const Heard&)>& tell);

}  // namespace spindle::work
