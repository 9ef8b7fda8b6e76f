#include "program.hpp"

#include "spindle/cli/run.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/posix/companion.hpp"
#include "spindle/posix/datagrams.hpp"
#include "spindle/posix/disk.hpp"
#include "spindle/posix/doors.hpp"
#include "spindle/posix/helper.hpp"
#include "spindle/posix/serve.hpp"
#include "spindle/posix/service.hpp"
#include "spindle/posix/signals.hpp"
#include "spindle/posix/streams.hpp"
#include "spindle/posix/world.hpp"
#include "spindle/shipped/profiles.hpp"

namespace spindle {
namespace {

using Words = std::vector<std::string>;

commands::Companions with_programs(commands::Companions own, const Words& words) {
  const auto go_on_as = [&words](std::string_view program) {
    return [program, words](const auto&, commands::Context&) -> Result<commands::Outcome> {
      return tl::unexpected(posix::go_on_as(program, words));
    };
  };
  if (!own.forward) own.forward = go_on_as("spindle-forward");
  if (!own.page) own.page = go_on_as("spindle-serve");
  own.start_forward = [](const Words& arguments, Clock& clock, const Interrupt& interrupt) {
    return posix::start_helper("spindle-forward", arguments, clock, interrupt);
  };
  return own;
}

}  // namespace

int run_program(int count, char** arguments, commands::Companions own) {
  using namespace posix;
  if (!hold_standard_descriptors()) return static_cast<int>(ExitStatus::internal);
  const Words words(arguments + 1, arguments + count);
  SignalWatch signals;
  SteadyClock clock(signals.interrupt());
  CalmTime calm;
  cli::World world{.io = standard_streams<report::Streams>(clock, signals.interrupt()),
                   .clock = clock,
                   .interrupt = signals.interrupt(),
                   .open = line_opener(clock, signals.interrupt()),
                   .uninterruptible = uninterruptible<work::Uninterruptible>(signals, calm),
                   .serve = tool_server(clock, signals.interrupt()),
                   .end_waits = [&] { signals.end_waits(); },
                   .environment = environment,
                   .disk = local_disk(environment("SPINDLE_TRUST").value_or("")),
                   .installation = installation(),
                   .make_doors = door_maker(clock, signals.interrupt()),
                   .shipped = shipped::profiles(),
                   .companions = with_programs(std::move(own), words),
                   .supervision = supervision<commands::Supervision>(signals),
                   .network = network(clock, signals.interrupt())};
  return cli::run(words, world);
}

}  // namespace spindle
