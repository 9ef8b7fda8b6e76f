#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "description.hpp"
#include "spindle/base/enum_table.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/report/renderer.hpp"

namespace spindle::cli {

enum class ColorChoice : std::uint8_t { automatic, always, never };

/// What --color and --output take.
inline constexpr auto color_words = enum_table<ColorChoice>({{"auto", ColorChoice::automatic},
                                                             {"always", ColorChoice::always},
                                                             {"never", ColorChoice::never}});
inline constexpr auto format_words = enum_table<report::Format>({{"table", report::Format::table},
                                                                 {"json", report::Format::json},
                                                                 {"csv", report::Format::csv},
                                                                 {"svg", report::Format::svg},
                                                                 {"wide", report::Format::wide},
                                                                 {"value", report::Format::value},
                                                                 {"yaml", report::Format::yaml}});

/// What --rules, --include and --study of report take.
inline constexpr auto rule_set_words =
    enum_table<statistics::RuleSet>({{"standard", statistics::RuleSet::standard},
                                     {"atlas", statistics::RuleSet::atlas},
                                     {"western-electric", statistics::RuleSet::western_electric}});

/// What a report leaves out unless it is asked for.
enum class Included : std::uint8_t { not_completed };
inline constexpr auto included_words =
    enum_table<Included>({{"not-completed", Included::not_completed}});
inline constexpr auto study_words = enum_table<commands::MachineStudy>(
    {{"", commands::MachineStudy::no}, {"machine", commands::MachineStudy::yes}});

/// What was typed, understood; nothing has been touched yet.
struct Invocation {
  /// What is wanted of the program: a command's deed, or to know what runs here (--version).
  enum class Asks : std::uint8_t { command, version } asks = Asks::command;
  /// Set: print this and end with status 0 (--help).
  std::optional<std::string> text = std::nullopt;
  report::Format format = report::Format::table;
  std::vector<std::string> columns = {};  ///< those that are wanted; none: as usual
  ColorChoice color = ColorChoice::automatic;
  /// Whether the command wants the tools file without a fault, wants it also where no tool is named
  /// because that means all, makes do with what can be read of it, or is about its faults.
  enum class ToolsFile : std::uint8_t { loaded, all_tools, salvaged, only_found };
  ToolsFile tools_use = ToolsFile::loaded;
  work::CommonOptions common = {};
  commands::UserOptions user = {};
  std::function<Result<commands::Outcome>(commands::Context&)> run = {};
};

/// Understands the arguments. Errors are `usage` with a suggestion where there is one.
Result<Invocation> parse(const std::vector<std::string>& arguments);

/// Everything that can be typed.
Description describe_grammar();

/// The format that the arguments ask for, as far as that can be seen although they are wrong: so
/// that even a usage error is told as JSON where JSON was wanted.
report::Format wanted_format(const std::vector<std::string>& arguments);

}  // namespace spindle::cli
