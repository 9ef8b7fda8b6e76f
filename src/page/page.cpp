#include "spindle/page/page.hpp"

#include <fmt/format.h>

#include "page/access.hpp"
#include "page/live.hpp"
#include "page/shift.hpp"
#include "page/site.hpp"
#include "page/store_poll.hpp"
#include "spindle/work/store_place.hpp"

namespace spindle::page {
namespace {

constexpr Duration look_every = std::chrono::milliseconds(400);

Error no_token() {
  return {.code = Errc::usage,
          .message = "other computers could see the page without a token",
          .hint = "name a file with one by --token-file, or listen on 127.0.0.1",
          .name = "--listen"};
}

}  // namespace

Result<commands::Outcome> run(const commands::ServeOptions& options, commands::Context& context) {
  TRY_LET(const auto path, work::store_place(options.store, context.state_folder));
  TRY_LET(auto shifts, parse_shifts(options.shifts));
  SiteFacts facts{.store = path};
  TRY_LET(facts.place, parse_listen(options.listen));
  if (!options.token_file.empty()) {
    TRY_LET(facts.token, read_token(options.token_file, context.disk));
  } else if (!is_loopback(facts.place)) {
    return tl::unexpected(no_token());
  }
  TRY_LET(auto listener, listen_on(facts.place));
  const std::string url = url_of(facts.place);

  Live live(context.clock, {.version = std::string(context.version), .store = path});
  StorePoll poll(path, std::move(shifts), live, context);
  poll.look();
  Site site(std::move(listener), std::move(facts), live, context);
  context.renderer.note(fmt::format("{} shows what is recorded in {}", url, path));
  // Being asked to end is how this ends.
  while (context.clock.sleep_until(context.clock.now() + look_every)) poll.look();
  site.stop();
  commands::Outcome outcome;
  outcome.succeed();
  return outcome;
}

}  // namespace spindle::page
