#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/store/reader.hpp"

namespace spindle::commands {

/// How long something took, counted by upper limits in seconds, as Prometheus does it.
class Histogram {
 public:
  static constexpr std::array limits = {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05,
                                        0.1,   0.25,   0.5,   1.0,  2.5,   10.0};

  void add(Duration took);
  /// How many took at most limits[index].
  [[nodiscard]] std::uint64_t up_to(std::size_t index) const;
  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] Duration sum() const { return sum_; }

 private:
  std::array<std::uint64_t, limits.size()> counts_ = {};  ///< each above the limit before it
  std::uint64_t count_ = 0;
  Duration sum_ = {};
};

/// What is known of one sink of results.
struct SinkMetrics {
  std::string name;
  std::uint64_t backlog = 0;                              ///< events that it has not got
  std::optional<Duration> oldest = std::nullopt;          ///< age of the first of them
  std::optional<std::uint64_t> delivered = std::nullopt;  ///< empty: not known here
  std::map<std::string, std::uint64_t> errors = {};       ///< by reason
};

/// What a monitoring system is told. Counts begin with whom they are of: a recorder that was
/// started anew begins at 0, a store has all that it holds.
struct Metrics {
  struct ResultLabels {
    std::string tool;
    std::string preset;  ///< its number, or "unknown"
    std::string result;  ///< "ok" or "ng"
    friend auto operator<=>(const ResultLabels&, const ResultLabels&) = default;
  };

  std::map<ResultLabels, std::uint64_t> results = {};
  std::map<std::string, std::uint64_t> missed = {};  ///< by tool; gaps of unknown size have none
  std::map<std::pair<std::string, std::string>, std::uint64_t> gaps = {};  ///< by tool and reason
  std::map<std::string, bool> links = {};                                  ///< by tool
  std::map<std::string, WallTime> last_results = {};                       ///< likewise
  std::optional<Histogram> commits = std::nullopt;
  std::optional<std::uint64_t> store_bytes = std::nullopt;
  std::optional<std::uint64_t> pending = std::nullopt;  ///< records that wait to be stored
  std::vector<SinkMetrics> sinks = {};
  std::string version = {};

  /// Counts an event where it is a result of a rundown.
  void count_event(const std::string& tool, std::string_view kind,
                   std::optional<std::int64_t> preset, WallTime at);
  /// Reasons of one tool that are too many to be told apart count as "other".
  void count_gap(const std::string& tool, const store::Gap& gap);
};

/// The text format of Prometheus, version 0.0.4. What is empty is left out.
std::string to_prometheus(const Metrics& metrics);

/// What a store says of its sinks at this time.
Result<std::vector<SinkMetrics>> sink_metrics(store::Reader& reader, WallTime now);

/// All that a store alone says, for who does not record: counts of all that it holds, its size and
/// its sinks. Reads only what is new since it was last asked. One thread, and one store.
class StoredMetrics {
 public:
  explicit StoredMetrics(std::string version) { metrics_.version = std::move(version); }

  Result<Metrics> read(store::Reader& reader, WallTime now);

 private:
  Result<void> read_names(store::Reader& reader);
  Result<void> read_links(store::Reader& reader, WallTime now);
  [[nodiscard]] std::string name_of(store::RowId tool) const;

  Metrics metrics_ = {};
  std::map<store::RowId, std::string> names_ = {};  ///< of tools, by where they were last
  std::map<store::RowId, WallTime> seen_ = {};      ///< until when tools were listened to
  std::map<store::RowId, bool> up_ = {};            ///< what was last told of their links
  store::RowId events_ = 0;
  store::RowId gaps_ = 0;
  store::RowId happenings_ = 0;
};

}  // namespace spindle::commands
