#include "sim/register_bank.hpp"

#include <doctest/doctest.h>

#include <array>

#include "support/rig.hpp"

using namespace spindle;
using namespace spindle::sim;
using modbus::RegisterTable;

namespace {

constexpr RegisterTable holding = RegisterTable::holding;

RegisterBank bank_of(const test::Product& product) { return {product.profile, product.start}; }

/// What the value at this register would be with one word written to it.
Registers with_word(const RegisterBank& bank, std::uint16_t address, std::uint16_t word) {
  return bank.changes(holding, address, Registers{word}).front().registers;
}

}  // namespace

TEST_CASE("register bank: values begin as the start state says, at their default or least") {
  const RegisterBank bank = bank_of(test::product("servo-press"));
  CHECK(bank.get("depth") == -1200);
  CHECK(bank.get("speed") == 600);
  CHECK(bank.get("command") == 0);
  CHECK(bank.get("no-such-name") == 0);
  CHECK(bank.read(holding, 2, 2) == Registers{0xFFFF, 0xFB50});
}

TEST_CASE("register bank: what has no name does not exist, nor does what is absent") {
  auto product = test::product("servo-press");
  product.start.absent = {{.from = 3, .to = 4}};
  RegisterBank bank = bank_of(product);
  CHECK(bank.read(holding, 0, 3).has_value());
  CHECK(bank.read(holding, 0, 4) == std::nullopt);
  CHECK(bank.read(holding, 5, 1) == std::nullopt);
  CHECK(bank.read(holding, 65535, 2) == std::nullopt);
  CHECK(bank.cell_at(holding, 2) == nullptr);  // half of it is not there
  CHECK_FALSE(bank.has(RegisterTable::input));
  bank.put(holding, 4, 7);
  bank.fill({.from = 3, .to = 5});
  CHECK(bank.read(holding, 0, 6).has_value());
  CHECK(bank.cell_at(holding, 5) == nullptr);
}

TEST_CASE("register bank: a value of two registers is changed by either of them") {
  RegisterBank bank = bank_of(test::product("servo-press"));
  const Cell* depth = bank.cell_at(holding, 3);
  REQUIRE(depth == bank.cell_at(holding, 2));
  CHECK(with_word(bank, 3, 1) == Registers{0xFFFF, 1});
  CHECK(with_word(bank, 2, 0) == Registers{0, 0xFB50});
  CHECK_FALSE(depth->takes(with_word(bank, 2, 0)));
  bank.set_stored(depth->place, 50'000);
  CHECK(bank.get("depth") == 50'000);
  CHECK(depth->takes(Registers{0, 50'000}));
  CHECK_FALSE(depth->takes(Registers{0, 50'001}));
}

TEST_CASE("register bank: limits are signed, and leave out what is excepted") {
  const RegisterBank bank = bank_of(test::product("servo-press"));
  const Cell* zone = bank.cell_at(holding, 4);
  REQUIRE(zone != nullptr);
  const auto takes = [zone](int number) {
    return zone->takes(Registers{static_cast<std::uint16_t>(number)});
  };
  for (const int number : {-5, -2, 2, 5}) CHECK(takes(number));
  for (const int number : {-6, -1, 0, 1, 6}) CHECK_FALSE(takes(number));
}

TEST_CASE("register bank: where values are pairs, so is the register of an action") {
  const RegisterBank bank = bank_of(test::product("orientalmotor-blv"));
  const Cell* reset = bank.cell_at(holding, 0x0181);
  REQUIRE(reset != nullptr);
  CHECK(reset->place.address == 0x0180);
  CHECK(reset->place.end() == 0x0182);
}

TEST_CASE("register bank: parameters are copied, commands and measured values are not") {
  RegisterBank bank = bank_of(test::product("servo-press"));
  const Tables before = bank.tables();
  for (const char* name : {"command", "speed", "depth", "fault"}) bank.set(name, 2);
  constexpr std::array<std::string_view, 1> spared = {"speed"};
  bank.take_parameters(before, spared);
  CHECK(bank.get("speed") == 2);
  CHECK(bank.get("depth") == -1200);
  CHECK(bank.get("command") == 2);
  CHECK(bank.get("fault") == 2);
  bank.set_tables(before);
  CHECK(bank.get("speed") == 600);
}
