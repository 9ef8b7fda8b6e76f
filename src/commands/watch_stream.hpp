#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "event_records.hpp"
#include "listing.hpp"
#include "patient_out.hpp"
#include "progress.hpp"
#include "spindle/commands/commands.hpp"
#include "watch_board.hpp"

namespace spindle::commands {

/// What was not told of one tool, because the reader did not take what was told before.
struct Dropped {
  std::size_t records = 0;
  std::optional<std::uint32_t> events = 0;  ///< among them, and in gaps; empty: unknown
};

/// Whether the records are shown, or only counted.
enum class Records : std::uint8_t { shown, counted };

/// What one tool tells, and how.
struct Voice {
  std::optional<NewsRecords> records = std::nullopt;
  Naming naming = {};
  Dropped dropped = {};
};

/// What all tools of one watch share: the stream of records, its counts, and when it ends. Several
/// threads may call it. Never waits for the reader of the output: what finds no room is a gap.
class WatchStream {
 public:
  /// All must outlive it.
  WatchStream(const WatchOptions& options, std::size_t tools,
              const std::vector<report::Column>& columns, Context& context,
              Records records = Records::shown);
  /// The same of tools that stay the same, each of which has a line of its own on a terminal.
  WatchStream(const WatchOptions& options, const std::vector<std::string>& targets,
              const std::vector<report::Column>& columns, Context& context);
  WatchStream(const WatchStream&) = delete;
  WatchStream& operator=(const WatchStream&) = delete;

  /// What a tool has to tell. Once the watch has ended, only what would be lost is still told.
  device::WatchControl tell(const device::WatchEvent& news, Voice& voice);

  /// How the watch of one tool ended. `unreached` says why there never was a link to it.
  void leave(const Result<void>& watched, const std::optional<Error>& unreached, Voice& voice);

  /// So many tools are watched from now on.
  void expect(std::size_t tools);

  /// Something went wrong that ends no watch.
  void fault(const Error& error);
  /// Something failed as a whole.
  void fail(const Error& error);
  /// Something that people should know.
  void note(std::string_view sentence);

  /// When to end, as far as is known now; asks, too, whether the output still has a reader.
  TimePoint until();

  /// Whether there is a reader, and the columns are there that were asked for.
  [[nodiscard]] bool is_open() const { return listing_.open(); }

  /// The end of the whole, with its summary, once every tool has left.
  Result<Outcome> finish();

 private:
  struct Counts {
    std::size_t events = 0;
    std::size_t ok = 0;
    std::size_t ng = 0;
    std::size_t caught_up = 0;
    std::size_t remembered = 0;
    std::size_t changes = 0;
    std::size_t samples = 0;
    std::size_t gaps = 0;
    std::size_t losses = 0;
    std::size_t missed_intervals = 0;
  };

  report::Record record_of(const device::ToolEvent& news, const Voice& voice);
  report::Record record_of(const device::MotorTransition& news, const Voice& voice);
  report::Record record_of(const device::PolledValue& news, const Voice& voice);
  report::Record record_of(const device::EventGap& news, const Voice& voice);
  report::Record record_of(const device::PollLag& news, const Voice& voice);
  [[nodiscard]] report::Record record_of(const device::ToolCurve& news, const Voice& voice) const;
  report::Record record_of(const device::LinkChange& news, const Voice& voice);
  void note_link(const device::LinkChange& news);
  void note_activity();
  void drop(const device::WatchEvent& news, Dropped& dropped);
  void tell_dropped(Voice& voice);
  void note_board(const report::Record& record, const Voice& voice);
  void show_status();
  void show_board();
  void end();
  Result<Outcome> give_up(std::size_t left);
  [[nodiscard]] std::string sentence() const;
  Result<void> summarise();

  const WatchOptions* options_;
  Context* context_;
  Records records_;
  std::size_t tools_;
  std::mutex mutex_ = {};
  ProgressLine status_;
  PatientOut out_;
  Listing listing_;
  std::optional<WatchBoard> board_ = std::nullopt;
  report::Screen drawn_on_ = {};
  Outcome outcome_ = {};
  TimePoint started_;
  TimePoint last_event_;
  std::size_t activity_ = 0;  ///< as --count means it
  Counts counts_ = {};
  std::size_t connected_ = 0;
  bool ended_ = false;
  bool closed_ = false;  ///< the output has no reader any more
};

}  // namespace spindle::commands
