#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "motor_records.hpp"
#include "owning.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/device/run_model.hpp"
#include "spindle/store/reader.hpp"
#include "spindle/work/event_rows.hpp"
#include "spindle/work/store_place.hpp"
#include "watch_plan.hpp"
#include "watch_stream.hpp"
#include "watched_tool.hpp"
#include "watching.hpp"

namespace spindle::commands {
namespace {

/// What a store knows of the last events, where there is one. Several threads may ask.
class Memory {
 public:
  /// The user's own store need not be there; one that was named has to.
  static Result<std::unique_ptr<Memory>> open(const WatchOptions& options, const Context& context) {
    auto memory = std::make_unique<Memory>();
    const auto path = work::store_place(options.store, context.state_folder);
    const bool is_named = !options.store.empty();
    if (!is_named && (!path || context.disk.absent(*path))) return memory;
    auto reader = store::Reader::open(*path);
    if (reader) {
      memory->reader_ = std::move(*reader);
    } else if (is_named) {
      return tl::unexpected(std::move(reader.error()));
    } else {
      context.renderer.note(fmt::format("what was recorded before is not known: {}: {}", *path,
                                        message_of(reader.error())));
    }
    return memory;
  }

  [[nodiscard]] bool is_there() const { return reader_ != nullptr; }

  Result<std::optional<store::Last>> last(const store::ToolName& name) {
    const std::lock_guard lock(mutex_);
    return reader_->last(name);
  }

 private:
  std::mutex mutex_ = {};
  std::unique_ptr<store::Reader> reader_ = nullptr;
};

/// One tool of a watch.
class WatchListener final : public Listener {
 public:
  WatchListener(const Target& target, const WatchOptions& options, Memory& memory,
                WatchStream& stream, const Context& context)
      : target_(target.shown),
        options_(&options),
        memory_(&memory),
        stream_(&stream),
        context_(&context) {
    voice_.records.emplace(target, unknown_, catalogue::CodeTables());
  }

  TimePoint until() override { return stream_->until(); }
  void opened(const WatchedTool& tool) override {
    voice_.records.emplace(tool.target(), tool.known()->profile, tool.known()->tables);
  }
  device::WatchControl tell(const device::WatchEvent& news) override {
    if (const auto* gap = std::get_if<device::EventGap>(&news)) epochs_.note(*gap);
    const bool is_event = std::holds_alternative<device::ToolEvent>(news);
    if (is_event && epochs_.begins() && voice_.naming.epoch) ++*voice_.naming.epoch;
    return stream_->tell(news, voice_);
  }
  void left(const Result<void>& watched, const std::optional<Error>& unreached) override {
    stream_->leave(watched, unreached, voice_);
  }
  device::RecordHooks hooks() override {
    return {.on_connected = [this](device::Device& device) { return look_up(device); }};
  }

 private:
  /// Which event was the last one that is known.
  Result<device::RecordedPast> look_up(const device::Device& device) {
    const store::ToolName name = work::name_of(device, target_);
    const bool is_known = std::exchange(known_, name) == name;
    voice_.naming.serial = name.serial;
    if (is_known) return device::RecordedPast();
    device::RecordedPast past;
    if (memory_->is_there()) {
      TRY_LET(const auto last, memory_->last(name));
      voice_.naming.epoch = last ? last->epoch : 0;
      if (last) past.last = work::last_event_of(*last, context_->clock.wall());
    }
    if (options_->since_event) past.last = device::LastEvent{.number = *options_->since_event};
    return past;
  }

  const catalogue::Profile unknown_ = {};
  std::string target_;
  const WatchOptions* options_;
  Memory* memory_;
  WatchStream* stream_;
  const Context* context_;
  Voice voice_ = {};
  work::EpochFollower epochs_ = {};
  std::optional<store::ToolName> known_ = std::nullopt;
};

}  // namespace

Result<Outcome> watch(const WatchOptions& options, Context& context) {
  ProfileShelf shelf(context.profiles);
  TRY_LET(auto resolved, resolve_targets(options.targets, context));
  const std::vector<Error> faults = take_out_faulty(resolved);
  TRY_LET(auto tools, prepare_tools(resolved, options.names, shelf, context));
  for (const WatchedTool& tool : tools) {
    if (auto checked = check_watch(options, tool, shelf, context); !checked) {
      checked.error().asked_of = tool.target().shown;
      return tl::unexpected(std::move(checked.error()));
    }
  }
  if (options.since_event && tools.size() > 1) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "--since-event is about one tool, and several are to be watched",
              .hint = "watch one, or leave it out: a store knows the last event of each"});
  }
  TRY_LET(auto memory, Memory::open(options, context));
  std::vector<Target> targets;
  for (const WatchedTool& tool : tools) targets.push_back(tool.target());
  std::vector<std::string> names;
  for (const Target& target : targets) names.push_back(target.shown);
  WatchStream stream(options, names, columns_for(tools, shelf, options, context), context);
  if (!stream.is_open()) return stream.finish();
  for (const Error& fault : faults) stream.fail(fault);
  const auto note = [&](const std::string& sentence) { stream.note(sentence); };
  OwnedLines lines(targets, context, note);
  TRY(let_others_ask(lines, options.gateway, note));
  const device::OpenTransport open_transport = lines.opener();
  const auto plan = [&](const catalogue::Profile& profile) { return plan_watch(options, profile); };
  for_each_side_by_side(tools, [&](WatchedTool& tool) {
    WatchListener listener(tool.target(), options, *memory, stream, context);
    watch_tool(tool, open_transport, plan, options.reconnection, listener, context);
  });
  return stream.finish();
}

}  // namespace spindle::commands
