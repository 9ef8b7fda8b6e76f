#include <fmt/format.h>

#include <array>

#include "findings.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {
namespace {

using report::Column;
using report::Record;

const std::array<Column, 5> profile_columns = {
    {{"PROFILE", "profile"},
     {"TITLE", "title", report::Align::left, 0, report::wrapped(20)},
     {"PARAMETERS", "parameters", report::Align::right},
     {"ACTIONS", "actions", report::Align::right, 0, report::left_out(2)},
     {"FILE", "file", report::Align::left, 0, report::left_out(1)}}};

Record profile_record(const catalogue::Profile& profile, const Clock& clock) {
  return {
      .type = "profile",
      .target = {},
      .time = clock.wall(),
      .fields = {{"profile", profile.id},
                 {"title", profile.title},
                 {"parameters", count(profile.parameters.size())},
                 {"actions", count(profile.actions.size())},
                 {"file", files::names_profile_file(profile.path) ? profile.path.to_string()
                                                                  : std::string(files::built_in)}}};
}

}  // namespace

Result<Outcome> profile_list(Context& context) {
  Outcome outcome;
  Listing listing(context, profile_columns);
  for (const files::ProfileEntry& entry : context.profiles.list()) {
    const auto profile = context.profiles.load(entry.id);
    if (profile) {
      outcome.succeed();
      listing.add(profile_record(*profile, context.clock));
    } else {
      outcome.fail(profile.error());
      listing.add(profile.error());
    }
  }
  return finish(listing, outcome);
}

Result<Outcome> profile_show(const ProfileNameOptions& options, Context& context) {
  TRY_LET(const auto profile, context.profiles.load(options.profile));
  Outcome outcome;
  outcome.succeed();
  Listing head(context, profile_columns);
  head.add(profile_record(profile, context.clock));
  TRY(head.end());
  const auto columns = parameter_columns(profile.parameters);
  Listing parameters(context, columns);
  for (const catalogue::Parameter& parameter : profile.parameters) {
    parameters.add(parameter_record(parameter, {}, context.clock));
  }
  TRY(parameters.end());
  Listing actions(context, action_columns());
  for (const catalogue::Action& action : profile.actions) {
    actions.add(action_record(action, {}, context.clock));
  }
  return finish(actions, outcome);
}

Result<Outcome> profile_check(const ProfileNameOptions& options, Context& context) {
  TRY_LET(const auto findings, context.profiles.check(options.profile));
  return tell_findings(findings, options.profile, "profile", context);
}

}  // namespace spindle::commands
