#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "leases.hpp"
#include "record_counters.hpp"
#include "roster.hpp"
#include "spindle/commands/service_news.hpp"
#include "spindle/work/event_rows.hpp"
#include "spindle/work/journal.hpp"
#include "watch_stream.hpp"
#include "watching.hpp"

namespace spindle::commands {

class RecordedTool;

/// What all tools of one `record` share: the store, its journal, and who has which name there.
class Recorder {
 public:
  /// All must outlive it.
  Recorder(store::Writer& writer, WatchStream& stream, ServiceNews& news,
           work::JournalOptions options, Context& context);

  [[nodiscard]] store::Writer& writer() { return *writer_; }
  [[nodiscard]] work::Journal& journal() { return journal_; }
  [[nodiscard]] WatchStream& stream() { return *stream_; }
  [[nodiscard]] RecordCounters& counters() { return counters_; }
  [[nodiscard]] Context& context() { return *context_; }
  /// From now on the tools are shared with other collectors; it must outlive the recorder.
  void share(Leases& leases) { leases_ = &leases; }
  /// Null: they are not shared.
  [[nodiscard]] Leases* leases() const { return leases_; }

  /// What records this target, of which at most one watch may be under way; stays as long as the
  /// recorder. One that comes again is the one of before.
  RecordedTool& recorded(const Target& target);

  /// The name of a target's tool in the store. Where another tool that is connected says the same
  /// serial number, it gets a name of its own for ever, and an error says so: no tool may hide the
  /// results of another.
  Result<store::ToolName> claim(const store::ToolName& said, const std::string& target,
                                const RecordedTool& listener);
  /// The target's tool is not connected any more.
  void release(const std::string& target);
  /// What this tool is told by from now on. Error `storage` while what it told before waits to be
  /// stored and the listener has to know its last event.
  Result<void> settle(store::RowId tool, RecordedTool& listener);

 private:
  struct Claim {
    store::ToolName name;
    const RecordedTool* listener;
  };

  void tell_gap(const store::NewGap& entry, const store::Stored& stored);
  void tell_trouble(const std::optional<Error>& error);

  store::Writer* writer_;
  WatchStream* stream_;
  ServiceNews* news_;
  Context* context_;
  Leases* leases_ = nullptr;
  std::mutex mutex_ = {};
  std::map<std::string, Claim> claims_ = {};                    ///< by target
  std::set<std::pair<std::string, store::ToolName>> met_ = {};  ///< once already, by target
  std::set<store::ToolName> told_ = {};                         ///< names of which an error spoke
  std::map<store::RowId, RecordedTool*> listeners_ = {};
  /// What waits in the journal refers to them, also of tools that have left.
  std::vector<std::unique_ptr<RecordedTool>> recorded_ = {};
  RecordCounters counters_ = {};
  TimedWriter timed_;
  work::Journal journal_;
};

/// One tool that is recorded: what it tells goes to the store, and from there to the stream.
class RecordedTool final : public Listener {
 public:
  RecordedTool(const Target& target, Recorder& recorder);

  /// Its next watch begins, as it is assigned, for as long as the watch lasts.
  void begin(Task& task);
  [[nodiscard]] const Target& entry() const { return entry_; }
  [[nodiscard]] bool is_leaving() const { return task_->is_leaving(); }

  TimePoint until() override;
  void opened(const WatchedTool& tool) override;
  device::WatchControl tell(const device::WatchEvent& news) override;
  void left(const Result<void>& watched, const std::optional<Error>& unreached) override;
  device::RecordHooks hooks() override;

  [[nodiscard]] bool is_of(store::RowId tool) const { return tool_ == tool; }
  /// Whether this watch knows what the tool told last.
  [[nodiscard]] bool is_informed() const { return is_informed_; }
  /// A gap that the journal made, behind its commit; by any thread.
  void tell_gap(const device::EventGap& news, const store::Stored& stored);

 private:
  void record(const device::ToolEvent& news);
  void record(const device::EventGap& news);
  void record(const device::LinkChange& news);
  void record(const device::PolledValue& news);
  void record(const device::PollLag& news);
  void record(const device::MotorTransition& news);
  void record(const device::ToolCurve& news);

  Result<device::RecordedPast> register_tool(device::Device& device);
  Result<std::optional<std::int64_t>> fence() const;
  Result<std::optional<store::Last>> known_last(store::RowId tool, const store::ToolName& name);
  void record_total(const catalogue::Identity& identity, const std::optional<store::Last>& last);
  std::optional<device::Errand> next_errand();
  bool adopt_unit(const Registers& block);
  void want_settings(const device::ToolEvent& news);
  void want_settings(std::int64_t preset);
  void flush_gap();
  void flush_link();
  void happen(const report::Record& record, device::WatchEvent news);
  void add_happening(const report::Record& record, work::Journal::Told told);
  void note_link(const device::LinkChange& news);
  void note_pending();
  void tell_stream(const device::WatchEvent& news, const std::string& serial, std::int64_t epoch,
                   store::RowId id);
  [[nodiscard]] WallTime now() const { return recorder_->context().clock.wall(); }

  const catalogue::Profile unknown_ = {};
  const Target entry_;
  Target target_;
  Recorder* recorder_;
  Task* task_ = nullptr;
  bool is_informed_ = false;     ///< this watch was told what the tool told last
  std::mutex voice_mutex_ = {};  ///< the journal's thread tells the stream, too
  Voice voice_ = {};
  const catalogue::Profile* profile_ = nullptr;
  std::optional<work::EventRows> rows_ = std::nullopt;
  std::optional<store::RowId> tool_ = std::nullopt;  ///< empty: never connected
  store::Place place_row_ = {};                      ///< of `place_`
  store::RowId place_ = 0;
  std::string serial_ = {};
  work::EpochFollower epochs_ = {};
  std::optional<device::EventGap> gap_ = std::nullopt;     ///< waits for the event behind it
  std::optional<device::LinkChange> link_ = std::nullopt;  ///< waits for what the tool is
  std::optional<std::uint16_t> counted_ = std::nullopt;    ///< of a tool that does not count
  WallTime seen_ = {};
  TimePoint seen_due_ = {};
  std::vector<std::int64_t> wanted_ = {};  ///< presets whose settings are to be read
  std::map<std::int64_t, TimePoint> read_at_ = {};
  unsigned unanswered_ = 0;  ///< errands in a row that came to nothing
  bool is_up_ = false;
  std::optional<std::string> link_text_ = std::nullopt;  ///< not told on stderr yet
  std::optional<TimePoint> noted_at_ = std::nullopt;
};

}  // namespace spindle::commands
