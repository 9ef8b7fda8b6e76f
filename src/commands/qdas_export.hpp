#pragma once

#include "result_selection.hpp"
#include "spindle/commands/commands.hpp"
#include "stored_records.hpp"

namespace spindle::commands {

/// Writes the results that are meant into a folder, in the format of Q-DAS: a file for each tool,
/// preset and settings of that preset.
Result<Outcome> export_qdas(const ResultsOptions& options, store::Reader& reader,
                            StoredRecords& records, const Selection& selection, Context& context);

}  // namespace spindle::commands
