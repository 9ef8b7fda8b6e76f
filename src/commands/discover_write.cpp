#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <utility>

#include "consent.hpp"
#include "discover.hpp"
#include "spindle/base/text.hpp"
#include "spindle/files/tools_edit.hpp"

namespace spindle::commands {
namespace {

/// A hall has fewer tools; a flood of false answers has more.
constexpr std::size_t most_new = 256;

/// Lower-case letters and digits, and single hyphens between them.
std::string as_name(const std::string& text) {
  std::string name;
  for (const char c : text) {
    const bool is_letter = c >= 'a' && c <= 'z';
    const bool is_upper = c >= 'A' && c <= 'Z';
    const bool is_digit = c >= '0' && c <= '9';
    if (is_upper) {
      name += static_cast<char>(c - 'A' + 'a');
    } else if (is_letter || is_digit) {
      name += c;
    } else if (!name.empty() && !name.ends_with('-')) {
      name += '-';
    }
  }
  while (name.ends_with('-')) name.pop_back();
  return name;
}

/// "bmt-2401190042", or by its address where it says nothing of itself; with a number behind it
/// where the name is taken.
std::string free_name(const Discovered& tool, std::set<std::string>& taken) {
  std::string name = as_name(tool.serial);
  if (name.empty()) name = as_name(tool.endpoint.substr(tool.endpoint.find("//")));
  const std::string kind = as_name(tool.kind);
  name = (kind.empty() ? "tool" : kind) + "-" + name;
  std::string free = name;
  for (unsigned number = 2; !taken.insert(free).second; ++number) {
    free = fmt::format("{}-{}", name, number);
  }
  return free;
}

bool is_same_place(const link::Endpoint& entry, const link::Endpoint& found) {
  const bool may_be = entry.medium == link::Medium::tcp && entry.host == found.host;
  if (!may_be) return false;
  const bool has_ports = entry.port && found.port;
  const bool has_units = entry.unit && found.unit;
  return (!has_ports || entry.port == found.port) && (!has_units || entry.unit == found.unit);
}

/// A tool that answers as several units of its address is one tool.
bool is_same_tool(const files::NewTool& earlier, const Discovered& tool) {
  if (tool.serial.empty() || earlier.serial != tool.serial) return false;
  const auto one = link::parse_endpoint(earlier.url);
  const auto other = link::parse_endpoint(tool.endpoint);
  return one && other && one->host == other->host && one->port == other->port;
}

/// Whether the file has it by its serial number, at another place: which of both is right is for
/// the user to say.
bool is_moved(const Discovered& tool, const Context& context) {
  if (tool.serial.empty()) return false;
  for (const files::Tool& known : context.tools.tools) {
    if (known.serial != tool.serial) continue;
    context.renderer.note(fmt::format(
        "{} is not added: {} of {} has its serial number {}, and {}; mend the url there",
        tool.endpoint, known.name, context.tools.path, tool.serial, known.url));
    return true;
  }
  return false;
}

}  // namespace

std::string name_in_tools_file(const std::string& url, const Context& context) {
  const auto found = link::parse_endpoint(url);
  if (!found) return {};
  for (const files::Tool& tool : context.tools.tools) {
    const auto entry = link::parse_endpoint(tool.url);
    if (entry && is_same_place(*entry, *found)) return tool.name;
  }
  return {};
}

Result<std::vector<std::string>> add_to_tools_file(const std::vector<Discovered>& found,
                                                   Context& context) {
  const std::string& path = context.tools.path;
  std::set<std::string> taken;
  for (const files::Tool& tool : context.tools.tools) taken.insert(tool.name);
  for (const auto& [entry, fault] : context.tools.faults) taken.insert(entry);
  std::vector<files::NewTool> tools;
  for (const Discovered& tool : found) {
    const bool is_known =
        !tool.name.empty() || std::any_of(tools.begin(), tools.end(), [&](const auto& earlier) {
          return earlier.url == tool.endpoint || is_same_tool(earlier, tool);
        });
    if (is_known || tool.endpoint.empty() || is_moved(tool, context)) continue;
    tools.push_back({.name = free_name(tool, taken),
                     .url = tool.endpoint,
                     .profile = tool.profile,
                     .serial = tool.serial});
  }
  if (tools.empty()) {
    context.renderer.note("every tool that was found is in the tools file already");
    return std::vector<std::string>();
  }
  if (path.empty()) {
    return tl::unexpected(Error{.code = Errc::bad_file,
                                .message = "no tools file was found to which tools can be added",
                                .hint = "make one first: 'spindle tools init'"});
  }
  if (tools.size() > most_new) {
    return tl::unexpected(Error{
        .code = Errc::usage,
        .message =
            fmt::format("{} are too many to be added at once", counted(tools.size(), "new tool")),
        .hint = "this may be a flood of answers: look at them first, without --write"});
  }
  TRY_LET(const std::string before, context.disk.read_trusted(path));
  std::string after = before;
  std::vector<std::string> names;
  std::vector<std::string> words;
  for (const files::NewTool& tool : tools) {
    TRY_LET(after, files::with_tool(after, tool, path));
    names.push_back(tool.name);
    words.push_back(fmt::format("{} ({})", tool.name, tool.url));
  }
  TRY(ask_consent(fmt::format("{} in {}: {}", tools.size() == 1 ? "a new tool" : "new tools", path,
                              fmt::join(words, ", ")),
                  context));
  // The user may have taken their time, and so may have another program.
  TRY_LET(const std::string now, context.disk.read_trusted(path));
  if (now != before) {
    return tl::unexpected(Error{.code = Errc::bad_file,
                                .message = "the file was changed meanwhile, nothing was added",
                                .hint = "try again",
                                .name = path});
  }
  TRY(context.disk.write(path, after, Overwrite::allow, Privacy::usual));
  return names;
}

}  // namespace spindle::commands
