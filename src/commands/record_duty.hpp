#pragma once

#include <functional>
#include <set>
#include <string>

#include "metrics_file.hpp"
#include "recorder.hpp"
#include "roster.hpp"
#include "spindle/commands/service_news.hpp"
#include "tools_to_record.hpp"

namespace spindle::commands {

/// What a recorder does beside recording: it says how it is, keeps its metrics, and follows its
/// tools file when it is told to. One thread.
class RecordDuty {
 public:
  /// Which tools are to be recorded by the tools file as it is now.
  using Load = std::function<Result<ToolsToRecord>()>;

  /// All must outlive it.
  RecordDuty(Recorder& recorder, Roster& roster, ServiceNews& news, MetricsFile& metrics,
             Load load);

  /// Goes on until every watch has ended by itself, or a signal wants the end; then all have ended.
  void attend();

 private:
  void turn();
  void reload();
  void follow_leases();
  [[nodiscard]] std::string sentence(const Roster::Standing& standing);

  Recorder* recorder_;
  Roster* roster_;
  ServiceNews* news_;
  MetricsFile* metrics_;
  Load load_;
  std::set<std::string> allowed_ = {};  ///< tools that are held, where tools are shared
};

}  // namespace spindle::commands
