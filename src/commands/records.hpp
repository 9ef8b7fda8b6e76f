#pragma once

#include <span>
#include <string>
#include <vector>

#include "spindle/commands/context.hpp"
#include "spindle/work/snapshot.hpp"

namespace spindle::commands {

struct GetOptions;

using report::count;
using report::number;
using report::text_or_null;

/// Milliseconds with microseconds behind the point.
/// As JSON and CSV have it: a number, a text, numbers, or null.
report::Cell value_cell(const catalogue::Value& value);

report::Cell milliseconds(Duration duration);

/// The `value` record of a reading that succeeded; of a secret only where it was asked for.
report::Record value_record(const device::Reading& reading, const Target& target,
                            const Clock& clock, const GetOptions& options);
std::span<const report::Column> value_columns(device::Limits limits);

report::Record parameter_record(const catalogue::Parameter& parameter, const std::string& target,
                                const Clock& clock);
/// When a value takes effect is a column only where a parameter says it.
std::vector<report::Column> parameter_columns(std::span<const catalogue::Parameter> parameters);

/// An action as a catalogue entry, for lists.
report::Record action_record(const catalogue::Action& action, const std::string& target,
                             const Clock& clock);
std::span<const report::Column> action_columns();

/// A summary record: the given counts and the exit status.
report::Record summary_record(std::vector<report::Field> counts, ExitStatus status,
                              const std::string& target, const Clock& clock);

}  // namespace spindle::commands
