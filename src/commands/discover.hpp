#pragma once

#include <span>
#include <string>
#include <vector>

#include "spindle/commands/context.hpp"
#include "spindle/report/renderer.hpp"
#include "spindle/work/discovery.hpp"
#include "spindle/work/sweep.hpp"

namespace spindle::commands {

/// A tool that was found, as it may be added to the tools file.
struct Discovered {
  report::Record record;
  std::string endpoint;  ///< URL; empty: it is not known where it is
  std::string serial;
  std::string kind;     ///< what to call it: "bmt"; empty: not known
  std::string profile;  ///< empty: it is found out at each start
  std::string name;     ///< of the tools file's entry for this URL; empty: there is none
};

/// What a tool said of itself on the network, or at an address that was tried.
Discovered discovered(const work::Heard& heard, const Context& context);
Discovered discovered(const work::SweptTool& swept, const Context& context);
std::span<const report::Column> discovered_columns();

/// The name of the tools file's entry for a URL of a tool, with or without its port; empty: there
/// is none.
std::string name_in_tools_file(const std::string& url, const Context& context);

/// Adds what is not there yet to the tools file, behind its last tool; asks once for all. No entry
/// that is there is changed. Returns the names that were given. Errors: not confirmed; the file is
/// none, or cannot be written.
Result<std::vector<std::string>> add_to_tools_file(const std::vector<Discovered>& found,
                                                   Context& context);

}  // namespace spindle::commands
