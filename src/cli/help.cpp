#include "help.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace spindle::cli {
namespace {

/// Those that only some profiles declare stand behind the others, in the order of their first one.
std::string option_lines(const std::vector<OptionDescription>& options) {
  std::string text;
  std::vector<std::string> groups = {""};
  for (const OptionDescription& option : options) {
    if (std::find(groups.begin(), groups.end(), option.declared_by) == groups.end()) {
      groups.push_back(option.declared_by);
    }
  }
  for (const std::string& group : groups) {
    if (!group.empty()) text += fmt::format("\nOptions {}:\n", group);
    for (const OptionDescription& option : options) {
      if (option.declared_by != group) continue;
      text += fmt::format("  {:<32}{}\n", names_of(option), option.meaning);
    }
  }
  return text;
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

std::string command_help(const Description& description, const CommandDescription& command) {
  const std::string space = command.synopsis.empty() ? "" : " ";
  std::string text = fmt::format("{}\n\nExamples:\n{}\nUsage: spindle {}{}{}\n", command.meaning,
                                 indented(command.examples), command.name, space, command.synopsis);
  if (!command.commands.empty()) {
    text += fmt::format("\nCommands:\n{}", command_lines(command.commands));
  }
  if (!command.options.empty()) {
    text += fmt::format("\nArguments and options:\n{}", option_lines(command.options));
  }
  if (command.appendix != nullptr) text += "\n" + command.appendix();
  return text + fmt::format("\nOptions of every command:\n{}", option_lines(description.common));
}

}  // namespace spindle::cli
