#include <fmt/format.h>

#include <array>
#include <filesystem>

#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {
namespace {

using report::Align;

const std::array<report::Column, 3> columns = {
    {{"PROFILE", "profile"}, {"PARAMETERS", "parameters", Align::right}, {"FILE", "file"}}};

/// Larger files are no profiles.
constexpr std::size_t largest_profile = std::size_t{1} << 20;

Result<files::RegisterMap> read_map(const ProfileNewOptions& options, const Context& context) {
  if (options.map.empty()) return files::RegisterMap();
  return context.disk.read(options.map).and_then([&](const std::string& text) {
    return files::read_register_map(text, options.map, options.numbering);
  });
}

void tell_warnings(const files::RegisterMap& map, const std::string& path, Context& context) {
  for (const files::MapWarning& warning : map.warnings) {
    context.renderer.note(fmt::format("{}:{}: {}", path, warning.line, warning.message));
  }
  if (map.faulty > 0) {
    context.renderer.note(fmt::format("{} left out", counted(map.faulty, "row")));
  }
  if (!map.hint.empty()) context.renderer.note(map.hint);
}

report::Record profile_record(const std::string& name, const files::RegisterMap& map,
                              const std::string& path, const Clock& clock) {
  return {.type = "profile",
          .target = {},
          .time = clock.wall(),
          .fields = {{"profile", name},
                     {"title", name},
                     {"parameters", count(map.entries.empty() ? 1 : map.entries.size())},
                     {"actions", count(0)},
                     {"file", path}}};
}

}  // namespace

Result<Outcome> profile_new(const ProfileNewOptions& options, Context& context) {
  const auto refuse = [](Errc code, std::string name, std::string message, std::string hint) {
    Error error{.code = code, .message = std::move(message), .hint = std::move(hint)};
    error.name = std::move(name);
    return tl::unexpected(std::move(error));
  };
  if (!files::may_name_profile(options.name)) {
    return refuse(Errc::usage, options.name,
                  "a profile's name is made of lower-case words and numbers joined by '-' or '.'",
                  "write for example my-driver");
  }
  const std::string path = options.name + ".yaml";
  if (context.disk.exists(path)) {
    return refuse(Errc::usage, path, "this file exists already", "choose another name");
  }
  TRY_LET(const auto map, read_map(options, context));
  if (!options.map.empty() && map.entries.empty()) {
    tell_warnings(map, options.map, context);
    return refuse(Errc::bad_file, options.map, "no row of it is a register", {});
  }
  const std::string source = std::filesystem::path(options.map).filename().string();
  const std::string text = files::render_profile(options.name, map, source);
  if (text.size() > largest_profile) {
    return refuse(Errc::bad_file, options.map, "this is more than a profile can hold",
                  "split it, or leave out what is not needed");
  }
  auto written = context.disk.write(path, text, Overwrite::refuse, Privacy::usual);
  if (!written) return tl::unexpected(std::move(written.error()));
  tell_warnings(map, options.map, context);
  Outcome outcome;
  outcome.succeed();
  Listing listing(context, columns);
  listing.add(profile_record(options.name, map, path, context.clock));
  return finish(listing, outcome);
}

}  // namespace spindle::commands
