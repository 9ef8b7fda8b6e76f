#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <utility>

#include "listing.hpp"
#include "new_tool.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/files/tools_edit.hpp"
#include "tool_record.hpp"

namespace spindle::commands {
namespace {

using report::Column;

const std::array<Column, 5> added_columns = {{{"NAME", "name"},
                                              {"URL", "endpoint"},
                                              {"PROFILE", "profile"},
                                              {"MODEL", "tool_model"},
                                              {"SERIAL", "serial"}}};

/// The file that a tool is added to, or that is made.
Result<std::string> file_to_change(const Context& context) {
  if (!context.tools.path.empty()) return context.tools.path;
  if (!context.new_tools_file.empty()) return context.new_tools_file;
  return tl::unexpected(Error{.code = Errc::usage,
                              .message = "neither HOME nor XDG_CONFIG_HOME says where your tools "
                                         "file is",
                              .hint = "name one with --tools"});
}

/// Its text; empty where there is no such file.
Result<std::optional<std::string>> read_present(const std::string& path, const Disk& disk) {
  if (disk.absent(path)) return std::nullopt;
  return disk.read_trusted(path).map(
      [](std::string text) { return std::optional(std::move(text)); });
}

Result<std::string> with_new(const std::optional<std::string>& before, const NewEntry& entry,
                             const std::string& path) {
  return files::with_tool(before ? *before : files::empty_tools_file(), entry.tool, path);
}

Result<void> make_file(const std::string& path, std::string_view text, const Disk& disk) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  if (!folder.empty()) {
    TRY(disk.make_folders(folder.string(), Privacy::usual));
  }
  return disk.write(path, text, Overwrite::refuse, Privacy::usual);
}

/// Adds the entry to what the file holds by then; another program may change it at the same time.
Result<void> store(const NewEntry& entry, const std::string& path, const Disk& disk) {
  constexpr int most_attempts = 20;
  for (int attempt = 0; attempt < most_attempts; ++attempt) {
    TRY_LET(const auto before, read_present(path, disk));
    TRY_LET(const auto text, with_new(before, entry, path));
    if (before) {
      TRY_LET(const bool is_replaced, disk.replace(path, *before, text));
      if (is_replaced) return {};
      continue;
    }
    auto made = make_file(path, text, disk);
    if (made || made.error().status() != ExitStatus::usage) return made;
  }
  return tl::unexpected(Error{.code = Errc::storage,
                              .message = "another program changes this file again and again",
                              .hint = "wait until it is done",
                              .name = path});
}

report::Record added_record(const NewEntry& entry, const std::string& path,
                            const ToolAddOptions& options, const Clock& clock) {
  const files::NewTool& tool = entry.tool;
  const bool is_planned = options.execution == Execution::dry_run;
  report::Record record = tool_record({.name = tool.name,
                                       .url = tool.url,
                                       .profile = tool.profile,
                                       .torque_unit = tool.torque_unit,
                                       .serial = tool.serial},
                                      {}, clock);
  record.fields.insert(record.fields.end(),
                       {{"tool_model", text_or_null(entry.model)},
                        {"file", path},
                        {"result", std::string(is_planned ? "planned" : "added")}});
  return record;
}

/// What else has the place or the number of this tool.
void tell_doubles(const files::NewTool& tool, const std::optional<std::string>& before,
                  const std::string& path, const Context& context) {
  const auto tools = before ? files::parse_tools(*before, path) : Result<files::Tools>();
  if (!tools) return;
  for (const files::Tool& known : tools->tools) {
    if (known.url == tool.url) {
      context.renderer.note(fmt::format("warning: {} has this URL, too", known.name));
    } else if (!tool.serial.empty() && known.serial == tool.serial) {
      context.renderer.note(fmt::format("warning: {} ({}) has serial number {}, too", known.name,
                                        known.url, tool.serial));
    }
  }
}

}  // namespace

/// All that can be wrong with the name, the URL and the file is told before a tool is asked.
Result<Outcome> add_tool(const ToolAddOptions& options, Context& context) {
  TRY_LET(const auto path, file_to_change(context));
  TRY_LET(const auto before, read_present(path, context.disk));
  TRY_LET(auto entry, entry_as_typed(options, path, context));
  TRY(with_new(before, entry, path));
  if (options.asking == Asking::ask) {
    TRY(ask_who_it_is(entry, context));
  }
  TRY_LET(const auto text, with_new(before, entry, path));
  tell_doubles(entry.tool, before, path, context);
  for (const std::string& note : entry.notes) {
    context.renderer.note(fmt::format("{}: {}", entry.tool.name, note));
  }
  if (options.execution == Execution::real) {
    TRY(store(entry, path, context.disk));
  }
  Outcome outcome;
  outcome.succeed();
  Listing listing(context, added_columns);
  listing.add(added_record(entry, path, options, context.clock));
  const std::string done = before ? "added to " + path : path + ": made, with this tool";
  context.renderer.note(
      options.execution == Execution::real
          ? done
          : fmt::format("nothing was written (dry run); {} would have the line: {}", path,
                        files::line_of(entry.tool)));
  return finish(listing, outcome);
}

Result<Outcome> init_tools(const ToolsInitOptions& options, Context& context) {
  TRY_LET(const auto path, file_to_change(context));
  if (!context.disk.absent(path)) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "this tools file is there already, and is not written over",
              .hint = "'spindle tools add NAME URL' adds to it; --tools FILE makes another",
              .name = path});
  }
  const std::string text = files::empty_tools_file();
  if (options.execution == Execution::real) {
    TRY(make_file(path, text, context.disk));
    context.renderer.note(fmt::format(
        "{}: made; 'spindle tools add station3 tcp://192.168.10.23:5000' adds a tool", path));
  } else {
    context.renderer.note(fmt::format("nothing was written (dry run); {} would be:", path));
    for (const std::string_view line : split(text, '\n')) {
      if (!line.empty()) context.renderer.note(line);
    }
  }
  Outcome outcome;
  outcome.succeed();
  return outcome;
}

}  // namespace spindle::commands
