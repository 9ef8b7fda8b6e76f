#pragma once

#include <span>
#include <string>

#include "spindle/commands/context.hpp"
#include "spindle/report/renderer.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/stop.hpp"

namespace spindle::commands {

/// The `action` record of a stop.
report::Record stop_record(device::StopResult result, const Target& target, const Clock& clock);
std::span<const report::Column> stop_columns();

}  // namespace spindle::commands
