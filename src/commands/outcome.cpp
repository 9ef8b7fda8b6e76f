#include "spindle/commands/context.hpp"

namespace spindle::commands {

namespace {

bool ends_all(ExitStatus status) {
  return status == ExitStatus::interrupted || status == ExitStatus::terminated;
}

}  // namespace

Context uninterruptible_context(const Context& context) {
  const Surroundings& surroundings = context;
  const Telling& telling = context;
  return {uninterruptible(context), surroundings, telling};
}

Context with_lines(const Context& context, const device::OpenTransport& open) {
  const Environment& environment = context;
  const Surroundings& surroundings = context;
  const Telling& telling = context;
  return {work::with_lines(environment, open), surroundings, telling};
}

Context with_renderer(const Context& context, report::Renderer& renderer) {
  const Environment& environment = context;
  const Surroundings& surroundings = context;
  return {environment, surroundings, {.renderer = renderer}};
}

Context about(const Context& context, const Target& target) {
  Context same = context;
  same.about = &target;
  return same;
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
