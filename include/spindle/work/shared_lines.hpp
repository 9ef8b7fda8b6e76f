#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "spindle/link/shared_line.hpp"
#include "spindle/work/target.hpp"

namespace spindle::work {

/// The serial lines and gateways on which several tools of one command are, so that all of them can
/// be connected at the same time. Must outlive what it opens.
class SharedLines {
 public:
  /// Which tools get a share.
  enum class Of : std::uint8_t {
    all,       ///< they are connected at the same time
    gateways,  ///< only those, one after the other; a connection that a gateway closes is reopened
  };

  /// Opens nothing. Every other target has a line of its own.
  SharedLines(const std::vector<Target>& targets, const Environment& environment, Of of = Of::all);

  /// Like `open` of the environment; on a shared line all get a share of one opening, with the
  /// settings of the one that came first.
  [[nodiscard]] device::OpenTransport opener();

 private:
  [[nodiscard]] link::SharedLine::Open reopening(const link::Endpoint& endpoint,
                                                 const link::SharedLine::Open& open) const;

  std::map<std::string, std::unique_ptr<link::SharedLine>> lines_ = {};
  const Environment* environment_;
  Of of_;
};

/// Refuses two tools of one line that do not mean the same rate, parity and stop bits. `facts` are
/// those of the targets' profiles, in their order.
Result<void> check_same_settings(const std::vector<Target>& targets,
                                 const std::vector<catalogue::LinkSpec>& facts);

/// resolve_targets() for commands that go on with all of them: refuses tools of one line that do
/// not mean the same settings, as a frame at a wrong rate can stop a motor that runs there.
Result<std::vector<Target>> resolve_compatible_targets(const std::vector<std::string>& texts,
                                                       const Environment& environment);

}  // namespace spindle::work
