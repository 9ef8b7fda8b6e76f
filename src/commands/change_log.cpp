#include "change_log.hpp"

#include <string>

namespace spindle::commands {

work::ChangeLog change_log(std::string_view command, const OpenTool& tool, const Context& context) {
  const auto& identity = tool.device.identity();
  return {{.command = std::string(command),
           .target = tool.target.shown,
           .serial = identity ? identity->serial : std::string(),
           .folder = context.state_folder},
          context.disk,
          context.clock,
          [&context](const std::string& sentence) { context.renderer.note(sentence); }};
}

std::string_view result_of_failure(const Error& error) {
  return device::is_refusal(error) ? "refused" : "unknown";
}

work::LoggedChange logged(const Deed& deed) {
  work::LoggedChange change{.name = deed.action.name,
                            .register_address = deed.action.address.value};
  if (deed.secrecy == catalogue::Secrecy::open) change.new_value = Decimal(deed.value);
  return change;
}

work::LoggedChange logged(const Deed& deed, const Result<device::ActionResult>& result) {
  work::LoggedChange change = logged(deed);
  change.result = result ? to_text(*result) : result_of_failure(result.error());
  return change;
}

Result<device::ActionResult> perform_recorded(const Deed& deed, OpenTool& tool,
                                              work::ChangeLog& log, const Context& context) {
  const std::string id = log.begin(logged(deed));
  auto result = perform_deed(deed, tool, context);
  log.end(id, logged(deed, result));
  return result;
}

}  // namespace spindle::commands
