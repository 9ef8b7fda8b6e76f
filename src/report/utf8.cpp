#include "utf8.hpp"

#include <algorithm>

namespace spindle::report {
namespace {

constexpr std::string_view replacement_bytes = "\xEF\xBF\xBD";

constexpr bool is_plain(char character) {
  return character >= ' ' && character <= '~' && character != '"' && character != '\\';
}

}  // namespace

void append_first(std::string& out, const CodePoint& first, std::string_view text) {
  out += first.well_formed ? text.substr(0, first.length) : replacement_bytes;
}

std::size_t plain_prefix(std::string_view text) {
  const auto* const end = std::find_if_not(text.begin(), text.end(), is_plain);
  return static_cast<std::size_t>(end - text.begin());
}

}  // namespace spindle::report
