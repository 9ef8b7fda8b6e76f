#include "spindle/cli/run.hpp"
#include "spindle/posix/disk.hpp"
#include "spindle/posix/serve.hpp"
#include "spindle/posix/signals.hpp"
#include "spindle/posix/world.hpp"

int main(int count, char** arguments) {
  using namespace spindle::posix;
  if (!hold_standard_descriptors()) return static_cast<int>(spindle::ExitStatus::internal);
  SignalWatch signals;
  SteadyClock clock(signals.interrupt());
  CalmTime calm;
  spindle::cli::World world{
      .io = {write_out, write_err, line_reader(clock, signals.interrupt()), is_terminal(Std::in),
             is_terminal(Std::out), is_terminal(Std::err), out_is_open, err_is_ready, err_columns,
             out_ends_within_line},
      .clock = clock,
      .interrupt = signals.interrupt(),
      .open = line_opener(clock, signals.interrupt()),
      .calm = {calm.clock, calm.interrupt, line_opener(calm), [&] { signals.stay_awake(); },
               [&](std::string_view words) { signals.set_last_words(words); }, start_guardian},
      .serve = tool_server(clock, signals.interrupt()),
      .end_waits = [&] { signals.end_waits(); },
      .environment = environment,
      .disk = local_disk(),
      .installation = installation()};
  return spindle::cli::run({arguments + 1, arguments + count}, world);
}
