#pragma once

#include <string_view>

namespace spindle::cli {

inline constexpr std::string_view version = SPINDLE_VERSION;

}  // namespace spindle::cli
