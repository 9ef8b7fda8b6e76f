#include "spindle/cli/run.hpp"
#include "spindle/posix/disk.hpp"
#include "spindle/posix/serve.hpp"
#include "spindle/posix/signals.hpp"
#include "spindle/posix/world.hpp"
#include "spindle/shipped/profiles.hpp"

int main(int count, char** arguments) {
  using namespace spindle::posix;
  if (!hold_standard_descriptors()) return static_cast<int>(spindle::ExitStatus::internal);
  SignalWatch signals;
  SteadyClock clock(signals.interrupt());
  CalmTime calm;
  spindle::cli::World world{
      .io = standard_streams<spindle::report::Streams>(clock, signals.interrupt()),
      .clock = clock,
      .interrupt = signals.interrupt(),
      .open = line_opener(clock, signals.interrupt()),
      .uninterruptible = uninterruptible<spindle::work::Uninterruptible>(signals, calm),
      .serve = tool_server(clock, signals.interrupt()),
      .end_waits = [&] { signals.end_waits(); },
      .environment = environment,
      .disk = local_disk(environment("SPINDLE_TRUST").value_or("")),
      .installation = installation(),
      .shipped = spindle::shipped::profiles()};
  return spindle::cli::run({arguments + 1, arguments + count}, world);
}
