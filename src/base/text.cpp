#include "spindle/base/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <numeric>
#include <tuple>
#include <utility>

namespace spindle {
namespace {

// The set of a bracket expression such as "[!a-z]".
struct Bracket {
  std::string_view members;
  std::size_t length = 0;  // of the whole expression in the pattern
  bool negated = false;
};

// `pattern` begins with '['. Empty when the bracket is never closed.
std::optional<Bracket> read_bracket(std::string_view pattern) {
  Bracket bracket;
  std::size_t first = 1;
  if (pattern.substr(first).starts_with('!')) {
    bracket.negated = true;
    ++first;
  }
  const std::size_t close = pattern.find(']', first + 1);  // a ']' in the first place is a member
  if (close == std::string_view::npos) return std::nullopt;
  bracket.members = pattern.substr(first, close - first);
  bracket.length = close + 1;
  return bracket;
}

bool contains(std::string_view members, char c) {
  const auto code = [](char member) { return static_cast<unsigned char>(member); };
  while (!members.empty()) {
    const bool is_range = members.size() >= 3 && members[1] == '-';
    const char last = is_range ? members[2] : members[0];
    if (code(members[0]) <= code(c) && code(c) <= code(last)) return true;
    members.remove_prefix(is_range ? 3 : 1);
  }
  return false;
}

// How much of the pattern matches one character `c`; 0 when it does not match.
std::size_t match_one(std::string_view pattern, char c) {
  if (pattern.empty()) return 0;
  if (pattern.front() == '?') return 1;
  if (pattern.front() == '[') {
    if (const auto bracket = read_bracket(pattern)) {
      return contains(bracket->members, c) != bracket->negated ? bracket->length : 0;
    }
  }
  return pattern.front() == c ? 1 : 0;
}

// Damerau-Levenshtein in its restricted form: no part is edited twice.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_previous(b.size() + 1);
  std::vector<std::size_t> previous(b.size() + 1);
  std::vector<std::size_t> current(b.size() + 1);
  std::iota(previous.begin(), previous.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = previous[j - 1] + (a[i - 1] == b[j - 1] ? 0U : 1U);
      current[j] = std::min({previous[j] + 1, current[j - 1] + 1, replaced});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) current[j] = std::min(current[j], before_previous[j - 2] + 1);
    }
    std::swap(before_previous, previous);
    std::swap(previous, current);
  }
  return previous[b.size()];
}

/// Length of the dotted head that both texts share: "preset.1." of "preset.1.speed".
std::size_t shared_head(std::string_view a, std::string_view b) {
  std::size_t head = 0;
  for (std::size_t at = 0; at < a.size() && at < b.size() && a[at] == b[at]; ++at) {
    if (a[at] == '.') head = at + 1;
  }
  return head;
}

std::size_t whole_distance(std::string_view word, std::string_view candidate) {
  return distance(word, candidate);
}

/// Distance to the nearest of the candidate's hyphenated parts: "torqe" is near "target-torque".
std::size_t part_distance(std::string_view word, std::string_view candidate) {
  std::size_t nearest = candidate.size() + word.size();
  for (const std::string_view part : split(candidate, '-')) {
    nearest = std::min(nearest, distance(word, part));
  }
  return nearest;
}

std::string digits_of(std::string_view text) {
  std::string digits;
  std::copy_if(text.begin(), text.end(), std::back_inserter(digits),
               [](char c) { return c >= '0' && c <= '9'; });
  return digits;
}

/// A name with other numbers is another thing, not another spelling.
bool names_another(std::string_view word, std::string_view candidate) {
  const std::string typed = digits_of(word);
  const std::string known = digits_of(candidate);
  return !typed.empty() && !known.empty() && typed != known;
}

/// Sorted, so that swapped ones are the same.
std::string letters_of(std::string_view text) {
  std::string letters;
  for (const char c : text) {
    if (c >= 'A' && c <= 'Z') letters += static_cast<char>(c - 'A' + 'a');
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) letters += c;
  }
  std::sort(letters.begin(), letters.end());
  return letters;
}

