#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "diff_side.hpp"
#include "listing.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {

/// Checks, before a tool is asked, that the words of a command line are stored parameters of a
/// profile and leave some to compare.
Result<void> check_selection(const DiffOptions& options, const catalogue::Profile& profile);

/// What stands on both sides, once all is read.
struct ReadSides {
  SideContent a;
  SideContent b;
};

/// How a comparison came out.
struct DiffResult {
  Outcome outcome = {};
  std::size_t different = 0;
  std::size_t same = 0;
};

/// Lists what differs, and what could not be read. `target` is the tool that it is told of; empty:
/// none. `more` stands in the summary. Error `usage` where nothing could be compared, which proves
/// nothing.
Result<DiffResult> compare(const ReadSides& sides, const DiffOptions& options,
                           catalogue::Lacking lacking, const std::string& target, Context& context,
                           const std::vector<report::Field>& more = {});

Summary diff_summary(const DiffResult& result, const std::string& target);

}  // namespace spindle::commands
