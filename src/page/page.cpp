#include "spindle/page/page.hpp"

#include "spindle/work/store_place.hpp"

namespace spindle::page {

Result<commands::Outcome> run(const commands::ServeOptions& options, commands::Context& context) {
  TRY_LET(const auto path, work::store_place(options.store, context.state_folder));
  return tl::unexpected(
      Error{.code = Errc::bad_file, .message = "no page can be made of it yet", .name = path});
}

}  // namespace spindle::page
