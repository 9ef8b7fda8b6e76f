#pragma once

#include "spindle/work/target.hpp"

namespace spindle::work {

/// Adds to the error which port may be meant where neither URL nor profile names one, and the one
/// that was tried was not chosen. Where none is known the error stays as it is.
void suggest_port(const Target& target, const Environment& environment, Error& error);

}  // namespace spindle::work
