#include "result_key.hpp"

#include "spindle/base/text.hpp"

namespace spindle::commands {

std::optional<ResultKey> parse_result_key(const std::string& text) {
  const auto second = text.rfind('/');
  const auto first =
      second == std::string::npos || second == 0 ? second : text.rfind('/', second - 1);
  const bool has_parts = first != std::string::npos && first != second && first > 0;
  if (!has_parts) return std::nullopt;
  const std::string_view whole = text;
  const auto epoch = parse_unsigned(whole.substr(first + 1, second - first - 1), 1'000'000'000);
  const auto number = parse_unsigned(whole.substr(second + 1), 65'535);
  if (!epoch || !number) return std::nullopt;
  return ResultKey{.serial = text.substr(0, first),
                   .epoch = static_cast<std::int64_t>(*epoch),
                   .number = static_cast<std::uint16_t>(*number)};
}

}  // namespace spindle::commands
