#include "spindle/commands/context.hpp"

namespace spindle::commands {

Context calm_context(const Context& context) {
  const Calm& calm = context.calm;
  return {{.clock = calm.clock, .interrupt = calm.interrupt, .open = calm.open}, context};
}

Context with_lines(const Context& context, const device::OpenTransport& open) {
  return {{.clock = context.clock, .interrupt = context.interrupt, .open = open}, context};
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
