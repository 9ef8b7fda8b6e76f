#include "spindle/link/endpoint.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using namespace spindle;
using namespace spindle::link;
using modbus::Parity;
using namespace std::chrono_literals;

namespace {

struct Good {
  std::string_view url;
  Endpoint endpoint;  // without its text
};

// Contract, section 2.1.
std::vector<Good> good_urls() {
  const auto tcp = [](std::string host) { return Endpoint{.host = std::move(host)}; };
  return {
      {"tcp://192.168.10.23", tcp("192.168.10.23")},
      {"tcp://station3/", tcp("station3")},
      {"tcp://tool_7.plant-2.example", tcp("tool_7.plant-2.example")},
      {"tcp://station3:5000", {.host = "station3", .port = 5000}},
      {"tcp://station3:1", {.host = "station3", .port = 1}},
      {"tcp://station3:65535", {.host = "station3", .port = 65535}},
      {"tcp://station3:0080", {.host = "station3", .port = 80}},
      {"tcp://station3?", tcp("station3")},
      {"tcp://station3:502?unit=0", {.host = "station3", .port = 502, .unit = {{0}}}},
      {"tcp://station3?unit=255", {.host = "station3", .unit = {{255}}}},
      {"tcp://[::1]", tcp("::1")},
      {"tcp://[::1]:5000", {.host = "::1", .port = 5000}},
      {"tcp://[fe80::1%eth0.10]:5000?unit=3",
       {.host = "fe80::1%eth0.10", .port = 5000, .unit = {{3}}}},
      {"tcp://[::ffff:10.0.0.7]/", tcp("::ffff:10.0.0.7")},
      {"rtu:///dev/ttyUSB0", {.medium = Medium::serial, .device = "/dev/ttyUSB0"}},
      {"rtu:/dev/ttyUSB0", {.medium = Medium::serial, .device = "/dev/ttyUSB0"}},
      {"rtu:///dev/ttyUSB0?unit=1&baud=9600&parity=even&stop=1",
       {.medium = Medium::serial,
        .device = "/dev/ttyUSB0",
        .unit = {{1}},
        .baud = 9600,
        .parity = Parity::even,
        .stop_bits = 1}},
      {"rtu:///dev/serial/by-id/usb-FTDI_A:1-if00?stop=2&parity=odd&baud=230400&unit=247",
       {.medium = Medium::serial,
        .device = "/dev/serial/by-id/usb-FTDI_A:1-if00",
        .unit = {{247}},
        .baud = 230400,
        .parity = Parity::odd,
        .stop_bits = 2}},
      {"rtu:///dev/ttyS0?parity=none",
       {.medium = Medium::serial, .device = "/dev/ttyS0", .parity = Parity::none}},
      {"rtu+tcp://gateway:4001", {.medium = Medium::rtu_over_tcp, .host = "gateway", .port = 4001}},
      {"rtu+tcp://[::1]:4001?unit=31",
       {.medium = Medium::rtu_over_tcp, .host = "::1", .port = 4001, .unit = {{31}}}},
      {"rtu:///d?gap=6ms&rs485=true&echo=true",
       {.medium = Medium::serial,
        .device = "/d",
        .gap = 6ms,
        .switching = LineSwitching::kernel,
        .echo = LocalEcho::present}},
      {"rtu:///d?gap=0ms&rs485=false&echo=false",
       {.medium = Medium::serial, .device = "/d", .gap = 0ms, .echo = LocalEcho::absent}},
      {"rtu:///d?gap=1s&echo=auto", {.medium = Medium::serial, .device = "/d", .gap = 1s}},
      {"rtu+tcp://h:1?gap=5500us&echo=true&baud=115200",
       {.medium = Medium::rtu_over_tcp,
        .host = "h",
        .port = 1,
        .baud = 115200,
        .gap = 5500us,
        .echo = LocalEcho::present}},
      {"sim:doga-bm", {.medium = Medium::simulated, .profile = "doga-bm"}},
      {"sim:driver?baud=115200",
       {.medium = Medium::simulated, .profile = "driver", .baud = 115200}},
      {"sim://doga-bm", {.medium = Medium::simulated, .profile = "doga-bm"}},
      {"sim:./mine.yaml?unit=255",
       {.medium = Medium::simulated, .profile = "./mine.yaml", .unit = {{255}}}},
  };
}

struct Bad {
  std::string_view url;
  std::string_view message;
  std::string_view hint = {};  // empty: not looked at
};

std::vector<Bad> bad_urls() {
  return {
      {"sim", "the ':' of a URL is missing"},
      {"", "the ':' of a URL is missing",
       "a target is tcp://HOST, rtu:///DEVICE, rtu+tcp://HOST:PORT or sim:PROFILE"},
      {"tpc://station3", "unknown kind of target 'tpc:'", "did you mean 'tcp'?"},
      {"TCP://station3", "unknown kind of target 'TCP:'"},
      {"http://station3", "unknown kind of target 'http:'"},
      {"rtu+tpc://h:1", "unknown kind of target 'rtu+tpc:'", "did you mean 'rtu+tcp'?"},
      {"://station3", "unknown kind of target ':'"},
      {"tcp", "the ':' of a URL is missing"},
      {"tcp:station3", "'//' is missing", "write tcp://HOST[:PORT][?unit=N]"},
      {"tcp:/station3", "'//' is missing"},
      {"tcp://", "the host is missing", "write tcp://HOST[:PORT][?unit=N]"},
      {"tcp:///", "the host is missing"},
      {"tcp://:5000", "the host is missing"},
      {"tcp://?unit=1", "the host is missing"},
      {"tcp://[]:5000", "the host is missing"},
      {"tcp://station3:", "'' is not a port (1 to 65535)"},
      {"tcp://station3:0", "'0' is not a port (1 to 65535)"},
      {"tcp://station3:65536", "'65536' is not a port (1 to 65535)"},
      {"tcp://station3:99999999999999999999", "'99999999999999999999' is not a port (1 to 65535)"},
      {"tcp://station3:+5", "'+5' is not a port (1 to 65535)"},
      {"tcp://station3:5000x", "'5000x' is not a port (1 to 65535)"},
      {"tcp://station3: 5000", "' 5000' is not a port (1 to 65535)"},
      {"tcp://station3:5000/x", "'5000/x' is not a port (1 to 65535)"},
      {"tcp://::1", "more than one ':' in the host",
       "an IPv6 address stands in brackets, such as tcp://[::1]:5000"},
      {"tcp://station 3", "'station 3' is not a host name or address"},
      {"tcp://user@station3", "'user@station3' is not a host name or address"},
      {"tcp://station3/x", "'station3/x' is not a host name or address"},
      {"tcp://stätion", "'stätion' is not a host name or address"},
      {"tcp://[::1", "the bracket of the IPv6 address is not closed"},
      {"tcp://[::1]5000", "'5000' behind the IPv6 address is not a port"},
      {"tcp://[::1]:", "'' is not a port (1 to 65535)"},
      {"tcp://[station3]", "'station3' is not an IPv6 address"},
      {"tcp://[10.0.0.7]", "'10.0.0.7' is not an IPv6 address"},
      {"tcp://[fe80::1%]", "'fe80::1%' is not an IPv6 address"},
      {"tcp://[xyz::1%eth0]", "'xyz::1%eth0' is not an IPv6 address"},
      {"tcp://[fe80::1%eth0/0]", "'fe80::1%eth0/0' is not an IPv6 address"},
      {"rtu:", "the path of the serial line is missing", "write rtu:///dev/ttyUSB0?unit=1"},
      {"rtu:///", "the path of the serial line is missing"},
      {"rtu://dev/ttyUSB0", "the path of a serial line begins with '/'"},
      {"rtu:ttyUSB0", "the path of a serial line begins with '/'"},
      {"rtu+tcp://gateway", "the port of the device server is missing",
       "write rtu+tcp://HOST:PORT?unit=1"},
      {"rtu+tcp://gateway?unit=1", "the port of the device server is missing"},
      {"sim:", "the profile of the simulated tool is missing",
       "write sim:doga-bm; 'spindle profile list' shows all"},
      {"sim://?unit=1", "the profile of the simulated tool is missing"},
      {"tcp://h?unit=256", "unit=256: unit is a number from 0 to 255"},
      {"tcp://h?unit=", "unit=: unit is a number from 0 to 255"},
      {"tcp://h?unit=-1", "unit=-1: unit is a number from 0 to 255"},
      {"tcp://h?unit=1?unit=2", "unit=1?unit=2: unit is a number from 0 to 255"},
      {"rtu:///d?unit=248", "unit=248: unit is a number from 0 to 247",
       "units from 248 are reserved; with &reserved=true they are asked"},
      {"rtu+tcp://h:1?unit=255&reserved=false", "unit=255: unit is a number from 0 to 247",
       "units from 248 are reserved; with &reserved=true they are asked"},
      {"tcp://h?unit=250&reserved=true", "unknown option 'reserved'"},
      {"tcp://h?transaction=0", "transaction=0: transaction is echoed or ignored"},
      {"tcp://h?transaction=Ignored", "transaction=Ignored: transaction is echoed or ignored"},
      {"rtu:///d?transaction=ignored", "unknown option 'transaction'"},
      {"rtu+tcp://h:1?transaction=ignored", "unknown option 'transaction'"},
      {"tcp://h?unit", "'unit' has no value"},
      {"tcp://h?unit=1&unit=1", "'unit' is given twice"},
      {"rtu:///d?baud=9600&unit=1&baud=9600", "'baud' is given twice"},
      {"tcp://h?unti=1", "unknown option 'unti'", "did you mean 'unit'?"},
      {"tcp://h?speed=1", "unknown option 'speed'",
       "here there is unit, transaction, timeout, retries"},
      {"tcp://h?baud=9600", "unknown option 'baud'",
       "here there is unit, transaction, timeout, retries"},
      {"sim:doga-bm?parity=even", "unknown option 'parity'",
       "here there is unit, baud, timeout, retries"},
      {"rtu+tcp://h:1?stop=1", "unknown option 'stop'"},
      {"rtu+tcp://h:1?rs485=true", "unknown option 'rs485'",
       "here there is unit, reserved, baud, gap, timeout, retries, echo"},
      {"tcp://h?gap=5ms", "unknown option 'gap'",
       "here there is unit, transaction, timeout, retries"},
      {"sim:doga-bm?echo=true", "unknown option 'echo'"},
      {"rtu:///d?gap=5", "gap=5: gap is a time up to 1s"},
      {"rtu:///d?gap=", "gap=: gap is a time up to 1s"},
      {"rtu:///d?gap=-1ms", "gap=-1ms: gap is a time up to 1s"},
      {"rtu:///d?gap=1001ms", "gap=1001ms: gap is a time up to 1s"},
      {"rtu:///d?gap=1ms&gap=1ms", "'gap' is given twice"},
      {"rtu:///d?rs485=yes", "rs485=yes: rs485 is true or false"},
      {"rtu:///d?rs485", "'rs485' has no value"},
      {"rtu:///d?echo=on", "echo=on: echo is true, false or auto"},
      {"rtu:///d?ehco=true", "unknown option 'ehco'", "did you mean 'echo'?"},
      {"rtu:///d?rate=9600", "unknown option 'rate'",
       "here there is unit, reserved, baud, parity, stop, gap, timeout, retries, rs485, echo"},
      {"tcp://h?unit=1&", "unknown option ''"},
      {"tcp://h?&", "unknown option ''"},
      {"tcp://h?=1", "unknown option ''"},
      {"rtu:///d?baud=0", "baud=0: baud is a rate such as 9600 or 115200"},
      {"rtu:///d?baud=4000001", "baud=4000001: baud is a rate such as 9600 or 115200"},
      {"rtu:///d?baud=fast", "baud=fast: baud is a rate such as 9600 or 115200"},
      {"rtu:///d?parity=Even", "parity=Even: parity is none, even or odd"},
      {"rtu:///d?parity=", "parity=: parity is none, even or odd"},
      {"rtu:///d?stop=0", "stop=0: stop is 1 or 2"},
      {"rtu:///d?stop=3", "stop=3: stop is 1 or 2"},
      {"rtu:///d?stop=1.5", "stop=1.5: stop is 1 or 2"},
  };
}

}  // namespace

