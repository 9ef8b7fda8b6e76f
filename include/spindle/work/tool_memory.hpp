#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spindle/base/disk.hpp"
#include "spindle/base/error.hpp"
#include "spindle/link/endpoint.hpp"

namespace spindle::work {

/// A tool that said over TCP who it is.
struct SeenTool {
  std::string host;
  std::optional<std::uint8_t> unit = std::nullopt;  ///< as the URL said it
  std::uint16_t port = 0;
  std::string profile;  ///< id
  std::string serial;

  friend bool operator==(const SeenTool&, const SeenTool&) = default;
};

/// Whether all of these were behind the same port.
bool has_one_port(const std::vector<SeenTool>& seen);

/// Which tools were behind which hosts, kept in a file of the user's cache from one run to the
/// next. It is a hint and never a proof: what it says is used to find the port of a tool that is
/// only read and whose URL has none, and to complete names, and the tool is asked who it is all the
/// same. A file that is broken, or of another user, is as one that is not there.
class ToolMemory {
 public:
  /// `disk` must outlive it. `folder` is spindle's own; empty: nothing is remembered.
  ToolMemory(const Disk& disk, std::string folder) : disk_(&disk), folder_(std::move(folder)) {}

  /// The file; empty where there is none.
  [[nodiscard]] std::string path() const;

  /// What was last seen behind the endpoint's host; of its port, where it names one. Empty:
  /// nothing. Error `bad_file` where the file cannot be used.
  [[nodiscard]] Result<std::optional<SeenTool>> recall(const link::Endpoint& endpoint) const;

  /// All that were seen behind the endpoint's host, whatever its port and unit; the one that was
  /// seen last comes last. Error `bad_file` as above.
  [[nodiscard]] Result<std::vector<SeenTool>> seen_behind(const link::Endpoint& endpoint) const;

  /// Keeps this one, as the last one seen, in place of what was seen there before, and the newest
  /// 500 of all. Writes only where that changes something. Errors are those of the disk.
  [[nodiscard]] Result<void> remember(const SeenTool& tool) const;
  [[nodiscard]] Result<void> forget(const SeenTool& tool) const;

 private:
  [[nodiscard]] Result<std::vector<SeenTool>> read() const;
  [[nodiscard]] Result<void> write(const std::vector<SeenTool>& tools) const;

  const Disk* disk_;
  std::string folder_;
};

}  // namespace spindle::work
