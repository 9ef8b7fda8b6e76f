#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/disk.hpp"
#include "spindle/base/installation.hpp"
#include "spindle/commands/context.hpp"

namespace spindle::cli {

/// The outside world as the program sees it; tests bring their own.
struct World {
  report::Streams io;
  Clock& clock;
  const Interrupt& interrupt;
  device::OpenTransport open;  ///< real lines
  work::Uninterruptible uninterruptible;
  sim::Serve serve;                 ///< puts a simulated tool on a port
  std::function<void()> end_waits;  ///< ends every wait, as a signal would
  std::function<std::optional<std::string>(std::string_view name)> environment;
  Disk disk;
  Installation installation;
  link::MakeDoors make_doors = {};      ///< lets other programs ask; may be empty
  files::ShippedProfiles shipped = {};  ///< the profiles of the program
  commands::Companions companions = {};
  commands::Supervision supervision = {};
  link::Network network = {};  ///< where tools are looked for; may be empty
};

/// The whole program: parses the arguments (without the program's name), runs one command, and
/// returns the exit status of the contract. Every failure has been told on world.io when it
/// returns; nothing is thrown.
int run(const std::vector<std::string>& arguments, World& world);

}  // namespace spindle::cli
