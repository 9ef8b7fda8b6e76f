#include "spindle/catalogue/document_number.hpp"

#include <fmt/format.h>

#include <array>

#include "spindle/base/text.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::catalogue {
namespace {

using modbus::RegisterAddress;
using modbus::RegisterTable;

/// Numbers of one table, in one of the two usual lengths.
struct Numbering {
  std::uint64_t first;
  std::uint64_t last;
  modbus::RegisterTable table;
};

constexpr std::array<Numbering, 4> numberings = {{{40001, 49999, modbus::RegisterTable::holding},
                                                  {30001, 39999, modbus::RegisterTable::input},
                                                  {400001, 465536, modbus::RegisterTable::holding},
                                                  {300001, 365536, modbus::RegisterTable::input}}};

}  // namespace

std::string hint_for_document_number(std::uint64_t number) {
  for (const Numbering& numbering : numberings) {
    if (number < numbering.first || number > numbering.last) continue;
    return fmt::format("registers count from 0: {} in a document is @{}:{}", number,
                       to_text(numbering.table), number - numbering.first);
  }
  return {};
}

std::optional<NumberedPlace> parse_document_number(std::string_view text) {
  constexpr std::size_t short_form = 5;
  constexpr std::size_t long_form = 6;
  constexpr std::uint64_t last_short = 9'999;
  constexpr std::uint64_t last_long = 65'536;
  const bool is_digits =
      !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  if (!is_digits || text.size() > long_form) return std::nullopt;
  const bool is_long = text.size() == long_form;
  // Of a number with fewer digits the zeros in front of it, which mean a coil, were left out.
  const char digit = text.size() >= short_form ? text.front() : '0';
  std::string_view rest = text.size() >= short_form ? text.substr(1) : text;
  while (rest.size() > 1 && rest.front() == '0') rest.remove_prefix(1);
  const auto number = parse_unsigned(rest, is_long ? last_long : last_short);
  if (!number || *number == 0) return std::nullopt;
  const RegisterAddress address{static_cast<std::uint16_t>(*number - 1)};
  switch (digit) {
    case '0':
      return NumberedPlace{RegisterTable::coil, address};
    case '1':
      return NumberedPlace{RegisterTable::discrete, address};
    case '3':
      return NumberedPlace{RegisterTable::input, address};
    case '4':
      return NumberedPlace{RegisterTable::holding, address};
    default:
      return std::nullopt;
  }
}

std::string hint_for_document_number(std::string_view typed) {
  const auto slash = typed.find('/');
  std::string_view digits = typed.substr(0, slash);
  if (digits.starts_with('@')) digits.remove_prefix(1);
  if (const auto colon = digits.find(':'); colon != std::string_view::npos) {
    digits.remove_prefix(colon + 1);
  }
  constexpr std::uint64_t highest = 999'999;
  const auto number = parse_unsigned(digits, highest);
  std::string hint = number ? hint_for_document_number(*number) : std::string();
  if (!hint.empty() && slash != std::string_view::npos) hint += typed.substr(slash);
  return hint;
}

}  // namespace spindle::catalogue
