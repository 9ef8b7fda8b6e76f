#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// What the words of a command line may be beside tools.
enum class OtherWords : std::uint8_t {
  none,         ///< every word is a tool
  names,        ///< names and patterns of parameters, actions, files
  assignments,  ///< NAME=VALUE
};

/// The words of a command line as they were typed.
struct TypedWords {
  std::vector<std::string> words = {};
  std::size_t behind_dashes = 0;  ///< so many of the last ones stand behind "--", and name no tool
};

/// The same, told apart.
struct SortedWords {
  std::vector<std::string> targets;  ///< one at least
  std::vector<std::string> others;
};

/// A word is a tool where it is a name of the tools file, an @group, a URL or a bare address;
/// everything else is another word. Where no tool is named the default one is meant: then
/// `context.user.choice` says so, and on a terminal the user is told. Where there is none either,
/// the first other word is taken for a misspelt tool. Errors: `usage` of this command where no tool
/// is named, `unknown_name` of what looks like a tool, and those of default_target().
Result<SortedWords> sort_words(const TypedWords& typed, OtherWords kind, std::string_view command,
                               Context& context);

/// The error of a name that is not known, as one of a misspelt tool where the default tool was
/// asked for it and the name of another is near.
Error or_misspelt_tool(Error error, const Context& context);

}  // namespace spindle::commands
