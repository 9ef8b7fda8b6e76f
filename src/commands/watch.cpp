#include <algorithm>
#include <optional>
#include <utility>

#include "motor_records.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/device/run_model.hpp"
#include "spindle/work/shared_lines.hpp"
#include "watch_plan.hpp"
#include "watch_stream.hpp"
#include "watched_tool.hpp"
#include "watching.hpp"

namespace spindle::commands {
namespace {

/// One tool of a watch.
class WatchListener final : public Listener {
 public:
  WatchListener(const Target& target, WatchStream& stream) : stream_(&stream) {
    voice_.records.emplace(target, unknown_, catalogue::CodeTables());
  }

  TimePoint until() override { return stream_->until(); }
  void opened(const WatchedTool& tool) override {
    voice_.records.emplace(tool.target(), tool.known()->profile, tool.known()->tables);
  }
  device::WatchControl tell(const device::WatchEvent& news) override {
    return stream_->tell(news, voice_);
  }
  void left(const Result<void>& watched, const std::optional<Error>& unreached) override {
    stream_->leave(watched, unreached, voice_);
  }

 private:
  const catalogue::Profile unknown_ = {};
  WatchStream* stream_;
  Voice voice_ = {};
};

}  // namespace

Result<Outcome> watch(const WatchOptions& options, Context& context) {
  ProfileShelf shelf(context.profiles);
  auto tools = prepare_tools(options.targets, options.names, shelf, context);
  if (!tools) return tl::unexpected(std::move(tools.error()));
  for (const WatchedTool& tool : *tools) {
    if (auto checked = check_watch(options, tool, shelf, context); !checked) {
      checked.error().asked_of = tool.target().shown;
      return tl::unexpected(std::move(checked.error()));
    }
  }
  std::vector<Target> targets;
  for (const WatchedTool& tool : *tools) targets.push_back(tool.target());
  SharedLines lines(targets, context);
  const device::OpenTransport open_transport = lines.opener();
  WatchStream stream(options, tools->size(), columns_for(*tools, shelf, options, context), context);
  const auto plan = [&](const catalogue::Profile& profile) { return plan_watch(options, profile); };
  for_each_side_by_side(*tools, [&](WatchedTool& tool) {
    WatchListener listener(tool.target(), stream);
    watch_tool(tool, open_transport, plan, options.reconnection, listener, context);
  });
  return stream.finish();
}

}  // namespace spindle::commands
