#pragma once

#include <map>
#include <string>
#include <vector>

#include "spindle/base/error.hpp"

namespace spindle::files {

/// One named tool of the tools file (contract, section 2.1).
struct Tool {
  std::string name;
  std::string url;
  std::string profile = {};                ///< empty: not given
  std::string torque_unit = {};            ///< empty: unknown
  std::vector<std::string> verified = {};  ///< actions that were checked on this tool
};

struct Tools {
  std::string path;  ///< empty: no file
  std::vector<Tool> tools = {};
  std::map<std::string, std::vector<std::string>> groups = {};
};

/// Strict: unknown and duplicate keys, unknown members of groups, wrong URLs and torque units are
/// `bad_file` with file:line:col.
Result<Tools> load_tools(const std::string& path);

}  // namespace spindle::files
