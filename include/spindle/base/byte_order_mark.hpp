#pragma once

#include <string_view>

namespace spindle {

/// What some editors put in front of a text, and is no part of it.
constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

}  // namespace spindle
