#include "spindle/base/enum_table.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "spindle/catalogue/profile.hpp"

using namespace spindle;

namespace {

enum class Size : std::uint8_t { none, s1, m2, l3 };

constexpr auto sizes = enum_table<Size>(
    {{"small", Size::s1}, {"medium", Size::m2}, {"large", Size::l3}, {"", Size::none}});

/// Of what enum_table() refuses to compile.
template <typename E, std::size_t count>
constexpr bool is_complete(const EnumWord<E> (&rows)[count]) {
  return enum_words::are_complete(std::to_array(rows));
}

}  // namespace

TEST_CASE("a table reads what it writes") {
  for (const auto& [word, size] : sizes) {
    CHECK(sizes.text(size) == word);
    if (!word.empty()) CHECK(sizes.find(word) == size);
  }
  CHECK(sizes.find("Small") == std::nullopt);
  CHECK(sizes.find("smal") == std::nullopt);
}

TEST_CASE("what has no word is neither read nor listed") {
  CHECK(sizes.text(Size::none).empty());
  CHECK(sizes.find("") == std::nullopt);
  CHECK(sizes.words() == std::vector<std::string>{"small", "medium", "large"});
}

TEST_CASE("errors list the words in the order of the table") {
  CHECK(sizes.alternatives() == "small, medium or large");
  CHECK(enum_table<bool>({{"even", true}, {"any", false}}).alternatives() == "even or any");
  CHECK(enum_table<bool>({{"echoed", true}, {"", false}}).alternatives() == "echoed");
}

TEST_CASE("a table has each enumerator and each word once, or does not compile") {
  using enum Size;
  CHECK(is_complete<Size>({{"", none}, {"a", s1}, {"b", m2}, {"c", l3}}));
  CHECK_FALSE(is_complete<Size>({{"", none}, {"a", s1}, {"b", m2}}));
  CHECK_FALSE(is_complete<Size>({{"", none}, {"a", s1}, {"b", m2}, {"c", m2}}));
  CHECK_FALSE(is_complete<Size>({{"", none}, {"a", s1}, {"b", m2}, {"c", l3}, {"d", l3}}));
  CHECK_FALSE(is_complete<Size>({{"", none}, {"a", s1}, {"b", m2}, {"b", l3}}));
  CHECK_FALSE(is_complete<Size>({{"", none}, {"a", s1}, {"b", m2}, {"c", static_cast<Size>(9)}}));
  CHECK_FALSE(is_complete<bool>({{"true", true}}));
}

TEST_CASE("the words of the catalogue are those of profiles and records") {
  using namespace catalogue;
  CHECK(to_text(EventKind::fastening_ng) == "fastening-ng");
  CHECK(event_kind_words.find("Error") == std::nullopt);
  CHECK(kind_words.find("f16") == std::nullopt);
  CHECK(evidence_words.find("rumour") == std::nullopt);
  CHECK(to_text(Access::read_write) == "rw");
  CHECK(to_text(modbus::RegisterTable::input) == "input");
}
