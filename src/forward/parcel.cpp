#include "spindle/forward/parcel.hpp"

#include <fmt/format.h>

#include <string_view>

#include "spindle/base/percent.hpp"
#include "spindle/base/utf8.hpp"

namespace spindle::forward {
namespace {

constexpr std::int64_t numbers_of_epoch = 65'536;

std::string part(std::string_view text) {
  std::string safe;
  while (!text.empty()) {
    const CodePoint point = first_code_point(text);
    const std::string_view bytes = text.substr(0, point.length);
    const bool is_control = point.value < U' ' || (point.value >= 0x7F && point.value < 0xA0);
    const bool is_plain =
        point.well_formed && !is_control && point.value != U'/' && point.value != U'%';
    if (is_plain) safe += bytes;
    for (const char c : is_plain ? std::string_view() : bytes) safe += percent_encoded(c);
    text.remove_prefix(point.length);
  }
  return safe;
}

std::string bound(const std::optional<std::uint16_t>& number) {
  return number ? fmt::format("{}", *number) : std::string();
}

std::string name_of(const store::Gap& gap) {
  const std::string bounds = fmt::format("{}-{}", bound(gap.after), bound(gap.before));
  const bool is_numbered = gap.after || gap.before;
  return fmt::format("gap/{}/{}",
                     is_numbered ? bounds : fmt::format("{}", gap.began.time_since_epoch().count()),
                     part(gap.reason));
}

}  // namespace

std::int64_t sequence_number(std::int64_t epoch, std::uint16_t number) {
  return epoch * numbers_of_epoch + number;
}

std::string key_of(const Parcel& parcel) {
  const std::string tool =
      fmt::format("{}/{}/{}", part(parcel.tool.maker), part(parcel.tool.serial), parcel.epoch);
  if (const auto* event = parcel.event()) return fmt::format("{}/{}", tool, event->number);
  if (const auto* gap = parcel.gap()) return fmt::format("{}/{}", tool, name_of(*gap));
  return {};
}

}  // namespace spindle::forward
