#pragma once

#include "spindle/commands/companions.hpp"

namespace spindle {

/// The whole program: what main() returns. What `own` does not do is done by other programs of the
/// same installation.
int run_program(int count, char** arguments, commands::Companions own);

}  // namespace spindle
