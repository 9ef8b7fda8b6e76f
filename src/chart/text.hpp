#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace spindle::chart {

inline constexpr double letter_height = 12;
inline constexpr double line_height = 15;

/// About how wide a text is drawn; the font is the reader's, so rather too much.
double text_width(std::string_view text, double size = letter_height);

/// The text, cut with an ellipsis where it would be wider.
std::string shortened(std::string_view text, double width, double size = letter_height);

/// "12 000": digits in groups of three from five digits on.
std::string grouped(std::uint64_t number);

/// "Torque, N.m".
std::string with_unit(std::string_view name, std::string_view unit);

}  // namespace spindle::chart
