#include "simulate_place.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <string_view>

namespace spindle::commands {
namespace {

Error misplaced(std::string message, std::string hint) {
  return {.code = Errc::usage, .message = std::move(message), .hint = std::move(hint)};
}

/// What only makes sense on a serial line, by the name of its option; empty: nothing was asked for.
std::string_view serial_option(const SimulateOptions& options) {
  if (!options.pty.empty()) return "--pty";
  if (!options.tool.units.empty()) return "--units";
  if (options.tool.baud) return "--baud";
  return options.gaps == sim::LineModel::Gaps::ignored ? "--no-gap" : "";
}

Result<link::Endpoint> listen_endpoint(const std::string& text, const catalogue::Profile& profile) {
  const bool serial = profile.link.framing == modbus::Framing::rtu;
  const std::string_view usual = serial ? "rtu+tcp://127.0.0.1:0" : "tcp://127.0.0.1:0";
  std::string url = text.empty() ? std::string(usual) : text;
  // Port 0 asks the system for a free one; as a target it would make no sense.
  const bool any_port = url.ends_with(":0");
  if (any_port) url.back() = '1';
  auto endpoint = link::parse_endpoint(url);
  if (!endpoint) return endpoint;
  const auto wanted = serial ? link::Medium::rtu_over_tcp : link::Medium::tcp;
  if (endpoint->medium != wanted) {
    return tl::unexpected(
        Error{.code = Errc::bad_target,
              .message = fmt::format("a simulated tool of this kind listens on {}",
                                     serial ? "rtu+tcp:// or a --pty" : "tcp://"),
              .hint = fmt::format("such as {}", usual),
              .target = text});
  }
  if (any_port) endpoint->port = 0;
  return endpoint;
}

}  // namespace

Result<link::Endpoint> place_of(const SimulateOptions& options, const catalogue::Profile& profile) {
  const std::string_view only_serial = serial_option(options);
  if (!only_serial.empty() && profile.link.framing == modbus::Framing::tcp) {
    return tl::unexpected(misplaced(
        fmt::format("{} is for serial tools, and {} speaks Modbus TCP", only_serial, profile.id),
        "leave it out"));
  }
  if (options.pty.empty()) return listen_endpoint(options.listen, profile);
  if (!options.listen.empty()) {
    return tl::unexpected(misplaced("--pty and --listen are two places", "choose one of them"));
  }
  link::Endpoint place{.medium = link::Medium::serial};
  place.device = std::filesystem::absolute(options.pty).lexically_normal().string();
  return place;
}

std::string url_of(const link::Endpoint& place, const SimulateOptions& options) {
  if (place.medium == link::Medium::tcp) return link::to_url(place);
  std::string url = place.medium == link::Medium::serial ? fmt::format("rtu://{}", place.device)
                                                         : link::to_url(place);
  url += fmt::format("?unit={}", options.tool.units.empty() ? 1 : options.tool.units.front().value);
  if (options.tool.baud) url += fmt::format("&baud={}", *options.tool.baud);
  return url;
}

}  // namespace spindle::commands
