#pragma once

#include <cstddef>

namespace spindle {

/// Cells of a terminal that a character takes: none, one or two. The same in every locale.
std::size_t cell_width(char32_t character);

/// Whether it does something to a terminal, or to the text around it, that is not seen in itself:
/// control characters, and those that turn the direction of writing, break lines or are invisible.
bool is_unsafe_on_terminal(char32_t character);

}  // namespace spindle
