#include "mqtt_topics.hpp"

#include <fmt/format.h>

#include "spindle/base/hash.hpp"
#include "spindle/base/percent.hpp"
#include "spindle/base/utf8.hpp"

namespace spindle::forward {
namespace {

constexpr std::size_t longest_level = 200;
constexpr std::size_t kept_of_long = 160;

bool is_plain(const CodePoint& point, bool is_first) {
  if (!point.well_formed) return false;
  if (is_first && point.value == U'_') return false;
  const bool is_control = point.value <= U' ' || (point.value >= 0x7F && point.value <= 0xA0);
  const bool is_noncharacter =
      (point.value >= 0xFDD0 && point.value <= 0xFDEF) || (point.value & 0xFFFE) == 0xFFFE;
  const bool is_special =
      point.value < 0x80 &&
      std::string_view("+#/%$").find(static_cast<char>(point.value)) != std::string_view::npos;
  return !is_control && !is_noncharacter && !is_special;
}

}  // namespace

std::string level_of(std::string_view name) {
  if (name.empty()) return "%";
  std::string level;
  for (std::string_view rest = name; !rest.empty();) {
    const CodePoint point = first_code_point(rest);
    const std::string_view bytes = rest.substr(0, point.length);
    if (is_plain(point, rest.size() == name.size())) {
      level += bytes;
    } else {
      for (const char c : bytes) level += percent_encoded(c);
    }
    rest.remove_prefix(point.length);
  }
  if (level.size() <= longest_level) return level;
  std::size_t kept = kept_of_long;
  while (kept > 0 && (static_cast<unsigned char>(level[kept]) & 0xC0U) == 0x80U) --kept;
  return fmt::format("{}%~{:016x}", level.substr(0, kept), hash_of(name));
}

std::string Topics::of_tool(std::string_view target, std::string_view what) const {
  return fmt::format("{}/{}/{}", base_, level_of(target), what);
}

std::string Topics::of_collector(std::string_view name) const {
  return fmt::format("{}/_collector/{}/status", base_, level_of(name));
}

}  // namespace spindle::forward
