#include "watched_tool.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "spindle/work/shared_lines.hpp"

namespace spindle::commands {

Result<const KnownProfile*> ProfileShelf::take(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto known = profiles_.find(id);
  if (known != profiles_.end()) return known->second.get();
  TRY_LET(auto profile, store_->load(id));
  TRY_LET(auto tables, store_->load_code_tables(id));
  auto& place = profiles_[id];
  place = std::make_unique<const KnownProfile>(KnownProfile{std::move(profile), std::move(tables)});
  return place.get();
}

Result<WatchedTool> WatchedTool::make(Target target, const std::vector<std::string>& names,
                                      ProfileShelf& shelf, const Context& context) {
  WatchedTool tool(std::move(target), names, shelf, context);
  if (tool.target_.profile.empty()) return tool;
  return tool.adopt_profile(tool.target_.profile).map([&] { return tool; });
}

Result<void> WatchedTool::adopt_profile(const std::string& profile) {
  return shelf_->take(profile).map([&](const KnownProfile* known) { known_ = known; });
}

Result<void> WatchedTool::find_profile(const Context& context) {
  auto tool =
      open_tool(target_, catalogue::Profile(), Need::named_registers, Purpose::listen, context);
  if (!tool) return do_without_profile(std::move(tool.error()), context);
  target_ = tool->target;
  target_.profile = tool->profile->id;
  if (catalogue::sends_unasked(*tool->profile)) target_.endpoint.gateway.clear();
  return adopt_profile(target_.profile);
}

/// Raw registers can be read of a tool that says nothing of itself. One that did not even answer is
/// asked for them first: it may be asleep, and a known one when it wakes up.
Result<void> WatchedTool::do_without_profile(Error why, const Context& context) {
  const bool raw = !names_->empty() && std::all_of(names_->begin(), names_->end(), [](auto& name) {
    return name.starts_with('@');
  });
  const ExitStatus status = why.status();
  const bool may_pass = status == ExitStatus::no_answer || status == ExitStatus::malformed;
  const bool nameless =
      raw && (may_pass || status == ExitStatus::mismatch || status == ExitStatus::usage);
  if (!nameless) return tl::unexpected(std::move(why));
  if (may_pass) {
    const auto wanted = shelf_->nameless()->profile.select(*names_);
    auto device = connect_device(target_, shelf_->nameless()->profile, context);
    if (!wanted || !device || !device->read_each(*wanted, device::Limits::skip)) {
      return tl::unexpected(std::move(why));
    }
  }
  known_ = shelf_->nameless();
  return {};
}

/// Once, however often it is opened.
void WatchedTool::tell_other_serial(const device::Device& device) {
  if (!device.identity() || std::exchange(serial_is_checked_, true)) return;
  const std::string difference = other_serial(target_, device.identity()->serial);
  if (difference.empty()) return;
  context_->renderer.note(fmt::format("{}: warning: {}", target_.shown, difference));
}

Result<device::Watcher::Link> WatchedTool::open(Duration patience,
                                                const device::OpenTransport& open_transport) {
  Context hurried = with_lines(*context_, open_transport);
  const catalogue::LinkSpec facts =
      known_ == nullptr ? catalogue::LinkSpec() : known_->profile.link;
  const Duration usual = hurried.common.connect_timeout.value_or(facts.connect);
  hurried.common.connect_timeout = std::min(usual, patience);
  if (known_ == nullptr) {
    TRY(find_profile(hurried));
  }
  auto device =
      connect_device(target_, known_->profile, hurried, SimulatedOperator::working, late_answers_);
  if (!device) return tl::unexpected(std::move(device.error()));
  TRY(device->require_known_registers());
  tell_other_serial(*device);
  late_answers_ =
      link::SessionOptions::LateAnswers::possible;  // it is opened again after trouble only
  if (known_->profile.link.loopback) {
    TRY(device->require_answer());
  }
  std::string identity = device->identity_text();
  return device::Watcher::Link{std::move(*device), std::move(identity)};
}

Result<std::vector<WatchedTool>> prepare_tools(const std::vector<Target>& targets,
                                               const std::vector<std::string>& names,
                                               ProfileShelf& shelf, const Context& context) {
  std::vector<WatchedTool> tools;
  std::vector<catalogue::LinkSpec> facts;
  tools.reserve(targets.size());
  for (const Target& target : targets) {
    TRY_LET(auto tool, WatchedTool::make(target, names, shelf, context));
    const KnownProfile* known = tool.known();
    facts.push_back(known == nullptr ? catalogue::LinkSpec() : known->profile.link);
    tools.push_back(std::move(tool));
  }
  return check_same_settings(targets, facts).map([&] { return std::move(tools); });
}

}  // namespace spindle::commands
