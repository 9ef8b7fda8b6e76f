#include "findings.hpp"

#include <fmt/format.h>

#include <array>

#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"

namespace spindle::commands {
namespace {

using report::Column;
using report::Record;

const std::array<Column, 2> finding_columns = {{{"PLACE", "place"}, {"FINDING", "message"}}};

Record finding_record(const files::Diagnostic& finding, const Clock& clock) {
  return {.type = "finding",
          .target = {},
          .time = clock.wall(),
          .fields = {{"place", fmt::format("{}:{}:{}", finding.file, finding.line, finding.column)},
                     {"file", finding.file},
                     {"line", number(finding.line)},
                     {"column", number(finding.column)},
                     {"message", finding.message}}};
}

}  // namespace

Result<Outcome> tell_findings(const std::vector<files::Diagnostic>& findings,
                              const std::string& name, std::string_view what, Context& context) {
  Outcome outcome;
  outcome.succeed();
  Listing listing(context, finding_columns);
  for (const files::Diagnostic& finding : findings) {
    listing.add(finding_record(finding, context.clock));
  }
  if (findings.empty()) {
    context.renderer.note(fmt::format("{}: no faults", name));
    return finish(listing, outcome);
  }
  TRY(listing.end());
  return tl::unexpected(
      Error{.code = Errc::bad_file,
            .message = fmt::format("{} in this {}", counted(findings.size(), "fault"), what),
            .name = name});
}

}  // namespace spindle::commands
