#include "storing.hpp"

#include "actions.hpp"
#include "listing.hpp"

namespace spindle::commands {

Result<void> check_storing(Storing storing, const catalogue::Profile& profile) {
  if (storing == Storing::no || profile.find_action(store_action)) return {};
  return tl::unexpected(Error{.code = Errc::usage,
                              .message = "this product stores what it is told by itself",
                              .hint = "leave --save out",
                              .name = "--save"});
}

Result<void> store(OpenTool& tool, work::ChangeLog& log, Outcome& outcome, Context& context) {
  TRY_LET(auto request, parse_action(std::string(store_action), *tool.profile));
  tell_notes(request, tool.target, context);
  const auto result = perform_recorded(request, tool, log, context);
  Context own = about(context, tool.target);
  Listing listing(own, performed_columns());
  if (result) listing.add(performed_record(request, *result, tool.target, context.clock));
  std::optional<Error> error;
  if (!result) error = result.error();
  if (result == device::ActionResult::not_confirmed) error = not_confirmed(request);
  if (error) {
    outcome.fail(*error);
    listing.add(*error);
  }
  return listing.end();
}

}  // namespace spindle::commands
