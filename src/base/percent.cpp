#include "spindle/base/percent.hpp"

#include <fmt/format.h>

#include "spindle/base/text.hpp"

namespace spindle {

std::string percent_encoded(char byte) {
  return fmt::format("%{:02X}", static_cast<unsigned char>(byte));
}

std::optional<std::string> percent_decoded(std::string_view text) {
  std::string plain;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] != '%') {
      plain += text[at];
      continue;
    }
    const auto byte = parse_unsigned(fmt::format("0x{}", text.substr(at + 1, 2)), 0xFF);
    if (!byte || at + 2 >= text.size()) return std::nullopt;
    plain += static_cast<char>(*byte);
    at += 2;
  }
  return plain;
}

}  // namespace spindle
