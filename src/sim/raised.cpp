#include "spindle/sim/raised.hpp"

#include <fmt/format.h>

#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"

namespace spindle::sim {
namespace {

/// Documents write hexadecimal codes with an 'h' behind them.
std::optional<std::uint64_t> parse_code(std::string_view text, std::uint16_t highest) {
  const bool is_hexadecimal = text.ends_with('h') || text.ends_with('H');
  if (!is_hexadecimal) return parse_unsigned(text, highest);
  return parse_unsigned(fmt::format("0x{}", text.substr(0, text.size() - 1)), highest);
}

}  // namespace

Result<Raised> parse_raised(std::string_view text, std::uint16_t highest) {
  const auto at = text.find('@');
  const std::string_view number = text.substr(0, at);
  const auto code = parse_code(number, highest);
  if (!code || *code == 0) {
    return tl::unexpected(
        Error{.code = Errc::bad_value,
              .message = fmt::format("'{}' is no code from 1 to {}", number, highest),
              .hint = "write it like 30h, 0x30 or 48; 30h@5s comes after five seconds"});
  }
  Raised raised{.code = static_cast<std::uint16_t>(*code)};
  if (at == std::string_view::npos) return raised;
  TRY_LET(const auto after, parse_duration(text.substr(at + 1)));
  raised.after = after;
  return raised;
}

}  // namespace spindle::sim
