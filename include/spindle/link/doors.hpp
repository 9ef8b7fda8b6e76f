#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "spindle/link/shared_line.hpp"

namespace spindle::link {

/// What programs that ask through a gateway may do to the tools behind it.
enum class Rights : std::uint8_t { read, write };

/// Where other programs ask for lines that this one has, as long as it lives; destroying it ends
/// what they are waiting for. Each is served in a thread of its own, all wait for new ones in one.
class Doors {
 public:
  Doors() = default;
  Doors(const Doors&) = delete;
  Doors& operator=(const Doors&) = delete;
  virtual ~Doors() = default;

  /// Lets other spindles of the user ask on the line of this name (Transport::line_name()). Does
  /// nothing where that is done already, by this program or by another one. Error: the system lets
  /// none be asked; `line` must outlive the doors.
  virtual Result<void> open(const std::string& name, SharedLine& line) = 0;

  /// Lets no spindle ask on the line of this name any more; those that do are sent away. It may be
  /// opened again.
  virtual void close(const std::string& name) = 0;

  /// Lets any program ask on the line in Modbus TCP, and returns the port, chosen by the system for
  /// 0. Errors: `port_busy`, `port_unusable`. `line` must outlive the doors.
  virtual Result<std::uint16_t> listen(const std::string& host, std::uint16_t port,
                                       SharedLine& line, Rights rights) = 0;
};

using MakeDoors = std::function<std::unique_ptr<Doors>()>;

}  // namespace spindle::link
