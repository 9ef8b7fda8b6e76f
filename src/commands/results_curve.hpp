#pragma once

#include "spindle/commands/commands.hpp"
#include "spindle/store/reader.hpp"
#include "stored_records.hpp"

namespace spindle::commands {

/// The curves of the one result that `options.curve` names: as a table of samples, as a record, or
/// drawn. Errors: `usage` where it names none; `unknown_name` where no such result, or no curve of
/// it, is stored.
Result<Outcome> show_curve(const ResultsOptions& options, store::Reader& reader,
                           const StoredRecords& records, Context& context);

}  // namespace spindle::commands
