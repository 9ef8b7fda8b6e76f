#pragma once

#include <optional>
#include <string>

#include "spindle/device/device.hpp"
#include "support/scripted_transport.hpp"

namespace spindle::test {

/// A device whose every byte a script says.
struct ScriptedDevice : ScriptedPeer {
  Result<device::Device> open(const std::string& url, const catalogue::Profile& profile,
                              const device::LinkOptions& options = {}) {
    const auto connect = [this](const auto&, const auto&,
                                Duration timeout) -> Result<std::unique_ptr<link::Transport>> {
      connect_timeout = timeout;
      if (refusal) return tl::unexpected(Error{.code = *refusal});
      return transport_to(script);
    };
    return device::Device::open(link::parse_endpoint(url).value(), profile, options, connect,
                                clock);
  }

  std::optional<Errc> refusal = std::nullopt;  ///< of the next attempts to connect
  Duration connect_timeout = {};               ///< with which it was asked
};

}  // namespace spindle::test
