#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "spindle/base/installation.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/link/endpoint.hpp"
#include "spindle/link/transport.hpp"
#include "spindle/posix/clock.hpp"
#include "spindle/posix/guardian.hpp"
#include "spindle/posix/signals.hpp"
#include "spindle/posix/streams.hpp"

namespace spindle::posix {

/// Opens real lines. A line that another spindle has, and on which it lets itself be asked, is not
/// opened: that one is asked. What the endpoint leaves out (port, rate, parity, stop bits) is the
/// profile's.
std::function<Result<std::unique_ptr<link::Transport>>(
    const link::Endpoint& endpoint, const catalogue::LinkSpec& facts, Duration connect_timeout)>
line_opener(Clock& clock, const Interrupt& interrupt);

/// The same for lines that no signal ends.
inline auto line_opener(CalmTime& calm) { return line_opener(calm.clock, calm.interrupt); }

/// The line and the clock that no signal ends, and what keeps a run guarded, as the layers above
/// name it. Both must outlive it.
template <typename Uninterruptible>
Uninterruptible uninterruptible(SignalWatch& signals, CalmTime& calm) {
  return {calm.clock,
          calm.interrupt,
          line_opener(calm),
          [&signals] { signals.refuse_suspend(); },
          [&signals](std::string_view words) { signals.set_last_words(words); },
          start_guardian};
}

/// A variable of the environment; empty when it is not set.
std::optional<std::string> environment(std::string_view name);

/// The folder of the running executable, without a slash at its end, and the libraries that it runs
/// with.
Installation installation();

}  // namespace spindle::posix
