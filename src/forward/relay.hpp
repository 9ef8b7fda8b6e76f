#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "backoff.hpp"
#include "outbox.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/commands/metrics.hpp"
#include "spindle/commands/service_news.hpp"
#include "spindle/forward/sink.hpp"
#include "spindle/store/sinks.hpp"
#include "tool_states.hpp"

namespace spindle::forward {

/// Brings what is in a store to a sink, at least once: the sink's place in the store moves behind
/// what it acknowledged, and not much later, so that after a crash no more is sent again than may
/// be on its way at once. What fails is told when it is another failure than before, and tried
/// again for ever; nothing is left out.
class Relay {
 public:
  struct Means {
    commands::StoredRows& rows;
    store::SinkCursor& cursor;
    Sink& sink;
    const files::Sink& settings;
    std::string collector;
    const commands::ForwardOptions& options;
    commands::Context& context;
    commands::ServiceNews& news;
    /// Whether new settings were asked for since this was last asked; may be empty.
    std::function<bool()> take_reload = {};
  };

  explicit Relay(Means means);

  /// Until a signal comes, or with Delivery::once until the sink has what was there at first.
  Result<commands::Outcome> run();

 private:
  Result<void> prepare();
  Result<void> work();
  Result<void> serve();
  Result<void> connect();
  Result<void> step();
  Result<void> deliver();
  Result<void> save();
  Result<void> save_when_due();
  Result<void> tell_states();
  [[nodiscard]] bool is_done() const;
  [[nodiscard]] bool is_ended() const { return means_.context.interrupt.raised(); }
  void fail(const Error& error);
  /// What comes back: an acknowledgement, or a connection that has lasted.
  void note_success(bool is_acknowledged);
  void wait(Duration time);
  void look_around();
  void write_metrics();
  Result<commands::Outcome> finish(const Result<void>& worked);
  [[nodiscard]] TimePoint now() const { return means_.context.clock.now(); }
  [[nodiscard]] WallTime wall() const { return means_.context.clock.wall(); }

  Means means_;
  std::optional<store::Positions> end_ = std::nullopt;  ///< of Delivery::once
  std::optional<Outbox> outbox_ = std::nullopt;
  ToolStates states_;
  Backoff backoff_;
  commands::SinkMetrics counters_ = {};
  std::size_t unsaved_ = 0;   ///< acknowledged, and not said so in the store yet
  bool is_going_on_ = false;  ///< something was acknowledged, or nothing waited, since a failure
  std::string told_ = {};     ///< the failure that was told; empty: there is none
  std::string trouble_ = {};  ///< with the file of metrics, as was told
  TimePoint connected_at_ = {};
  TimePoint saved_at_ = {};
  TimePoint stated_at_ = {};
  TimePoint looked_at_ = {};
  TimePoint counted_at_ = {};
};

}  // namespace spindle::forward
