#include "change_log.hpp"

#include <fmt/format.h>

namespace spindle::commands {

LoggedChange logged(const catalogue::Parameter& parameter, const catalogue::Value& before,
                    const catalogue::Value& after, std::string_view result) {
  LoggedChange change{.name = parameter.name,
                      .register_address = parameter.address.value,
                      .result = std::string(result)};
  if (parameter.secrecy == catalogue::Secrecy::secret) return change;
  change.old_value = before.number;
  change.new_value = after.number;
  return change;
}

std::string_view result_of_failure(const Error& error) {
  return error.code == Errc::exception_response ? "refused" : "unknown";
}

LoggedChange logged(const Deed& deed, const Result<device::ActionResult>& result) {
  LoggedChange change{.name = deed.action.name,
                      .register_address = deed.action.address.value,
                      .new_value = Decimal(deed.value)};
  change.result = result ? to_text(*result) : result_of_failure(result.error());
  return change;
}

void ChangeLog::add(const LoggedChange& change) {
  const auto& identity = tool_->device.identity();
  const auto written =
      append(files::render_change({.time = report::to_text(context_->clock.wall()),
                                   .user = context_->disk.user(),
                                   .command = command_,
                                   .target = tool_->target.shown,
                                   .serial = identity ? identity->serial : std::string(),
                                   .name = change.name,
                                   .register_address = change.register_address,
                                   .old_value = change.old_value,
                                   .new_value = change.new_value,
                                   .result = change.result}));
  if (written || warned_) return;
  warned_ = true;
  context_->renderer.note(
      fmt::format("warning: changes are not recorded: {}", describe(written.error())));
}

Result<void> ChangeLog::append(const std::string& line) {
  const std::string& folder = context_->state_folder;
  if (folder.empty()) {
    return tl::unexpected(
        Error{.code = Errc::bad_file, .message = "neither XDG_STATE_HOME nor HOME is set"});
  }
  if (!folder_made_) {
    if (auto made = context_->disk.make_folders(folder, Privacy::own); !made) return made;
    folder_made_ = true;
  }
  return context_->disk.append(folder + "/changes.jsonl", line);
}

}  // namespace spindle::commands
