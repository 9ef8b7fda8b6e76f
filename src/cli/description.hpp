#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace spindle::cli {

/// An option or an argument as help, manual and completion see it.
struct OptionDescription {
  std::vector<std::string> names = {};  ///< "-o", "--output"; an argument: "TARGET"
  std::string placeholder = {};         ///< what its value stands for; a flag: empty
  std::string meaning = {};
  /// Which profiles declare it, such as "run model command-word"; empty: it is always there.
  std::string declared_by = {};

  [[nodiscard]] bool is_argument() const { return !names.front().starts_with('-'); }
  [[nodiscard]] bool is_flag() const { return placeholder.empty() && !is_argument(); }
};

struct CommandDescription {
  std::string name = {};      ///< "profile check" below another command
  std::string synopsis = {};  ///< behind the name; may be empty
  std::string meaning = {};
  std::vector<std::string> examples = {};
  std::string (*appendix)() = nullptr;  ///< more about it, with its own headings; may be absent
  std::vector<OptionDescription> options = {};
  std::vector<CommandDescription> commands = {};  ///< below this one
};

/// The whole command line, without the parser behind it: what help, manual pages and completions
/// are made from.
struct Description {
  std::vector<OptionDescription> common = {};
  std::vector<CommandDescription> commands = {};
};

/// The command with this name, such as "profile check"; null when there is none.
const CommandDescription* find_command(const Description& description, std::string_view name);

}  // namespace spindle::cli
