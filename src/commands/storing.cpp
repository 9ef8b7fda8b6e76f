#include "storing.hpp"

#include "deeds.hpp"
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
  auto deed = parse_deed(std::string(store_action), *tool.profile);
  if (!deed) return tl::unexpected(std::move(deed.error()));
  tell_notes(*deed, tool.target, context);
  const auto result = perform_recorded(*deed, tool, log, context);
  Listing listing(context, deed_columns());
  if (result) listing.add(deed_record(*deed, *result, tool.target, context.clock));
  std::optional<Error> error;
  if (!result) error = result.error();
  if (result == device::ActionResult::not_confirmed) error = not_confirmed(*deed, tool.target);
  if (error) {
    outcome.fail(*error);
    listing.add(*error);
  }
  return listing.end();
}

}  // namespace spindle::commands