/// The first of the nearest candidates that is near enough. What both names share up to a dot says
/// nothing about how near the rest is.
template <typename Distance>
const std::string* nearest_by(std::string_view word, const std::vector<std::string>& candidates,
                              Distance distance_of) {
  const std::string* nearest = nullptr;
  std::size_t best = word.size();
  for (const std::string& candidate : candidates) {
    if (names_another(word, candidate)) continue;
    const std::size_t head = shared_head(word, candidate);
    const std::string_view rest = word.substr(head);
    const std::size_t far = distance_of(rest, std::string_view(candidate).substr(head));
    if (far > std::max<std::size_t>(1, rest.size() / 3)) continue;
    if (nearest != nullptr && far >= best) continue;
    nearest = &candidate;
    best = far;
  }
  return nearest;
}

}  // namespace

bool glob_match(std::string_view pattern, std::string_view text) {
  // Most names differ from a pattern already at an end of it.
  const auto is_special = [](char c) { return c == '*' || c == '?' || c == '[' || c == ']'; };
  while (!pattern.empty() && !text.empty() && !is_special(pattern.back())) {
    if (pattern.back() != text.back()) return false;
    pattern.remove_suffix(1);
    text.remove_suffix(1);
  }
  // On a mismatch only the last star needs to take one character more: whatever an earlier one
  // took, the later one can make up for.
  std::optional<std::pair<std::string_view, std::string_view>> after_star;
  while (!text.empty()) {
    if (pattern.starts_with('*')) {
      pattern.remove_prefix(1);
      after_star = {pattern, text};
    } else if (const std::size_t matched = match_one(pattern, text.front()); matched > 0) {
      pattern.remove_prefix(matched);
      text.remove_prefix(1);
    } else if (after_star) {
      after_star->second.remove_prefix(1);
      std::tie(pattern, text) = *after_star;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*') == std::string_view::npos;
}

bool same_ignoring_case(std::string_view a, std::string_view b) {
  const auto lower = [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](char x, char y) { return lower(x) == lower(y); });
}

bool is_pattern(std::string_view text) {
  return text.find_first_of("*?[") != std::string_view::npos;
}

std::optional<std::string> closest(std::string_view word,
                                   const std::vector<std::string>& candidates) {
  if (const std::string* nearest = nearest_by(word, candidates, whole_distance)) return *nearest;
  if (const std::string* nearest = nearest_by(word, candidates, part_distance)) return *nearest;
  return std::nullopt;
}

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  const auto nearest = closest(word, candidates);
  return nearest ? "did you mean '" + *nearest + "'?" : std::string{};
}

std::string same_word(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string letters = letters_of(word);
  for (const std::string& candidate : candidates) {
    if (letters_of(candidate) == letters) return "did you mean '" + candidate + "'?";
  }
  return {};
}

std::optional<std::uint64_t> parse_unsigned(std::string_view text, std::uint64_t maximum) {
  const bool hexadecimal = text.starts_with("0x");
  if (hexadecimal) text.remove_prefix(2);
  std::uint64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [stopped, problem] = std::from_chars(text.data(), end, number, hexadecimal ? 16 : 10);
  if (problem != std::errc{} || stopped != end || number > maximum) return std::nullopt;
  return number;
}

std::string with_article(std::string_view name) {
  const auto is_lower = [](char c) { return c >= 'a' && c <= 'z'; };
  // A word is read as one; capitals and digits are spelt, and "F" is spoken "ef".
  const bool is_word = name.size() > 1 && (is_lower(name[0]) || is_lower(name[1]));
  const std::string_view vowels = is_word ? "AEIOaeio" : "AEFHILMNORSX8";
  const bool begins_with_vowel =
      !name.empty() && vowels.find(name.front()) != std::string_view::npos;
  return fmt::format("{} {}", begins_with_vowel ? "an" : "a", name);
}

std::string counted(std::size_t count, std::string_view noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

std::string shell_word(const std::string& text) {
  const auto is_harmless = [](char c) {
    constexpr std::string_view others = "._-/:@=+,";
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           others.find(c) != std::string_view::npos;
  };
  if (!text.empty() && std::all_of(text.begin(), text.end(), is_harmless)) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string shown_command(const std::string& command) {
  return command.find('\'') == std::string::npos ? "'" + command + "'" : command;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t at = text.find(separator);
    parts.push_back(text.substr(0, at));
    if (at == std::string_view::npos) return parts;
    text.remove_prefix(at + 1);
  }
}

}  // namespace spindle
