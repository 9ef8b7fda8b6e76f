#include <doctest/doctest.h>

#include <algorithm>
#include <variant>
#include <vector>

#include "spindle/device/device.hpp"
#include "support/rig.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using catalogue::Parameter;

namespace {

/// A tool with firmware 4000 or later, and what is asked of it.
struct Bench : test::DeviceRig {
  explicit Bench(const sim::DeviceOptions& how = {}) : Rig(test::product("doga-gen2"), how) {
    opened = connect();
    REQUIRE(opened.has_value());
  }

  device::Device& device() { return *opened; }

  [[nodiscard]] std::size_t writes_sent() const {
    return static_cast<std::size_t>(
        std::count_if(wire.requests.begin(), wire.requests.end(),
                      [](const auto& request) { return modbus::is_write(request.pdu.function); }));
  }

  Result<device::Device> opened = tl::unexpected(Error{});
};

}  // namespace

TEST_CASE("gen2: the tool says its model, its serial number and its version in registers") {
  Bench bench;
  REQUIRE(bench.device().require_known_registers());
  const auto& identity = bench.device().identity();
  REQUIRE(identity.has_value());
  CHECK(identity->tool_model == "BMT3216");
  CHECK(identity->serial == "2401190042");
  CHECK(identity->version == "4.0.2");
  CHECK(identity->firmware == 4002);
  CHECK(identity->notes.empty());
}

TEST_CASE("gen2: a tool with older firmware, or of another product, is refused") {
  Bench older({.firmware = 3999});
  const auto refused = older.device().require_known_registers();
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == Errc::wrong_generation);
  Bench other({.serial = 2401150042});
  CHECK_FALSE(other.device().require_known_registers().has_value());
}

TEST_CASE("gen2: everything that has a name can be read, and no read looks like an event") {
  Bench bench;
  const std::vector<Parameter> all = bench.profile.select({}).value();
  const auto readings = bench.device().read_each(all, device::Limits::skip);
  REQUIRE(readings.has_value());
  for (const device::Reading& reading : *readings) {
    CAPTURE(reading.parameter.name);
    CHECK(reading.value.has_value());
  }
  std::size_t reads = 0;
  for (const auto& request : bench.wire.requests) {
    const auto parsed = modbus::parse_request(request.pdu);
    const auto* read = parsed ? std::get_if<modbus::ReadRequest>(&*parsed) : nullptr;
    if (read == nullptr) continue;
    ++reads;
    CHECK_FALSE((read->table == modbus::RegisterTable::input && read->count == 107));
  }
  CHECK(reads <= 24);
}

TEST_CASE("gen2: what no document names is not written, and no request goes out") {
  Bench bench;
  REQUIRE(bench.device().require_known_registers());
  for (const std::uint16_t address : std::vector<std::uint16_t>{
           0, 23, 931, 999, 1037, 2395, 3652, 3744, 4002, 4003, 4100, 4500, 5002, 5351}) {
    CAPTURE(address);
    const auto written = bench.device().write_word({address}, 1);
    REQUIRE_FALSE(written.has_value());
    CHECK(written.error().code == Errc::read_only);
  }
  CHECK(bench.writes_sent() == 0);
  CHECK(bench.device().write_word({5001}, 1).has_value());
  CHECK(bench.writes_sent() == 1);
}

TEST_CASE("gen2: by whatever name it is asked for, the password is a secret and guarded") {
  const catalogue::Profile profile = test::product("doga-gen2").profile;
  for (const char* name : {"control.password", "@holding:3705", "@holding:3704/u32"}) {
    CAPTURE(name);
    const auto found = profile.find(name);
    REQUIRE(found.has_value());
    CHECK(found->secrecy == catalogue::Secrecy::secret);
    CHECK(found->guarding == catalogue::Guarding::alone);
  }
  CHECK(profile.find("@holding:3706").value().secrecy == catalogue::Secrecy::open);
}
