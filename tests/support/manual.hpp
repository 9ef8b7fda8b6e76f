#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cli/description.hpp"
#include "spindle/base/error.hpp"

namespace spindle::test {

/// A place in the source of a manual page, a line "@NAME@", and the mdoc(7) text that belongs
/// there: whole lines.
struct Placeholder {
  std::string name;
  std::string text;
};

/// COMMANDS, without what the help of a command says, and EXIT_STATUS: what the program itself
/// knows.
std::vector<Placeholder> manual_placeholders(const cli::Description& description);

/// The page. Error `bad_file` for a placeholder of the source that is none of `placeholders`.
Result<std::string> expand_template(std::string_view source,
                                    std::span<const Placeholder> placeholders);

/// Text as mdoc(7) shows it: nothing in it is an escape or becomes a typographic character.
std::string mdoc_escaped(std::string_view text);

/// One argument on a macro line, whatever is in it.
std::string mdoc_argument(std::string_view text);

/// Filled text of lines of at most 78 characters, each sentence on a new one.
std::string mdoc_prose(std::string_view text);

/// Lines as they are, such as examples.
std::string mdoc_literal(std::span<const std::string> lines);

}  // namespace spindle::test
