#include "spindle/base/decimal.hpp"

#include <doctest/doctest.h>

#include <array>
#include <limits>
#include <string>

using namespace spindle;

namespace {

constexpr auto largest = std::numeric_limits<std::int64_t>::max();
constexpr auto smallest = std::numeric_limits<std::int64_t>::min();
constexpr int steepest = std::numeric_limits<int>::max();

}  // namespace

TEST_CASE("decimals are read exactly and keep their number of decimals") {
  struct Case {
    std::string_view text;
    std::int64_t mantissa;
    int exponent;
    std::string_view shown;
  };
  for (const auto& row : {
           Case{"0", 0, 0, "0"},
           Case{"-12", -12, 0, "-12"},
           Case{"2.71", 271, -2, "2.71"},
           Case{"10.00", 1000, -2, "10.00"},
           Case{"+0.5", 5, -1, "0.5"},
           Case{".5", 5, -1, "0.5"},
           Case{"-.05", -5, -2, "-0.05"},
           Case{"0.00", 0, -2, "0.00"},
           Case{"-0", 0, 0, "0"},
           Case{"007", 7, 0, "7"},
           Case{"000000000000000000001", 1, 0, "1"},
           Case{"999999999999999999", 999999999999999999, 0, "999999999999999999"},
           Case{"0.000000000000000001", 1, -18, "0.000000000000000001"},
           Case{"100000000000000000000", 1, 20, "100000000000000000000"},
           Case{"0.0000000000000000000001", 1, -22, "0.0000000000000000000001"},
       }) {
    const auto& [text, mantissa, exponent, shown] = row;
    CAPTURE(row.text);
    const auto decimal = Decimal::parse(text);
    REQUIRE(decimal);
    CHECK(decimal->mantissa() == mantissa);
    CHECK(decimal->exponent() == exponent);
    CHECK(decimal->to_string() == shown);
  }
}

TEST_CASE("what is not a plain decimal number is rejected") {
  for (const std::string_view text :
       {"", "-", "+", ".", "-.", "1.", "+-1", "--1", "1e3", "0x1", "1,5", " 1", "1 ", "1.2.3", "1-",
        "nan", "18446744073709551616", "-18446744073709551616", "1844674407370955161.60"}) {
    CAPTURE(text);
    CHECK_FALSE(Decimal::parse(text));
  }
}

TEST_CASE("text is plain notation") {
  CHECK(Decimal(12, 2).to_string() == "1200");
  CHECK(Decimal(-12, 2).to_string() == "-1200");
  CHECK(Decimal(0, 2).to_string() == "0");
  CHECK(Decimal(271, -2).to_string() == "2.71");
  CHECK(Decimal(-5, -2).to_string() == "-0.05");
  CHECK(Decimal(-100, -2).to_string() == "-1.00");
  CHECK(Decimal(smallest, 0).to_string() == "-9223372036854775808");
  CHECK(Decimal(smallest, -19).to_string() == "-0.9223372036854775808");
}

TEST_CASE("every 16-bit word with every usual number of decimals is read back") {
  for (int decimals = 0; decimals <= 9; ++decimals) {
    for (std::int64_t word = -0x8000; word <= 0xFFFF; word += 7) {
      const Decimal decimal(word, -decimals);
      const auto again = Decimal::parse(decimal.to_string());
      REQUIRE(again);
      REQUIRE(again->mantissa() == word);
      REQUIRE(again->exponent() == -decimals);
    }
  }
}

TEST_CASE("order is numeric, whatever the exponents") {
  const std::array ascending = {Decimal(smallest, steepest),
                                Decimal(-1, steepest),
                                Decimal(smallest, 0),
                                Decimal(smallest + 1, 0),
                                Decimal(-10, 0),
                                Decimal(-999, -2),
                                Decimal(-1, -steepest),
                                Decimal(0, 5),
                                Decimal(1, -steepest),
                                Decimal(largest, -steepest),
                                Decimal(5, -2),
                                Decimal(499, -3),
                                Decimal(5, -1),
                                Decimal(271, -2),
                                Decimal(999, -2),
                                Decimal(10, 0),
                                Decimal(10001, -3),
                                Decimal(922337203685477580, 1),
                                Decimal(largest, 0),
                                Decimal(1, 19),
                                Decimal(1, steepest),
                                Decimal(largest - 1, steepest),
                                Decimal(largest, steepest)};
  for (std::size_t i = 0; i < ascending.size(); ++i) {
    for (std::size_t j = 0; j < ascending.size(); ++j) {
      CAPTURE(i);
      CAPTURE(j);
      CHECK((ascending[i] <=> ascending[j]) == (i <=> j));
      CHECK((ascending[i] == ascending[j]) == (i == j));
    }
  }
}

TEST_CASE("equality ignores how a number is written") {
  CHECK(Decimal(1000, -2) == Decimal(10));
  CHECK(Decimal(1, 1) == Decimal(10));
  CHECK(Decimal(0, -9) == Decimal(0, 9));
  CHECK(Decimal(1, 18) == Decimal(1000000000000000000));
  CHECK(Decimal(-100, -3) == Decimal(-1, -1));
  CHECK(Decimal(1, 0) != Decimal(-1, 0));
}

