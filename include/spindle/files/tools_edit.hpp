#pragma once

#include <string>
#include <string_view>

#include "spindle/base/error.hpp"

namespace spindle::files {

/// An entry that is added to a tools file.
struct NewTool {
  std::string name;
  std::string url;
  std::string profile;  ///< empty: it is found out at each start
};

/// A tools file to begin with: an example of each kind, as comments.
std::string empty_tools_file();

/// The text of a tools file with one entry more, behind the last one of `tools`; everything else
/// stays as it was written, comments too. Pure; `path` is for messages only. Errors: `bad_file`
/// where `text` is no tools file, or lists its tools in one line ({...}); `usage` where the name is
/// taken or is none that a tool can have.
Result<std::string> with_tool(std::string_view text, const NewTool& tool, const std::string& path);

}  // namespace spindle::files
