#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "spindle/base/clock.hpp"
#include "spindle/base/disk.hpp"
#include "spindle/catalogue/parameter.hpp"
#include "spindle/catalogue/value.hpp"
#include "spindle/files/change_log.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::work {

/// What is recorded of one change; the rest is the same for a whole command.
struct LoggedChange {
  std::string name;
  std::optional<std::uint16_t> register_address = std::nullopt;
  std::optional<files::LoggedValue> old_value = std::nullopt;
  std::optional<files::LoggedValue> new_value = std::nullopt;
  std::string result = {};
  std::string unit = {};  ///< empty: none, or not known
  std::string old_label = {};
  std::string new_label = {};
};

/// A change of a parameter of this target, which says the unit of torques. The values of a secret
/// are not recorded.
LoggedChange logged(const catalogue::Parameter& parameter, const catalogue::Value& before,
                    const catalogue::Value& after, std::string_view result, const Target& target);

/// Whose changes are recorded, and where.
struct LogOptions {
  std::string command;      ///< "set", "restore"
  std::string target;       ///< as the user named it
  std::string serial = {};  ///< empty: not known
  std::string folder = {};  ///< of the file `changes.jsonl`; empty: nowhere is known
  std::string run = {};     ///< what its ids begin with; empty: something of its own
  std::map<std::string, std::string> undoes = {};  ///< by parameter: the change that is taken back
};

/// The record of changes of one command on one tool: what is about to be sent, and how it ended. A
/// record that cannot be written is a single warning and never an error: a tool must not be left
/// half-way because of it.
class ChangeLog {
 public:
  using Warn = std::function<void(const std::string& sentence)>;

  /// `disk` and `clock` must outlive it.
  ChangeLog(LogOptions options, const Disk& disk, const Clock& clock, Warn warn)
      : options_(std::move(options)), disk_(&disk), clock_(&clock), warn_(std::move(warn)) {}

  /// Records what is about to be sent, with the result `begun`. Returns the id by which end()
  /// records how it ended; what never ended is found by it.
  [[nodiscard]] std::string begin(LoggedChange change);
  void end(const std::string& id, const LoggedChange& change);

  /// What the ids of all its changes begin with, in front of a '-'; empty before the first one.
  [[nodiscard]] const std::string& run() const { return run_; }

 private:
  void add(const LoggedChange& change, const std::string& id);
  Result<void> append(const std::string& line);

  LogOptions options_;
  const Disk* disk_;
  const Clock* clock_;
  Warn warn_;
  std::string run_ = {};
  unsigned begun_ = 0;
  bool folder_made_ = false;
  bool warned_ = false;
};

/// What the ids of all changes of a command begin with: eight hexadecimal digits.
std::string new_run(std::string_view command, const std::string& target,
                    const Environment& environment);

/// The record of changes of a command on this tool. `environment` must outlive it. `run` and
/// `undoes` as in LogOptions.
ChangeLog change_log(std::string_view command, const OpenTool& tool, const Environment& environment,
                     ChangeLog::Warn warn, std::string run = {},
                     std::map<std::string, std::string> undoes = {});

}  // namespace spindle::work
