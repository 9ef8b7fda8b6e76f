#pragma once

#include <cstddef>
#include <mutex>
#include <string>

#include "spindle/commands/metrics.hpp"
#include "spindle/store/writer.hpp"

namespace spindle::commands {

/// What a recorder counts while it runs. Several threads may call it.
class RecordCounters {
 public:
  /// The tool of this name is recorded from now on, and is not connected yet.
  void begin(const std::string& tool);
  /// It is not recorded any more.
  void leave(const std::string& tool);
  void note_link(const std::string& tool, bool is_up);
  /// What became a row.
  void note_stored(const std::string& tool, const store::Event& event);
  void note_stored(const std::string& tool, const store::Gap& gap);
  void note_commit(Duration took);

  [[nodiscard]] std::size_t connected() const;
  [[nodiscard]] std::uint64_t results() const;
  /// Everything that was counted, and nothing of what others know.
  [[nodiscard]] Metrics metrics() const;

 private:
  mutable std::mutex mutex_ = {};
  Metrics metrics_ = {.commits = Histogram()};
};

/// A writer whose commits are timed. Both must outlive it.
class TimedWriter final : public store::Writer {
 public:
  TimedWriter(store::Writer& writer, RecordCounters& counters, const Clock& clock)
      : writer_(&writer), counters_(&counters), clock_(&clock) {}

  Result<store::RowId> tool(const store::ToolName& name, const std::string& model) override {
    return writer_->tool(name, model);
  }
  Result<bool> has_tool(const store::ToolName& name) override { return writer_->has_tool(name); }
  Result<store::RowId> place(const store::Place& place) override { return writer_->place(place); }
  Result<std::optional<store::Last>> last(store::RowId tool) override {
    return writer_->last(tool);
  }
  Result<void> adopt(store::RowId tool, const store::Last& last) override {
    return writer_->adopt(tool, last);
  }
  Result<std::vector<store::Stored>> commit(std::span<const store::Entry> entries) override;
  Result<store::Trimmed> trim(WallTime before, WallTime now) override {
    return writer_->trim(before, now);
  }

 private:
  store::Writer* writer_;
  RecordCounters* counters_;
  const Clock* clock_;
};

}  // namespace spindle::commands