TEST_CASE("products are exact or absent") {
  const auto product = Decimal(271).times(Decimal(1, -2));
  REQUIRE(product);
  CHECK(product->to_string() == "2.71");
  CHECK(Decimal(-3, 2).times(Decimal(25, -1)) == Decimal(-750));
  CHECK(Decimal(largest).times(Decimal(2))->to_string() == "18446744073709551614");
  CHECK_FALSE(Decimal(largest).times(Decimal(3)));
  CHECK(Decimal(smallest).times(Decimal(-1))->to_string() == "9223372036854775808");
  CHECK_FALSE(Decimal(smallest).times(Decimal(-2)));
  CHECK_FALSE(Decimal(1, steepest).times(Decimal(1, 1)));
}

TEST_CASE("a quotient is the whole number of steps, or absent") {
  struct Case {
    Decimal value;
    Decimal unit;
    std::optional<std::int64_t> steps;
  };
  const Case cases[] = {
      {Decimal(271, -2), Decimal(1, -2), 271},
      {Decimal(27, -1), Decimal(1, -2), 270},
      {Decimal(2715, -3), Decimal(1, -2), std::nullopt},
      {Decimal(2710, -3), Decimal(1, -2), 271},
      {Decimal(15, -1), Decimal(5, -1), 3},
      {Decimal(16, -1), Decimal(5, -1), std::nullopt},
      {Decimal(1), Decimal(3), std::nullopt},
      {Decimal(1), Decimal(3, -1), std::nullopt},
      {Decimal(10, -1), Decimal(3), std::nullopt},
      {Decimal(1), Decimal(25, -2), 4},
      {Decimal(-1), Decimal(25, -2), -4},
      {Decimal(-6), Decimal(-2), 3},
      {Decimal(0, -2), Decimal(7, 3), 0},
      {Decimal(1000), Decimal(1, 3), 1},
      {Decimal(1001), Decimal(1, 3), std::nullopt},
      {Decimal(largest), Decimal(1), largest},
      {Decimal(smallest), Decimal(1), smallest},
      {Decimal(smallest), Decimal(-1), std::nullopt},
      {Decimal(largest), Decimal(1, -1), std::nullopt},
      {Decimal(1000000000000000000, 3), Decimal(100000), 10000000000000000},
      {Decimal(1, 30), Decimal(1, 30), 1},
      {Decimal(1, steepest), Decimal(1, -steepest), std::nullopt},
      {Decimal(1, -steepest), Decimal(1, steepest), std::nullopt},
      {Decimal(1), Decimal(0), std::nullopt},
  };
  for (const auto& row : cases) {
    const auto& [value, unit, steps] = row;
    CAPTURE(row.value.mantissa());
    CAPTURE(row.unit.mantissa());
    CHECK(value.divided_by(unit) == steps);
  }
}

TEST_CASE("unsigned numbers of 64 bits are read, compared and shown whole") {
  const auto most = Decimal::parse("18446744073709551615");
  REQUIRE(most);
  CHECK(most->magnitude() == std::numeric_limits<std::uint64_t>::max());
  CHECK(most->to_string() == "18446744073709551615");
  CHECK(most->mantissa() == largest);
  CHECK(most->negated().to_string() == "-18446744073709551615");
  CHECK(most->negated().mantissa() == smallest);
  CHECK(Decimal(largest) < *most);
  CHECK(most->negated() < Decimal(smallest));
  CHECK(Decimal(1844674407370955161, 1) < *most);
  CHECK(Decimal(1844674407370955162, 1) > *most);
  CHECK_FALSE(most->plus(Decimal(1)));
  CHECK(most->plus(Decimal(-1))->to_string() == "18446744073709551614");
}

TEST_CASE("sums are exact") {
  CHECK(Decimal(271, -2).plus(Decimal(-4, 1))->to_string() == "-37.29");
  CHECK(Decimal(5, -1).plus(Decimal(5, -1))->to_string() == "1.0");
  CHECK(Decimal(-5, -1).plus(Decimal(5, -1))->to_string() == "0.0");
  CHECK(Decimal(7).plus(Decimal(0, 3))->to_string() == "7");
  CHECK(Decimal(7).plus(Decimal(0, -2))->to_string() == "7.00");
  CHECK_FALSE(Decimal(1, 30).plus(Decimal(1)));
}

TEST_CASE("rounding keeps the nearest number, and takes a half away from zero") {
  struct Case {
    Decimal number;
    int decimals;
    std::string_view shown;
  };
  for (const Case& row :
       {Case{Decimal(2715, -3), 2, "2.72"}, Case{Decimal(-2715, -3), 2, "-2.72"},
        Case{Decimal(2714, -3), 2, "2.71"}, Case{Decimal(4, -1), 0, "0"},
        Case{Decimal(5, -1), 0, "1"}, Case{Decimal(-4, -1), 0, "0"},
        Case{Decimal(5, -30), 2, "0.00"},
        Case{Decimal(99, -30), 29, "0.00000000000000000000000000010"}, Case{Decimal(2), 2, "2.00"},
        Case{Decimal(2, 3), 1, "2000.0"}, Case{Decimal(1, 25), 1, "10000000000000000000000000"}}) {
    CAPTURE(row.shown);
    CHECK(row.number.with_decimals(row.decimals).to_string() == row.shown);
  }
}
