#include "spindle/commands/context.hpp"

namespace spindle::commands {

namespace {

Context with(const Context& context, Clock& clock, const Interrupt& interrupt,
             const device::OpenTransport& open) {
  return {.io = context.io,
          .clock = clock,
          .interrupt = interrupt,
          .open = open,
          .calm = context.calm,
          .serve = context.serve,
          .end_waits = context.end_waits,
          .disk = context.disk,
          .state_folder = context.state_folder,
          .version = context.version,
          .profiles = context.profiles,
          .tools = context.tools,
          .renderer = context.renderer,
          .common = context.common};
}

}  // namespace

Context calm_context(const Context& context) {
  return with(context, context.calm.clock, context.calm.interrupt, context.calm.open);
}

Context with_lines(const Context& context, const device::OpenTransport& open) {
  return with(context, context.clock, context.interrupt, open);
}

void Outcome::fail(const Error& error) {
  const ExitStatus status = error.status();
  if (failed_++ == 0) first_ = status;
  if (status != first_) mixed_ = true;
  const bool ends_all = status == ExitStatus::interrupted || status == ExitStatus::terminated;
  if (ends_all) first_ = status;
}

ExitStatus Outcome::status() const {
  if (failed_ == 0) return negative_ ? ExitStatus::negative : ExitStatus::ok;
  if (first_ == ExitStatus::interrupted || first_ == ExitStatus::terminated) return first_;
  return mixed_ || succeeded_ > 0 ? ExitStatus::partial : first_;
}

}  // namespace spindle::commands
