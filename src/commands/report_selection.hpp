#pragma once

#include <vector>

#include "spindle/commands/commands.hpp"
#include "spindle/store/reader.hpp"
#include "spindle/work/study.hpp"

namespace spindle::commands {

using work::Quantity;

/// What a report is made of, as far as it is known before the events are read.
struct ReportSelection {
  store::Filter filter = {};  ///< of events
  work::StoreFacts facts = {};
};

/// Errors: `unknown_name` with a suggestion, `usage`. A profile that cannot be loaded is told by a
/// note: its codes then mean nothing.
Result<ReportSelection> select_for_report(const ReportOptions& options, store::Reader& reader,
                                          Context& context);

/// The study that the options mean. Errors: `usage`.
Result<work::StudyOptions> study_options_of(const ReportOptions& options,
                                            const files::Tools& tools);
Result<std::vector<work::Exclusion>> exclusions_of(const ReportOptions& options);

}  // namespace spindle::commands
