#include "spindle/catalogue/parameter.hpp"

#include <array>
#include <limits>

namespace spindle::catalogue {
namespace {

struct KindInfo {
  std::uint16_t registers;
  std::int64_t lowest;
  std::int64_t highest;
};

template <typename T>
constexpr KindInfo kind_info() {
  constexpr std::size_t register_bytes = 2;
  return {sizeof(T) / register_bytes, std::numeric_limits<T>::min(), std::numeric_limits<T>::max()};
}

/// In the order of the enumeration.
constexpr std::array kinds = {kind_info<std::uint16_t>(), kind_info<std::int16_t>(),
                              kind_info<std::uint32_t>(), kind_info<std::int32_t>()};

const KindInfo& info(Kind kind) { return kinds.at(static_cast<std::size_t>(kind)); }

}  // namespace

std::uint16_t register_count(Kind kind) { return info(kind).registers; }
std::int64_t lowest(Kind kind) { return info(kind).lowest; }
std::int64_t highest(Kind kind) { return info(kind).highest; }

std::vector<std::string> to_strings(const List<Text>& texts) {
  return {texts.begin(), texts.end()};
}

Parameter with_bits_for(Parameter parameter, std::optional<std::int64_t> value) {
  std::vector<BitName> counting;
  for (const BitName& name : parameter.bits) {
    if (!name.when || name.when == value) counting.push_back({name.bit, name.text});
  }
  parameter.bits = std::move(counting);
  parameter.bits_by = {};
  return parameter;
}

}  // namespace spindle::catalogue
