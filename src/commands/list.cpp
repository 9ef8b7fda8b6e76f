#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>

#include "driver.hpp"
#include "list_fold.hpp"
#include "listing.hpp"
#include "records.hpp"
#include "spindle/catalogue/short_name.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/default_target.hpp"

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
Result<Subject> offline(const std::string& name, std::vector<std::string> patterns,
                        const Context& context) {
  TRY_LET(auto profile, context.profiles.load(name));
  return Subject{{}, std::move(profile), std::move(patterns)};
}

bool is_profile(const std::string& word, const Context& context) {
  const auto profiles = context.profiles.list();
  return std::any_of(profiles.begin(), profiles.end(),
                     [&](const files::ProfileEntry& entry) { return entry.id == word; });
}

Result<Subject> of_target(const ListOptions& options, const Context& context) {
  TRY_LET(auto target, resolve_target(options.arguments.front(), context));
  std::vector<std::string> patterns(options.arguments.begin() + 1, options.arguments.end());
  if (!target.profile.empty()) {
    TRY_LET(auto profile, context.profiles.load(target.profile));
    return Subject{target.shown, with_units_of(target, std::move(profile)), std::move(patterns)};
  }
  TRY_LET(auto tool, open_to_read(target, catalogue::Profile(), context));
  return Subject{target.shown, with_units_of(target, tool.device.profile()), std::move(patterns)};
}

Result<Subject> subject_of(const ListOptions& options, const Context& context) {
  const bool has_target =
      !options.arguments.empty() && is_target(options.arguments.front(), context);
  if (has_target) return of_target(options, context);
  if (!context.common.profile.empty()) {
    return offline(context.common.profile, options.arguments, context);
  }
  if (!options.arguments.empty() && is_profile(options.arguments.front(), context)) {
    return offline(options.arguments.front(),
                   {options.arguments.begin() + 1, options.arguments.end()}, context);
  }
  TRY_LET(const auto usual, work::default_target(context));
  if (usual) {
    ListOptions of_usual = options;
    of_usual.arguments.insert(of_usual.arguments.begin(), usual->text);
    return of_target(of_usual, context);
  }
  if (!options.arguments.empty()) return of_target(options, context);
  return tl::unexpected(Error{.code = Errc::usage,
                              .message = "list what? neither a target nor a profile is named",
                              .hint = "try 'spindle list doga-bm'; 'spindle profile list' "
                                      "shows all profiles"});
}

/// People who ask for nothing particular see once what is there several times.
FoldedList without_repeats(std::vector<report::Record> records, const Subject& subject,
                           const Context& context) {
  if (!report::is_table(context.user.format) || !subject.patterns.empty()) {
    return {.records = std::move(records)};
  }
  return fold(std::move(records));
}

void tell_folded(const std::vector<std::string>& folded, const Context& context) {
  if (folded.empty()) return;
  const std::string& one = folded.front();
  context.renderer.note(fmt::format("told once: {}; '{}.*' lists one of them",
                                    fmt::join(folded, ", "), one.substr(0, one.find('-'))));
}

}  // namespace

Result<Outcome> list(const ListOptions& options, Context& context) {
  TRY_LET(const auto subject, subject_of(options, context));
  auto parameters = catalogue::meant_by(subject.patterns, subject.profile)
                        .and_then([&](const std::vector<std::string>& names) {
                          return subject.profile.describe(names);
                        });
  if (!parameters) {
    parameters.error().asked_of = subject.target;
    return tl::unexpected(std::move(parameters.error()));
  }
  Outcome outcome;
  const auto columns = parameter_columns(*parameters);
  std::vector<report::Record> records;
  records.reserve(parameters->size());
  for (const catalogue::Parameter& parameter : *parameters) {
    records.push_back(parameter_record(parameter, subject.target, context.clock));
    outcome.succeed();
  }
  const FoldedList told = without_repeats(std::move(records), subject, context);
  Listing listing(context, columns);
  for (const report::Record& record : told.records) listing.add(record);
  TRY(listing.end());
  tell_folded(told.folded, context);
  return outcome;
}

}  // namespace spindle::commands