TEST_CASE("every form of a URL is taken apart") {
  for (const Good& good : good_urls()) {
    const Endpoint& expected = good.endpoint;
    const std::string_view url = good.url;
    CAPTURE(url);
    const auto endpoint = parse_endpoint(url);
    REQUIRE_MESSAGE(endpoint, describe(endpoint.error()));
    CHECK(endpoint->text == url);
    CHECK(endpoint->medium == expected.medium);
    CHECK(endpoint->host == expected.host);
    CHECK(endpoint->port == expected.port);
    CHECK(endpoint->device == expected.device);
    CHECK(endpoint->profile == expected.profile);
    CHECK(endpoint->unit == expected.unit);
    CHECK(endpoint->baud == expected.baud);
    CHECK(endpoint->parity == expected.parity);
    CHECK(endpoint->stop_bits == expected.stop_bits);
    CHECK(endpoint->gap == expected.gap);
    CHECK(endpoint->switching == expected.switching);
    CHECK(endpoint->echo == expected.echo);
  }
}

TEST_CASE("what is wrong with a URL is named") {
  for (const Bad& bad : bad_urls()) {
    CAPTURE(bad.url);
    const auto endpoint = parse_endpoint(bad.url);
    REQUIRE_FALSE(endpoint);
    CHECK(endpoint.error().code == Errc::bad_target);
    CHECK(endpoint.error().target == bad.url);
    CHECK(endpoint.error().message == bad.message);
    if (!bad.hint.empty()) CHECK(endpoint.error().hint == bad.hint);
  }
}

