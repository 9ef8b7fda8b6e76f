#include "spindle/catalogue/run_facts.hpp"

#include <bit>

namespace spindle::catalogue {

std::uint16_t RunFacts::selecting(std::uint16_t number) const {
  const unsigned shifted = unsigned{number} << static_cast<unsigned>(std::countr_zero(select));
  return static_cast<std::uint16_t>(shifted & select);
}

std::string numbered_name(const std::string& pattern, std::uint16_t number) {
  constexpr std::string_view counter = "{n}";
  std::string name = pattern;
  const std::size_t at = name.find(counter);
  if (at != std::string::npos) name.replace(at, counter.size(), std::to_string(number));
  return name;
}

}  // namespace spindle::catalogue
