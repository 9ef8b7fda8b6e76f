#pragma once

#include <memory>
#include <optional>
#include <string>

#include "spindle/base/clock.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/link/endpoint.hpp"
#include "spindle/link/transport.hpp"

namespace spindle::posix {

/// Asks the spindle that has the line of this name, if one has. Empty: none does, or it does not
/// answer, so that the line is to be opened; also where it has lost the tool and `claim` says that
/// a motor is to be stopped. Error: it has no link to the tool now, as it says.
std::optional<Result<std::unique_ptr<link::Transport>>> ask_owner(const std::string& name,
                                                                  link::Claim claim, Clock& clock,
                                                                  const Interrupt& interrupt);

}  // namespace spindle::posix
