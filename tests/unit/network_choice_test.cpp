// Where tools are looked for: interfaces, and networks whose addresses are tried.
#include <doctest/doctest.h>

#include "spindle/work/discovery.hpp"
#include "spindle/work/sweep.hpp"

using namespace spindle;

namespace {

link::Network network(std::vector<link::NetworkInterface> interfaces) {
  return {.interfaces = [interfaces] {
    return Result<std::vector<link::NetworkInterface>>(interfaces);
  }};
}

const link::Network office = network({{"lo", "127.0.0.1", true, false},
                                      {"eth0", "192.168.10.2", true, true},
                                      {"eth0", "192.168.11.2", true, true},
                                      {"wlan0", "10.0.0.7", true, true},
                                      {"usb0", "10.1.0.7", false, true}});

std::vector<std::string> names(const Result<std::vector<link::NetworkInterface>>& chosen) {
  REQUIRE(chosen);
  std::vector<std::string> names;
  for (const auto& each : *chosen) names.push_back(each.name);
  return names;
}

using Names = std::vector<std::string>;

}  // namespace

TEST_CASE("interfaces: all that are up and can send to groups, each once") {
  CHECK(names(work::choose_interfaces({}, office)) == Names{"eth0", "wlan0"});
}

TEST_CASE("interfaces: those that the user names, by name or address") {
  CHECK(names(work::choose_interfaces({"lo"}, office)) == Names{"lo"});
  CHECK(names(work::choose_interfaces({"10.0.0.7", "eth0", "wlan0"}, office)) ==
        Names{"wlan0", "eth0"});
  CHECK(names(work::choose_interfaces({"usb0"}, office)) == Names{"usb0"});
}

TEST_CASE("interfaces: one that is not there is told with those that are") {
  const auto chosen = work::choose_interfaces({"eht0"}, office);
  REQUIRE_FALSE(chosen);
  CHECK(chosen.error().code == Errc::usage);
  CHECK(chosen.error().hint == "did you mean 'eth0'?");
  const auto other = work::choose_interfaces({"tunnel"}, office);
  REQUIRE_FALSE(other);
  CHECK(other.error().hint.find("wlan0 (10.0.0.7)") != std::string::npos);
}

TEST_CASE("interfaces: none is no route") {
  for (const auto& net :
       {network({}), network({{"lo", "127.0.0.1", true, false}}), link::Network()}) {
    const auto chosen = work::choose_interfaces({}, net);
    REQUIRE_FALSE(chosen);
    CHECK(chosen.error().code == Errc::no_route);
  }
}

TEST_CASE("sweep: a network of at most 65,536 addresses that tools can have") {
  for (const char* text : {"192.168.10.0/24", "10.1.2.3", "10.1.0.0/16", "127.0.0.1/32"}) {
    CAPTURE(text);
    CHECK(work::parse_sweep(text));
  }
  for (const char* text : {"10.0.0.0/15", "0.0.0.0/0", "0.1.2.0/24", "224.0.0.1", "255.255.255.255",
                           "239.66.77.0/24", "station3", "", "10.0.0.0/", "tcp://10.0.0.1"}) {
    CAPTURE(text);
    const auto network = work::parse_sweep(text);
    REQUIRE_FALSE(network);
    CHECK(network.error().code == Errc::usage);
    CHECK_FALSE(network.error().hint.empty());
  }
}
