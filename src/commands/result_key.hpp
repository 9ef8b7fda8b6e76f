#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace spindle::commands {

/// What names a result for ever.
struct ResultKey {
  std::string serial = {};
  std::int64_t epoch = 0;
  std::uint16_t number = 0;
};

/// Of "1021100042/0/1962"; empty where it is none. A serial number may hold strokes of its own.
std::optional<ResultKey> parse_result_key(const std::string& text);

inline constexpr std::string_view result_key_hint =
    "write SERIAL/EPOCH/NUMBER as JSON has them: 1021100042/0/1962";

}  // namespace spindle::commands
