#include "spindle/commands/context.hpp"

namespace spindle::commands {

namespace {

bool ends_all(ExitStatus status) {
  return status == ExitStatus::interrupted || status == ExitStatus::terminated;
}

/// What differs from one context to another.
struct Parts {
  Clock& clock;
  const Interrupt& interrupt;
  const device::OpenTransport& open;
  report::Renderer& renderer;
};

Context made_of(const Parts& parts, const Context& context) {
  return {.io = context.io,
          .clock = parts.clock,
          .interrupt = parts.interrupt,
          .open = parts.open,
          .calm = context.calm,
          .serve = context.serve,
          .end_waits = context.end_waits,
          .disk = context.disk,
          .state_folder = context.state_folder,
          .version = context.version,
          .profiles = context.profiles,
          .tools = context.tools,
          .renderer = parts.renderer,
          .common = context.common};
}

}  // namespace

Context calm_context(const Context& context) {
  const Calm& calm = context.calm;
  return made_of({calm.clock, calm.interrupt, calm.open, context.renderer}, context);
}

Context with_lines(const Context& context, const device::OpenTransport& open) {
  return made_of({context.clock, context.interrupt, open, context.renderer}, context);
}

Context with_renderer(const Context& context, report::Renderer& renderer) {
  return made_of({context.clock, context.interrupt, context.open, renderer}, context);
}

void Outcome::fail(const Error& error) { note_failures(1, error.status()); }

void Outcome::add(const Outcome& other) {
  succeeded_ += other.succeeded_;
  negative_ = negative_ || other.negative_;
  if (other.failed_ > 0) note_failures(other.failed_, other.first_);
  mixed_ = mixed_ || other.mixed_;
}

void Outcome::note_failures(std::size_t count, ExitStatus status) {
  if (failed_ == 0) first_ = status;
  failed_ += count;
  if (status != first_) mixed_ = true;
  if (ends_all(status)) first_ = status;
}

ExitStatus Outcome::status() const {
  if (failed_ == 0) return negative_ ? ExitStatus::negative : ExitStatus::ok;
  if (ends_all(first_)) return first_;
  return mixed_ || succeeded_ > 0 ? ExitStatus::partial : first_;
}

}  // namespace spindle::commands