TEST_CASE("hostile text never passes for a host and never breaks the line of its error") {
  using namespace std::string_literals;
  const std::vector<std::string> hostile = {
      "tcp://a\nb",       "tcp://a\0b"s,       "tcp://\x1B[2J",
      "tcp://[::1\n]",    "tcp://a:\n5000",    "tcp://%s%n{}",
      "tcp://h?unit=1\n", "{}://{}",           "tcp://a\xFF\xFE",
      "tcp://[::1]\r:",   "tcp://h?\x07=\x07", std::string(100'000, ':'),
      "\0tcp://h"s,       "tcp://[[::1]]",     "tcp://h?" + std::string(50'000, '&')};
  for (const std::string& url : hostile) {
    CAPTURE(url.substr(0, 40));
    const auto endpoint = parse_endpoint(url);
    REQUIRE_FALSE(endpoint);
    CHECK(endpoint.error().code == Errc::bad_target);
    CHECK(describe(endpoint.error()).find_first_of("\n\r\x1B\x07"s + '\0') == std::string::npos);
  }
}

TEST_CASE("every beginning of a URL is taken or refused, and text follows it unchanged") {
  for (const Good& good : good_urls()) {
    for (std::size_t size = 0; size < good.url.size(); ++size) {
      const std::string_view begun = good.url.substr(0, size);
      CAPTURE(begun);
      const auto endpoint = parse_endpoint(begun);
      if (endpoint) {
        CHECK(endpoint->text == begun);
      } else {
        CHECK(endpoint.error().code == Errc::bad_target);
        CHECK_FALSE(endpoint.error().message.empty());
      }
    }
  }
}

TEST_CASE("an address or a serial port alone is a target") {
  struct Row {
    std::string_view typed;
    std::string_view meant;
  };
  for (const auto& [typed, meant] : std::vector<Row>{
           {"192.168.10.23", "tcp://192.168.10.23"},
           {"192.168.10.23:5000", "tcp://192.168.10.23:5000"},
           {"192.168.10.23:5000?unit=3", "tcp://192.168.10.23:5000?unit=3"},
           {"[::1]", "tcp://[::1]"},
           {"[fe80::1%eth0]:502", "tcp://[fe80::1%eth0]:502"},
           {"gateway-2.plant:4001", "tcp://gateway-2.plant:4001"},
           {"/dev/ttyUSB0", "rtu:///dev/ttyUSB0"},
           {"/dev/serial/by-id/usb-FTDI?unit=2", "rtu:///dev/serial/by-id/usb-FTDI?unit=2"},
           {"ttyACM1?unit=2&baud=19200", "rtu:///dev/ttyACM1?unit=2&baud=19200"},
           {"COM1", "rtu:///dev/ttyS0"},
           {"COM12?unit=3", "rtu:///dev/ttyS11?unit=3"}}) {
    CAPTURE(typed);
    const auto endpoint = parse_endpoint(typed);
    REQUIRE(endpoint);
    CHECK(endpoint->text == typed);
    auto same = parse_endpoint(meant).value();
    same.text = typed;
    CHECK(*endpoint == same);
  }
  for (const std::string_view typed : {"192.168.10.23:0", "192.168.10.23:70000", "[::1]5000"}) {
    CAPTURE(typed);
    CHECK_FALSE(parse_endpoint(typed));
  }
}

TEST_CASE("a URL is told from a name") {
  for (const std::string_view url : {"tcp://h",
                                     "rtu:///d",
                                     "rtu+tcp://h:1",
                                     "sim:doga-bm",
                                     "tpc://h",
                                     "http:",
                                     "station:5000",
                                     "10.0.0.7:5000",
                                     "st3:1",
                                     "10.0.0.7",
                                     "[::1]",
                                     "[::1]:5000",
                                     "/dev/ttyUSB0",
                                     "/dev/ttyUSB0?unit=3",
                                     "/dev/pts/3",
                                     "/dev/rfcomm0",
                                     "/dev/cu.usbserial",
                                     "/dev/serial/by-id/x",
                                     "/dev/driver-line",
                                     "/dev/nullmodem",
                                     "ttyUSB0",
                                     "COM3"}) {
    CAPTURE(url);
    CHECK(looks_like_url(url));
  }
  for (const std::string_view name : {"",
                                      "station3",
                                      "@line1",
                                      ":5000",
                                      "10.0.0",
                                      "10.0.0.7.8",
                                      "a.b.c.d",
                                      "[ab]*",
                                      "[ab]:1",
                                      "preset.1.speed",
                                      "p242",
                                      "@holding:2",
                                      "/home/x",
                                      "COM",
                                      "COM0",
                                      "ttyUSB",
                                      "st3:x",
                                      "/dev/fd/63",
                                      "/dev/stdin",
                                      "/dev/stdout",
                                      "/dev/stderr",
                                      "/dev/null",
                                      "/dev/full",
                                      "/dev/zero",
                                      "/dev/shm/values.yaml",
                                      "/dev/"}) {
    CAPTURE(name);
    CHECK_FALSE(looks_like_url(name));
  }
}

TEST_CASE("a network endpoint becomes a URL again") {
  for (const std::string_view url :
       {"tcp://station3:5000", "tcp://[::1]:5000", "tcp://10.0.0.7:502?unit=3", "tcp://station3",
        "rtu+tcp://gateway:4001", "rtu+tcp://[fe80::1%eth0]:4001?unit=31",
        "rtu+tcp://gateway:4001?unit=250&reserved=true"}) {
    CAPTURE(url);
    CHECK(to_url(parse_endpoint(url).value()) == url);
  }
}

TEST_CASE("whether transaction ids tell answers apart is left to the profile unless it is said") {
  using modbus::TransactionIds;
  CHECK(parse_endpoint("tcp://h?unit=1")->transactions == std::nullopt);
  CHECK(parse_endpoint("tcp://h?transaction=ignored")->transactions == TransactionIds::ignored);
  CHECK(parse_endpoint("tcp://h?transaction=echoed")->transactions == TransactionIds::echoed);
}
