#include "spindle/catalogue/parameter.hpp"

#include <array>
#include <limits>

namespace spindle::catalogue {
namespace {

struct KindInfo {
  Kind kind;
  std::string_view text;
  std::uint16_t registers;
  std::int64_t lowest;
  std::int64_t highest;
};

template <typename T>
constexpr KindInfo kind_info(Kind kind, std::string_view text) {
  constexpr std::size_t register_bytes = 2;
  return {kind, text, sizeof(T) / register_bytes, std::numeric_limits<T>::min(),
          std::numeric_limits<T>::max()};
}

constexpr std::array kinds = {
    kind_info<std::uint16_t>(Kind::u16, "u16"), kind_info<std::int16_t>(Kind::i16, "i16"),
    kind_info<std::uint32_t>(Kind::u32, "u32"), kind_info<std::int32_t>(Kind::i32, "i32")};

const KindInfo& info(Kind kind) { return kinds.at(static_cast<std::size_t>(kind)); }

constexpr std::array<std::string_view, 4> evidence_texts = {"manual", "transcribed", "sibling",
                                                            "inferred"};

constexpr std::array<std::string_view, 5> effect_texts = {
    "at-once", "after-stop", "after-configuration", "after-power-cycle", "unknown"};

}  // namespace

std::uint16_t register_count(Kind kind) { return info(kind).registers; }
std::int64_t lowest(Kind kind) { return info(kind).lowest; }
std::int64_t highest(Kind kind) { return info(kind).highest; }
std::string_view to_text(Kind kind) { return info(kind).text; }

std::optional<Kind> parse_kind(std::string_view text) {
  for (const KindInfo& candidate : kinds) {
    if (candidate.text == text) return candidate.kind;
  }
  return std::nullopt;
}

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

std::string_view to_text(Hazard hazard) {
  switch (hazard) {
    case Hazard::none:
      return "none";
    case Hazard::moves:
      return "moves";
    case Hazard::locks:
      return "locks";
    case Hazard::unclear:
      return "unclear";
    case Hazard::erases:
      return "erases";
    case Hazard::link:
      return "link";
  }
  return "";
}

std::string_view to_text(Effect effect) {
  return effect_texts.at(static_cast<std::size_t>(effect));
}

std::string_view to_text(Evidence evidence) {
  return evidence_texts.at(static_cast<std::size_t>(evidence));
}

std::optional<Evidence> parse_evidence(std::string_view text) {
  for (std::size_t i = 0; i < evidence_texts.size(); ++i) {
    if (evidence_texts.at(i) == text) return static_cast<Evidence>(i);
  }
  return std::nullopt;
}

std::string_view to_text(Access access) { return access == Access::read_only ? "r" : "rw"; }

std::string_view to_text(modbus::RegisterTable table) {
  return table == modbus::RegisterTable::holding ? "holding" : "input";
}

}  // namespace spindle::catalogue
