#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace spindle {

/// Shell-style matching of a whole name: `*` any run of characters, `?` one, `[abc]`, `[a-z]`,
/// `[!x]`. A malformed bracket matches itself literally. Linear in practice, never exponential.
bool glob_match(std::string_view pattern, std::string_view text);

/// Whether both are the same but for the case of their ASCII letters.
bool same_ignoring_case(std::string_view a, std::string_view b);

/// Whether the text has a character that glob_match() treats as special.
bool is_pattern(std::string_view text);

/// The candidate nearest to a misspelt word by Damerau-Levenshtein distance, when it is near enough
/// to be worth suggesting: at most a third of the word's length (at least 1), counted behind the
/// dotted head that both share. Failing that, one with a hyphenated part as near. The first of
/// equals. One with other numbers is another thing and is never meant.
std::optional<std::string> closest(std::string_view word,
                                   const std::vector<std::string>& candidates);

/// ", did you mean 'x'?"-style hint for errors: "did you mean 'x'?" or an empty string.
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

/// The hint of suggestion(), but only for the same letters and digits in another order or case, or
/// with other signs between them: where a word that is nearly the same means something else, as
/// with units.
std::string same_word(std::string_view word, const std::vector<std::string>& candidates);

/// The command line as it stands in a message: in quotes, unless it has some itself.
std::string shown_command(const std::string& command);

/// Reads decimal digits, or hexadecimal ones behind "0x", completely. Empty when anything else is
/// there or the number is above `maximum`. A leading zero ("010") is decimal ten, never octal.
std::optional<std::uint64_t> parse_unsigned(std::string_view text, std::uint64_t maximum);

/// The name of a product with the article that is spoken: "a BLV", "an FC01", "an SDM72D-M".
std::string with_article(std::string_view name);

/// "1 event", "2 events", "0 events".
std::string counted(std::size_t count, std::string_view noun);

/// The text as one word of a shell's command line: in single quotes where that is needed.
std::string shell_word(const std::string& text);

std::vector<std::string_view> split(std::string_view text, char separator);

}  // namespace spindle
