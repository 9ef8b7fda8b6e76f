#include "description.hpp"

namespace spindle::cli {
namespace {

const CommandDescription* find_among(const std::vector<CommandDescription>& commands,
                                     std::string_view name) {
  for (const CommandDescription& command : commands) {
    if (command.name == name) return &command;
    if (const auto* below = find_among(command.commands, name)) return below;
  }
  return nullptr;
}

}  // namespace

const CommandDescription* find_command(const Description& description, std::string_view name) {
  return find_among(description.commands, name);
}

}  // namespace spindle::cli
