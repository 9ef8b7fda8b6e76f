#pragma once

#include "spindle/commands/context.hpp"

namespace spindle::commands {

/// Shows on stderr what users have to know about the line to a tool, and for --verbose every frame
/// and decision as a line of its own. Both must outlive it.
work::ShowFrames show_frames(const report::Streams& io, const Clock& clock, Frames frames);

}  // namespace spindle::commands
