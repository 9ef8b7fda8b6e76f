#pragma once

#include <functional>

#include "spindle/base/service_manager.hpp"
#include "spindle/files/tools_file.hpp"

namespace spindle::commands {

/// What a command that runs on has to do with whom it runs for. All may be empty: then none asks.
struct Supervision {
  /// From now on SIGHUP does not end the program, but asks for what `take_reload` tells.
  std::function<void()> heed_reload = {};
  /// Whether a reload was asked for since this was last asked.
  std::function<bool()> take_reload = {};
  /// The service manager that started the program. To be called once, before there are threads.
  std::function<ServiceManager()> take_manager = {};
  /// Reads the tools file that counts again.
  std::function<Result<files::Tools>()> load_tools = {};
};

}  // namespace spindle::commands
