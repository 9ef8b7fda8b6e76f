#include "spindle/catalogue/run_facts.hpp"

#include <algorithm>
#include <bit>

namespace spindle::catalogue {
namespace {

std::uint16_t bit_of(std::size_t number) { return static_cast<std::uint16_t>(1U << number); }

std::uint16_t joined(unsigned a, unsigned b) { return static_cast<std::uint16_t>(a | b); }

}  // namespace

const InputFunction* InputSpec::find(std::int64_t number) const {
  const auto found =
      std::find_if(functions.begin(), functions.end(),
                   [number](const InputFunction& function) { return function.number == number; });
  return found == functions.end() ? nullptr : &*found;
}

CommandBits::CommandBits() {
  for (std::size_t bit = 0; bit < functions_.size(); ++bit) functions_[bit] = bit_of(bit);
}

CommandBits::CommandBits(const InputSpec& facts, std::span<const std::int64_t> numbers) {
  for (std::size_t bit = 0; bit < functions_.size(); ++bit) {
    const bool is_read = bit >= facts.first && bit - facts.first < numbers.size();
    const InputFunction* function = is_read ? facts.find(numbers[bit - facts.first]) : nullptr;
    if (function == nullptr) {
      unknown_ = joined(unknown_, bit_of(bit));
    } else if (function->bit) {
      functions_[bit] = bit_of(*function->bit);
    }
  }
}

std::optional<std::uint16_t> CommandBits::word(std::uint16_t standard) const {
  std::uint16_t word = 0;
  std::uint16_t found = 0;
  for (std::size_t bit = 0; bit < functions_.size(); ++bit) {
    const unsigned wanted = unsigned{functions_[bit]} & standard & ~unsigned{found};
    if (wanted == 0) continue;  // one bit is enough for a function that several have
    word = joined(word, bit_of(bit));
    found = joined(found, wanted);
  }
  if (found != standard) return std::nullopt;
  return word;
}

std::optional<std::uint16_t> CommandBits::standard(std::uint16_t word) const {
  if ((word & unknown_) != 0) return std::nullopt;
  std::uint16_t standard = 0;
  for (std::size_t bit = 0; bit < functions_.size(); ++bit) {
    if ((word & bit_of(bit)) != 0) standard = joined(standard, functions_[bit]);
  }
  return standard;
}

std::uint16_t CommandBits::any_of(std::uint16_t standard) const {
  std::uint16_t mask = unknown_;
  for (std::size_t bit = 0; bit < functions_.size(); ++bit) {
    if ((functions_[bit] & standard) != 0) mask = joined(mask, bit_of(bit));
  }
  return mask;
}

std::uint16_t CommandWordSpec::selecting(std::uint16_t number) const {
  const unsigned shifted = unsigned{number} << static_cast<unsigned>(std::countr_zero(select));
  return static_cast<std::uint16_t>(shifted & select);
}

bool RunSpec::is_command(std::string_view parameter) const {
  if (const auto* by_word = word()) return parameter == by_word->command;
  const auto* by_register = command_register();
  if (by_register == nullptr || parameter.empty()) return false;
  return parameter == by_register->command || parameter == by_register->enable.parameter ||
         parameter == by_register->stop_register;
}

std::string numbered_name(std::string_view pattern, std::uint16_t number) {
  constexpr std::string_view counter = "{n}";
  std::string name(pattern);
  const std::size_t at = name.find(counter);
  if (at != std::string::npos) name.replace(at, counter.size(), std::to_string(number));
  return name;
}

}  // namespace spindle::catalogue
