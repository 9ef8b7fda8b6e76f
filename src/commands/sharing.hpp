#pragma once

#include <memory>

#include "leases.hpp"
#include "spindle/commands/commands.hpp"
#include "watch_stream.hpp"

namespace spindle::commands {

/// The leases of `record --lease`; null without that option. Errors (`usage`, `bad_file`): the sink
/// is not known or none of PostgreSQL, or its program is not installed. All must outlive them.
Result<std::unique_ptr<Leases>> share_tools(const RecordOptions& options, WatchStream& stream,
                                            Context& context);

}  // namespace spindle::commands
