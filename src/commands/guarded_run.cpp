#include "guarded_run.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace spindle::commands {

GuardedRun::GuardedRun(OpenTool& tool, Context& context)
    : tool_(&tool), context_(&context), progress_(context), calm_context_(calm_context(context)) {}

device::RunGuard::Reopen GuardedRun::reopener() {
  return [this](Duration patience) {
    progress_.show("the link is lost; trying to stop the tool");
    const Duration usual = context_->common.connect_timeout.value_or(tool_->profile->link.connect);
    calm_context_.common.connect_timeout = std::min(usual, patience);
    return connect_device(tool_->target, *tool_->profile, calm_context_);
  };
}

Result<void> GuardedRun::check_reader() const {
  const bool closed = context_->io.out_is_open && !context_->io.out_is_open();
  if (!closed) return {};
  return tl::unexpected(Error{.code = Errc::closed_pipe});
}

void GuardedRun::show_running(Duration elapsed, std::string_view more) {
  const auto tenths = std::chrono::duration_cast<std::chrono::milliseconds>(elapsed).count() / 100;
  progress_.refresh(fmt::format("running {}.{} s{}", tenths / 10, tenths % 10, more));
}

void GuardedRun::fail(const Error& error) {
  outcome_.fail(error);
  errors_.push_back(error);
}

void GuardedRun::fail(const device::StopReport& unconfirmed) {
  outcome_ = {};
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(unconfirmed.tried).count();
  fail(tool_->target.blamed(
      {.code = Errc::no_answer,
       .message = fmt::format("THE TOOL MAY STILL RUN: the stop was tried for {} s ({} times) and "
                              "could not be confirmed: {}",
                              seconds, unconfirmed.attempts, unconfirmed.trouble),
       .hint = "stop it at the tool"}));
}

Result<void> GuardedRun::tell_errors() {
  Result<void> told;
  for (const Error& error : errors_) {
    auto written = context_->renderer.error(error, context_->clock.wall());
    if (told) told = std::move(written);
  }
  return told;
}

}  // namespace spindle::commands
