#include "new_tool.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "spindle/link/endpoint.hpp"
#include "spindle/work/meeting.hpp"

namespace spindle::commands {
namespace {

constexpr std::string_view unasked = "--offline adds it without asking";

/// Files say what a shell may leave out.
std::string whole_url(const std::string& typed, const link::Endpoint& endpoint) {
  if (endpoint.medium == link::Medium::tcp && !typed.starts_with("tcp:")) return "tcp://" + typed;
  if (endpoint.medium != link::Medium::serial || typed.starts_with("rtu:")) return typed;
  const std::size_t question = std::min(typed.find('?'), typed.size());
  return fmt::format("rtu://{}{}", endpoint.device, typed.substr(question));
}

/// A file is meant in the present folder on a command line, and in that of the tools file there.
std::string profile_for_file(const std::string& profile, const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const bool is_here = folder.empty() || folder == ".";
  if (is_here || !files::names_profile_file(profile)) return profile;
  return std::filesystem::absolute(profile).lexically_normal().string();
}

bool has_torques(const catalogue::Profile& profile) {
  return std::any_of(
      profile.parameters.begin(), profile.parameters.end(),
      [](const auto& parameter) { return parameter.unit == catalogue::torque_unit; });
}

void add_hint(Error& error, std::string_view hint) {
  const std::string known = hint_of(error);
  error.hint = known.empty() ? std::string(hint) : fmt::format("{}; {}", known, hint);
}

/// The error of a tool that could not be asked, or says what nothing fits.
Error not_known(Error error, const Target& target) {
  if (error.code == Errc::exception_response && target.profile.empty()) {
    error.message = fmt::format("it does not say who it is: {}", message_of(error));
    error.hint = "name its profile with --profile; 'spindle profile list' shows all";
  } else if (error.status() == ExitStatus::mismatch && !target.profile.empty()) {
    error.hint = "leave --profile out: the tool says which one fits";
  } else {
    add_hint(error, unasked);
  }
  return with_target(std::move(error), target);
}

Error fits_nothing(const Identification& found) {
  return {.code = Errc::mismatch,
          .message = fmt::format("no profile fits what it says of itself: {}",
                                 fmt::join(found.identity.notes, "; ")),
          .hint = "name its profile with --profile"};
}

}  // namespace

Result<NewEntry> entry_as_typed(const ToolAddOptions& options, const std::string& path,
                                const Context& context) {
  if (link::looks_like_url(options.name)) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = fmt::format("'{}' is an address, and no name for a tool", options.name),
              .hint = "the name comes first, such as 'spindle tools add station3 "
                      "tcp://192.168.10.23:5000'"});
  }
  TRY_LET(auto endpoint, link::parse_endpoint(options.url));
  NewEntry entry{.tool = {.name = options.name,
                          .url = whole_url(options.url, endpoint),
                          .profile = profile_for_file(context.common.profile, path),
                          .torque_unit = options.torque_unit}};
  entry.target = {
      .shown = options.name, .endpoint = std::move(endpoint), .torque_unit = options.torque_unit};
  entry.target.endpoint.text = entry.tool.url;
  entry.target.profile =
      context.common.profile.empty() ? entry.target.endpoint.profile : context.common.profile;
  TRY_LET(const auto profile, load_profile(entry.target, context));
  if (entry.target.profile.empty() && entry.target.endpoint.medium != link::Medium::tcp) {
    return tl::unexpected(unproven(entry.target));
  }
  TRY(check_addressing(entry.target, profile));
  return entry;
}

Result<void> ask_who_it_is(NewEntry& entry, const Context& context) {
  const Target& target = entry.target;
  auto met = load_profile(target, context).and_then([&](catalogue::Profile profile) {
    return open_tool(target, std::move(profile), Need::raw_registers, Purpose::read, context)
        .and_then([&](OpenTool tool) {
          return work::meet(tool, context).map([&](Meeting meeting) {
            const auto& matched = meeting.found.matched;
            const catalogue::Profile& known = matched ? *matched : *tool.profile;
            const bool wants_unit = has_torques(known) && known.torque_unit_from.empty() &&
                                    entry.tool.torque_unit.empty();
            if (wants_unit) {
              entry.notes.emplace_back(
                  "torques have no unit until the entry has one: add --torque-unit, such as N.m");
            }
            return meeting;
          });
        });
  });
  if (!met) return tl::unexpected(not_known(std::move(met.error()), target));
  const Identification& found = met->found;
  if (met->misfit) return tl::unexpected(not_known(std::move(*met->misfit), target));
  if (found.candidates.empty()) return tl::unexpected(not_known(fits_nothing(found), target));
  entry.notes.insert(entry.notes.begin(), found.identity.notes.begin(), found.identity.notes.end());
  if (target.profile.empty()) entry.tool.profile = found.profile;
  if (found.profile.empty()) {
    entry.notes.push_back(
        fmt::format("its profile is found at each start: {} fit; --profile chooses one",
                    fmt::join(found.candidates, " and ")));
  }
  entry.tool.serial = found.identity.serial;
  entry.model = found.identity.tool_model;
  return {};
}

}  // namespace spindle::commands
