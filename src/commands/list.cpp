#include "listing.hpp"
#include "records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {
namespace {

/// What to list: a profile, and the patterns that narrow it.
struct Subject {
  std::string target;  ///< as shown in records; empty: offline
  catalogue::Profile profile;
  std::vector<std::string> patterns;
};

/// A torque in the tool's own unit, where the tools file says which that is.
catalogue::Profile with_units_of(const Target& target, catalogue::Profile profile) {
  if (target.torque_unit.empty()) return profile;
  std::vector<catalogue::Parameter> parameters(profile.parameters.begin(),
                                               profile.parameters.end());
  for (catalogue::Parameter& parameter : parameters) parameter.unit = unit_of(parameter, target);
  profile.parameters = std::move(parameters);
  return profile;
}

/// Without a tool there is nothing to ask: the profile's own words.
Result<Subject> offline(const ListOptions& options, const Context& context) {
  TRY_LET(auto profile, context.profiles.load(context.common.profile));
  return Subject{{}, std::move(profile), options.arguments};
}

Result<Subject> of_target(const ListOptions& options, const Context& context) {
  TRY_LET(auto target, resolve_target(options.arguments.front(), context));
  std::vector<std::string> patterns(options.arguments.begin() + 1, options.arguments.end());
  if (!target.profile.empty()) {
    TRY_LET(auto profile, context.profiles.load(target.profile));
    return Subject{target.shown, with_units_of(target, std::move(profile)), std::move(patterns)};
  }
  TRY_LET(auto tool, open_tool(target, catalogue::Profile(), Need::named_registers, context));
  return Subject{target.shown, with_units_of(target, tool.device.profile()), std::move(patterns)};
}

Result<Subject> subject_of(const ListOptions& options, const Context& context) {
  const bool has_target =
      !options.arguments.empty() && is_target(options.arguments.front(), context);
  if (has_target) return of_target(options, context);
  if (!context.common.profile.empty()) return offline(options, context);
  if (!options.arguments.empty()) return of_target(options, context);
  return tl::unexpected(Error{.code = Errc::usage,
                              .message = "list what? neither a target nor a profile is named",
                              .hint =
                                  "try 'spindle list --profile doga-bm'; 'spindle profile list' "
                                  "shows all profiles"});
}

}  // namespace

Result<Outcome> list(const ListOptions& options, Context& context) {
  TRY_LET(const auto subject, subject_of(options, context));
  auto parameters = subject.profile.describe(subject.patterns);
  if (!parameters) {
    parameters.error().asked_of = subject.target;
    return tl::unexpected(std::move(parameters.error()));
  }
  Outcome outcome;
  const auto columns = parameter_columns(*parameters);
  Listing listing(context, columns);
  for (const catalogue::Parameter& parameter : *parameters) {
    listing.add(parameter_record(parameter, subject.target, context.clock));
    outcome.succeed();
  }
  return finish(listing, outcome);
}

}  // namespace spindle::commands
