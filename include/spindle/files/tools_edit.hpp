#pragma once

#include <string>
#include <string_view>

#include "spindle/base/error.hpp"

namespace spindle::files {

/// An entry that is added to a tools file.
struct NewTool {
  std::string name;
  std::string url;
  std::string profile = {};      ///< empty: it is found out at each start
  std::string torque_unit = {};  ///< empty: unknown
  std::string serial = {};       ///< empty: unknown

  friend bool operator==(const NewTool&, const NewTool&) = default;
};

/// A tools file to begin with: an example of each kind, as comments.
std::string empty_tools_file();

/// The entry as a line of the file, without blanks before it and the line's end behind it.
std::string line_of(const NewTool& tool);

/// The text of a tools file with one entry more, behind the last one of `tools`; everything else
/// stays as it was written: comments, order, line ends. An empty text becomes a file with this one
/// tool. What comes out was read again: it says what the old text says, and the new entry without a
/// fault. Pure; `path` is for messages only. Errors: `bad_file` where `text` is no tools file, or
/// is written so that no line can be added, such as `tools: {...}`; `usage` where the name is taken
/// or is none that a tool can have, and where the entry has a fault.
Result<std::string> with_tool(std::string_view text, const NewTool& tool, const std::string& path);

}  // namespace spindle::files
