#include "spindle/work/store_place.hpp"

namespace spindle::work {

Result<std::string> store_place(const std::string& named, const std::string& state_folder) {
  if (!named.empty()) return named;
  if (!state_folder.empty()) return state_folder + "/events.db";
  return tl::unexpected(Error{.code = Errc::usage,
                              .message = "there is no folder for the store",
                              .hint = "name a file by --store, or set HOME"});
}

}  // namespace spindle::work
