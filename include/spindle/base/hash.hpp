#pragma once

#include <cstdint>
#include <string_view>

namespace spindle {

/// Where a hash begins that goes on over several texts.
inline constexpr std::uint64_t hash_begin = 0xCBF29CE484222325U;

/// A number that is made of a text and stays the same for ever: FNV-1a with 64 bits, by its
/// authors' parameters (Fowler, Noll, Vo). To tell names apart, not to guard anything. `from`: the
/// hash of what stands before.
constexpr std::uint64_t hash_of(std::string_view text, std::uint64_t from = hash_begin) {
  constexpr std::uint64_t prime = 0x100000001B3U;
  for (const char c : text) from = (from ^ static_cast<unsigned char>(c)) * prime;
  return from;
}

}  // namespace spindle
