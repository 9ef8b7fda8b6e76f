#pragma once

#include <string>

#include "spindle/work/target.hpp"

namespace spindle::work {

/// Which port may be meant where neither URL nor profile names one, and the one that was tried was
/// not chosen; empty: none is known.
std::string other_port_hint(const Target& target, const Environment& environment);

}  // namespace spindle::work
