#include "spindle/catalogue/document_number.hpp"

#include <fmt/format.h>

#include <array>

#include "spindle/base/text.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::catalogue {
namespace {

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
