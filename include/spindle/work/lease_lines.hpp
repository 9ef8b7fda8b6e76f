#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/store/rows.hpp"

namespace spindle::work {

/// What a recorder and the program that keeps its leases say to each other, a line each. Questions:
///   hold ID TTL_MS TOOL…            renew what is held, and take what is free
///   last ID MAKER SERIAL            the last that a tool told any collector
///   release ID TOOL…                give these back
/// Answers, by the ID of the question:
///   held ID TOOL FENCE TOOL FENCE…  all that is held now, each with the number of its lease
///   told ID EPOCH NUMBER SEEN_MS RAW   RAW: hexadecimal, or "-" where no row holds it
///   nothing ID                      it never told anything; what was given back is free
///   failed ID TEXT
struct LeaseLine {
  std::string verb = {};
  std::uint64_t id = 0;
  std::vector<std::string> words = {};
};

/// Bytes of words that would end a word or a line are written as %HH.
std::string to_line(const LeaseLine& line);
/// Empty for what is none.
std::optional<LeaseLine> lease_line_of(std::string_view line);

/// The words of `told`.
std::vector<std::string> words_of(const store::Last& last);
/// Empty for what is none.
std::optional<store::Last> last_of(const std::vector<std::string>& words);

}  // namespace spindle::work
