#include "manual.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "cli/help.hpp"
#include "spindle/base/text.hpp"

namespace spindle::test {
namespace {

constexpr std::size_t longest_line = 78;

/// A line of text that begins so would be a request.
bool is_request(std::string_view line) { return line.starts_with('.'); }

std::string text_line(const std::string& escaped) {
  return is_request(escaped) ? "\\&" + escaped : escaped;
}

/// Macros have two or three letters, the first of them a capital.
bool looks_like_macro(std::string_view word) {
  const auto is_letter = [](unsigned char c) { return std::isalpha(c) != 0; };
  return (word.size() == 2 || word.size() == 3) &&
         std::isupper(static_cast<unsigned char>(word.front())) != 0 &&
         std::all_of(word.begin(), word.end(), is_letter);
}

/// Punctuation that stands alone is set close to the word before it.
bool is_delimiter(std::string_view word) {
  return word.size() == 1 && std::string_view(".,:;()[]?!|").find(word) != std::string_view::npos;
}

bool ends_sentence(std::string_view word) {
  if (word.ends_with(')')) word.remove_suffix(1);
  return word.ends_with('.') || word.ends_with('?') || word.ends_with('!');
}

/// "who is there" becomes "Who is there."
std::string sentence(std::string text) {
  if (text.empty()) return text;
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  if (!ends_sentence(text)) text += '.';
  return text;
}

std::string list(std::string_view items) {
  return items.empty() ? std::string()
                       : fmt::format(".Pp\n.Bl -tag -width Ds -compact\n{}.El\n", items);
}

/// ".It Fl o , Fl \-output Ar FORMAT"
std::string term_of(const cli::OptionDescription& option) {
  if (option.is_argument()) {
    return fmt::format(".It Ar {}\n", mdoc_argument(option.names.front()));
  }
  std::string term = ".It";
  for (const std::string& name : option.names) {
    term += fmt::format("{} Fl {}", term == ".It" ? "" : " ,", mdoc_argument(name.substr(1)));
  }
  if (!option.placeholder.empty()) term += " Ar " + mdoc_argument(option.placeholder);
  return term + "\n";
}

std::string option_list(const std::vector<cli::OptionDescription>& options) {
  std::string items;
  for (const cli::OptionDescription& option : options) {
    const std::string declared =
        option.declared_by.empty() ? "" : fmt::format(" ({})", option.declared_by);
    items += term_of(option) + mdoc_prose(option.meaning + declared);
  }
  return list(items);
}

/// What stands behind a command's options: lines that begin with blanks are terms with their
/// meaning, the others are text.
std::string appendix_text(std::string_view appendix) {
  std::string text;
  std::string items;
  std::string prose;
  const auto end_prose = [&] {
    if (!prose.empty()) text += ".Pp\n" + mdoc_prose(prose);
    prose.clear();
  };
  const auto end_items = [&] {
    text += list(items);
    items.clear();
  };
  for (const std::string_view line : split(appendix, '\n')) {
    const std::size_t begin = line.find_first_not_of(' ');
    if (begin == std::string_view::npos) {
      end_prose();
      end_items();
    } else if (begin == 0) {
      end_items();
      prose += (prose.empty() ? "" : " ") + std::string(line);
    } else {
      end_prose();
      const std::size_t end = std::min(line.find("  ", begin), line.size());
      const std::size_t meaning = std::min(line.find_first_not_of(' ', end), line.size());
      items += fmt::format(".It Cm {}\n", mdoc_argument(line.substr(begin, end - begin)));
      items += mdoc_prose(line.substr(meaning));
    }
  }
  end_prose();
  end_items();
  return text;
}

/// The command's name, and below it how it is typed.
std::string heading_of(const cli::CommandDescription& command) {
  std::string heading = ".Ss";
  for (const std::string_view word : split(command.name, ' ')) heading += " " + mdoc_argument(word);
  const std::string usage = command.name + " " + command.synopsis;
  std::string typed = ".Dl spindle";
  for (const std::string_view word : split(usage, ' ')) {
    if (!word.empty()) typed += " " + mdoc_argument(word);
  }
  return fmt::format("{}\n{}\\&\n.Pp\n", heading, typed);  // "..." at its end is no punctuation
}

std::string command_text(const cli::CommandDescription& command) {
  std::string text = heading_of(command) + mdoc_prose(sentence(command.meaning));
  text += option_list(cli::left_to_manual(command));
  if (command.appendix != nullptr) text += appendix_text(command.appendix());
  for (const cli::CommandDescription& below : command.commands) text += command_text(below);
  return text;
}

std::string exit_status_list() {
  std::string items;
  for (const StatusInfo& status : status_table()) {
    items +=
        fmt::format(".It Sy {} {}\n", static_cast<int>(status.status), mdoc_argument(status.name));
    items += mdoc_prose(sentence(std::string(status.meaning)));
  }
  return list(items);
}

}  // namespace

std::string mdoc_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '\\':
        escaped += "\\e";
        break;
      case '\'':
        escaped += "\\(aq";
        break;
      case '"':
        escaped += "\\(dq";
        break;
      case '`':
        escaped += "\\(ga";
        break;
      case '^':
        escaped += "\\(ha";
        break;
      case '~':
        escaped += "\\(ti";
        break;
      case '-':
        escaped += "\\-";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string mdoc_argument(std::string_view text) {
  const std::string escaped = mdoc_escaped(text);
  if (escaped.find(' ') != std::string::npos) return "\"" + escaped + "\"";
  const bool guarded = text.empty() || looks_like_macro(text) || is_delimiter(text);
  return guarded ? "\\&" + escaped : escaped;
}

std::string mdoc_prose(std::string_view text) {
  std::string lines;
  std::string line;
  const auto end_line = [&] {
    if (!line.empty()) lines += text_line(line) + "\n";
    line.clear();
  };
  for (const std::string_view word : split(text, ' ')) {
    if (word.empty()) continue;
    const std::string escaped = mdoc_escaped(word);
    if (line.size() + 1 + escaped.size() > longest_line) end_line();
    line += (line.empty() ? "" : " ") + escaped;
    if (ends_sentence(word)) end_line();
  }
  end_line();
  return lines;
}

std::string mdoc_literal(std::span<const std::string> lines) {
  std::string text = ".Bd -literal -offset indent\n";
  for (const std::string& line : lines) text += text_line(mdoc_escaped(line)) + "\n";
  return text + ".Ed\n";
}

std::vector<Placeholder> manual_placeholders(const cli::Description& description) {
  std::string commands;
  for (const cli::CommandDescription& command : description.commands)
    commands += command_text(command);
  return {{"COMMANDS", std::move(commands)}, {"EXIT_STATUS", exit_status_list()}};
}

Result<std::string> expand_template(std::string_view source,
                                    std::span<const Placeholder> placeholders) {
  std::string page;
  if (source.ends_with('\n')) source.remove_suffix(1);
  for (const std::string_view line : split(source, '\n')) {
    const bool is_placeholder = line.size() > 2 && line.starts_with('@') && line.ends_with('@');
    if (!is_placeholder) {
      page += std::string(line) + "\n";
      continue;
    }
    const std::string_view name = line.substr(1, line.size() - 2);
    const auto placeholder =
        std::find_if(placeholders.begin(), placeholders.end(),
                     [&](const Placeholder& known) { return known.name == name; });
    if (placeholder == placeholders.end()) {
      return tl::unexpected(Error{.code = Errc::bad_file,
                                  .message = "nothing is known that fills this placeholder",
                                  .name = std::string(name)});
    }
    page += placeholder->text;
  }
  return page;
}

}  // namespace spindle::test
