// Any text as a target's URL.

#include "spindle/link/endpoint.hpp"

#include "input.hpp"

using namespace spindle;
using namespace spindle::link;
using spindle::fuzz::require;

namespace {

bool is_network(Medium medium) { return medium == Medium::tcp || medium == Medium::rtu_over_tcp; }

void check_endpoint(const Endpoint& endpoint) {
  require(is_network(endpoint.medium) == !endpoint.host.empty());
  require((endpoint.medium == Medium::serial) == !endpoint.device.empty());
  require((endpoint.medium == Medium::simulated) == !endpoint.profile.empty());
  require(!endpoint.port || *endpoint.port != 0);
  if (!is_network(endpoint.medium) || !endpoint.port) return;
  // The URL that messages show is one that can be typed.
  const auto again = parse_endpoint(to_url(endpoint));
  require(again.has_value());
  require(again->medium == endpoint.medium && again->host == endpoint.host);
  require(again->port == endpoint.port && again->unit == endpoint.unit);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::Input(data, size).text();
  const auto endpoint = parse_endpoint(text);
  if (endpoint) {
    require(looks_like_url(text));
    require(endpoint->text == text);
    check_endpoint(*endpoint);
  } else {
    require(endpoint.error().code == Errc::bad_target);
    require(describe(endpoint.error()).find('\n') == std::string::npos);
  }
  return 0;
}
