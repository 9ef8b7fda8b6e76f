#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "spindle/base/disk.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/device/device.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/files/tools_file.hpp"
#include "spindle/link/datagrams.hpp"
#include "spindle/link/doors.hpp"

namespace spindle::work {

/// What a command line may say of every tool that it reaches (contract, section 2.2).
struct CommonOptions {
  std::string profile = {};     ///< --profile; empty: not given
  std::string tools_file = {};  ///< --tools; empty: looked for
  std::optional<Duration> timeout = std::nullopt;
  std::optional<Duration> connect_timeout = std::nullopt;
  std::optional<unsigned> retries = std::nullopt;
  std::string trace_file = {};  ///< --trace; empty: no capture
};

/// A line and a clock that signals do not end: for the last words that leave a tool safe.
struct Uninterruptible {
  Clock& clock;
  const Interrupt& interrupt;  ///< never raised
  device::OpenTransport open;
  /// From now on a request to suspend the program (Ctrl-Z) ends it as Ctrl-C does: a suspended
  /// program stops no motor. May be empty.
  std::function<void()> refuse_suspend = {};
  /// What is told when a second signal ends the program at once; empty: nothing. May be empty.
  std::function<void(std::string_view words)> set_last_words = {};
  /// Starts a second process that does `when_orphaned`, and tells what it returns, when this
  /// program ends, however it ends, without having called the function that is returned. May be
  /// empty.
  std::function<Result<std::function<void()>>(std::function<std::string()> when_orphaned)>
      start_guardian = {};
};

/// Shows the user what goes over the line to the tool of this name.
using ShowFrames = std::function<link::Trace(const std::string& target)>;

/// Everything that work on tools needs from outside.
struct Environment {
  Clock& clock;
  const Interrupt& interrupt;
  const device::OpenTransport& open;  ///< real lines; simulated tools are opened inside the program
  const Uninterruptible& uninterruptible;
  const Disk& disk;
  const std::string& state_folder;  ///< where records of changes are kept; empty: nowhere is known
  std::string_view version;         ///< of spindle
  const files::ProfileStore& profiles;
  const files::Tools& tools;
  const ShowFrames& show_frames;  ///< may be empty
  CommonOptions common = {};
  link::MakeDoors make_doors = {};   ///< lets other programs ask; empty: none can
  std::string cache_folder = {};     ///< spindle's own; empty: nothing is remembered there
  link::Network network = {};        ///< where tools are looked for; may be empty
  std::string target_variable = {};  ///< $SPINDLE_TARGET; empty: it is not set
};

/// The same environment with a clock and lines that signals do not end.
Environment uninterruptible(const Environment& environment);

/// The same environment with other lines, which must outlive it.
Environment with_lines(const Environment& environment, const device::OpenTransport& open);

/// The same environment with other tools, which must outlive it.
Environment with_tools(const Environment& environment, const files::Tools& tools);

}  // namespace spindle::work
