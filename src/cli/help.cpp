#include "help.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "spindle/base/text.hpp"

namespace spindle::cli {
namespace {

constexpr std::size_t most_lines = 25;
constexpr std::size_t widest_line = 100;

/// Behind what begins the first line, with line breaks in place of blanks; the other lines begin
/// with `indent` blanks.
std::string wrapped(std::string begin, std::string_view text, std::size_t indent) {
  std::string lines;
  std::string line = std::move(begin);
  bool is_first = true;
  for (const std::string_view word : split(text, ' ')) {
    if (!is_first && line.size() + 1 + word.size() > widest_line) {
      lines += std::exchange(line, std::string(indent, ' ')) + "\n";
      is_first = true;
    }
    line.append(std::exchange(is_first, false) ? "" : " ").append(word);
  }
  return lines + line + "\n";
}

std::size_t lines_in(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// An option or argument with what it means.
std::string option_lines(const OptionDescription& option, std::size_t width) {
  std::string begin = fmt::format("  {:<{}}  ", names_of(option), width);
  const std::size_t indent = begin.size();
  return wrapped(std::move(begin), option.meaning, indent);
}

std::size_t width_of(const std::vector<OptionDescription>& options) {
  std::size_t width = 0;
  for (const OptionDescription& option : options) width = std::max(width, names_of(option).size());
  return width;
}

/// One for each option. Those that only some profiles declare stand behind the others, in the order
/// of their first one.
struct Entry {
  std::string text;
  const OptionDescription* option;
};

std::vector<Entry> entries_of(const std::vector<OptionDescription>& options) {
  std::vector<Entry> entries;
  std::vector<std::string> groups = {""};
  for (const OptionDescription& option : options) {
    if (std::find(groups.begin(), groups.end(), option.declared_by) == groups.end()) {
      groups.push_back(option.declared_by);
    }
  }
  for (const std::string& group : groups) {
    std::string heading = group.empty() ? "" : fmt::format("\nOptions {}:\n", group);
    for (const OptionDescription& option : options) {
      if (option.declared_by != group) continue;
      entries.push_back(
          {std::exchange(heading, "") + option_lines(option, width_of(options)), &option});
    }
  }
  return entries;
}

std::string option_lines(const std::vector<OptionDescription>& options) {
  std::string text;
  for (const Entry& entry : entries_of(options)) text += entry.text;
  return text;
}

/// The names of options without what they mean.
std::string names_only(const std::vector<Entry>& entries, std::size_t from) {
  std::vector<std::string> names;
  for (std::size_t at = from; at < entries.size(); ++at) {
    names.push_back(entries[at].option->names.back());
  }
  return wrapped("  also ", fmt::format("{}", fmt::join(names, ", ")), 4);
}

/// So many options are told; of the others only the names.
std::string told_lines(const std::vector<Entry>& entries, std::size_t told) {
  std::string text;
  for (std::size_t at = 0; at < told; ++at) text += entries[at].text;
  return told < entries.size() ? text + names_only(entries, told) : text;
}

/// How many can be told in so many lines.
std::size_t told_in(const std::vector<Entry>& entries, std::size_t room) {
  std::size_t told = entries.size();
  while (told > 0 && lines_in(told_lines(entries, told)) > room) --told;
  return told;
}

std::string indented(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += fmt::format("  {}\n", line);
  return text;
}

/// By its last word, because the ones before it are in the usage line.
std::string command_lines(const std::vector<CommandDescription>& commands) {
  std::string text;
  for (const CommandDescription& command : commands) {
    const std::string name = command.name.substr(command.name.rfind(' ') + 1);
    text += fmt::format("  {:<12}  {}\n", name, command.meaning);
  }
  return text;
}

/// What stands in front of the options.
std::string head_of(const CommandDescription& command) {
  const std::string space = command.synopsis.empty() ? "" : " ";
  std::string text = fmt::format(
      "{}\nExamples:\n{}\n{}", wrapped("", command.meaning, 0), indented(command.examples),
      wrapped("Usage: spindle ", fmt::format("{}{}{}", command.name, space, command.synopsis), 4));
  if (!command.commands.empty()) {
    text += fmt::format("\nCommands:\n{}", command_lines(command.commands));
  }
  return text;
}

/// How many lines the options may take.
std::size_t room_of(const CommandDescription& command) {
  constexpr std::size_t around = 4;  // the heading and the last line, each behind an empty one
  return most_lines - std::min(lines_in(head_of(command)) + around, most_lines);
}

}  // namespace

std::string names_of(const OptionDescription& option) {
  if (option.is_argument()) return option.names.front();
  const bool has_short = option.names.size() > 1;
  std::string names = has_short ? option.names.front() + ", " : "    ";
  names += option.names.back();
  return option.is_flag() ? names : names + " " + option.placeholder;
}

std::string program_help(const Description& description) {
  return fmt::format(
      "spindle: the operator tool for screwdrivers and motor drivers that speak Modbus\n\n"
      "Examples:\n{}\nUsage: spindle [OPTIONS] COMMAND [OPTIONS] [TARGET...] [ARGUMENTS]\n\n"
      "Commands:\n{}\nOptions of every command:\n{}\n"
      "A target is tcp://HOST[:PORT], rtu:///dev/ttyUSB0?unit=N, rtu+tcp://HOST:PORT?unit=N,\n"
      "sim:PROFILE (a simulated tool), or a NAME or @GROUP of the tools file.\n"
      "'spindle COMMAND --help' shows examples of a command.\n",
      indented({"spindle identify sim:doga-bm", "spindle get sim:doga-bm 'preset.1.*torque*'",
                "spindle set tcp://192.168.10.23:5000 preset.1.target-torque=2.80"}),
      command_lines(description.commands), option_lines(description.common));
}

std::string command_help(const CommandDescription& command) {
  std::string text = head_of(command);
  if (!command.options.empty()) {
    const auto entries = entries_of(command.options);
    text += "\nArguments and options:\n" + told_lines(entries, told_in(entries, room_of(command)));
  }
  return text + "\nmore: 'man spindle'; options of every command: 'spindle --help'\n";
}

std::vector<OptionDescription> left_to_manual(const CommandDescription& command) {
  const auto entries = entries_of(command.options);
  std::vector<OptionDescription> left;
  for (std::size_t at = told_in(entries, room_of(command)); at < entries.size(); ++at) {
    left.push_back(*entries[at].option);
  }
  return left;
}

}  // namespace spindle::cli
