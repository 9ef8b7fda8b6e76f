#include "spindle/work/change_log.hpp"

#include <fmt/format.h>

#include <utility>

#include "spindle/base/duration.hpp"
#include "spindle/work/snapshot.hpp"

namespace spindle::work {

namespace {

/// Of what is no number its text, or its registers where that is none; nothing where there is no
/// value.
std::optional<files::LoggedValue> logged_value(const catalogue::Value& value) {
  if (value.is_number()) return value.number;
  if (value.content == catalogue::Content::none) return std::nullopt;
  return value.exact();
}

/// Short enough to be typed: of ten thousand commands, two have the same with a chance of one in a
/// hundred, and then both are named where one is meant. FNV-1a, 64 bits folded to 32.
std::string short_id(std::string_view text) {
  std::uint64_t number = 0xCBF29CE484222325U;
  for (const char c : text) number = (number ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
  return fmt::format("{:08x}", static_cast<std::uint32_t>(number ^ (number >> 32U)));
}

std::string run_of(std::string_view command, const std::string& target, const Disk& disk,
                   const Clock& clock) {
  return short_id(fmt::format("{} {} {} {}", disk.process(),
                              clock.wall().time_since_epoch().count(), target, command));
}

}  // namespace

LoggedChange logged(const catalogue::Parameter& parameter, const catalogue::Value& before,
                    const catalogue::Value& after, std::string_view result, const Target& target) {
  LoggedChange change{.name = parameter.name,
                      .register_address = parameter.address.value,
                      .result = std::string(result),
                      .unit = unit_of(parameter, target)};
  if (parameter.secrecy == catalogue::Secrecy::secret) return change;
  change.old_value = logged_value(before);
  change.new_value = logged_value(after);
  if (before.is_number()) change.old_label = before.label;
  if (after.is_number()) change.new_label = after.label;
  return change;
}

std::string ChangeLog::begin(LoggedChange change) {
  if (run_.empty()) {
    run_ = options_.run.empty() ? run_of(options_.command, options_.target, *disk_, *clock_)
                                : options_.run;
  }
  const std::string id = fmt::format("{}-{}", run_, ++begun_);
  change.result = files::begun;
  add(change, id);
  return id;
}

void ChangeLog::end(const std::string& id, const LoggedChange& change) { add(change, id); }

void ChangeLog::add(const LoggedChange& change, const std::string& id) {
  const auto undoes = options_.undoes.find(change.name);
  const auto written = append(files::render_change(
      {.time = to_text(clock_->wall()),
       .user = disk_->user(),
       .command = options_.command,
       .target = options_.target,
       .serial = options_.serial,
       .name = change.name,
       .register_address = change.register_address,
       .old_value = change.old_value,
       .new_value = change.new_value,
       .result = change.result,
       .id = id,
       .unit = change.unit,
       .old_label = change.old_label,
       .new_label = change.new_label,
       .undoes = undoes == options_.undoes.end() ? std::string() : undoes->second}));
  if (written || warned_) return;
  warned_ = true;
  warn_(fmt::format("warning: changes are not recorded: {}", describe(written.error())));
}

Result<void> ChangeLog::append(const std::string& line) {
  const std::string& folder = options_.folder;
  if (folder.empty()) {
    return tl::unexpected(
        Error{.code = Errc::bad_file, .message = "neither XDG_STATE_HOME nor HOME is set"});
  }
  if (!folder_made_) {
    TRY(disk_->make_folders(folder, Privacy::own));
    folder_made_ = true;
  }
  return disk_->append_line(folder + "/changes.jsonl", line);
}

std::string new_run(std::string_view command, const std::string& target,
                    const Environment& environment) {
  return run_of(command, target, environment.disk, environment.clock);
}

ChangeLog change_log(std::string_view command, const OpenTool& tool, const Environment& environment,
                     ChangeLog::Warn warn, std::string run,
                     std::map<std::string, std::string> undoes) {
  const auto& identity = tool.device.identity();
  return {{.command = std::string(command),
           .target = tool.target.shown,
           .serial = identity ? identity->serial : std::string(),
           .folder = environment.state_folder,
           .run = std::move(run),
           .undoes = std::move(undoes)},
          environment.disk,
          environment.clock,
          std::move(warn)};
}

}  // namespace spindle::work
