#pragma once

#include <memory>
#include <optional>
#include <string>

#include "recorder.hpp"
#include "spindle/commands/metrics.hpp"
#include "spindle/store/reader.hpp"

namespace spindle::commands {

/// The counters of a recorder in a file, which is replaced as a whole every few seconds. One
/// thread.
class MetricsFile {
 public:
  /// Writes nothing where `path` is empty. `store` is the path of the store. The recorder must
  /// outlive it.
  MetricsFile(std::string path, std::string store, Recorder& recorder);

  void write_when_due();
  void write();

 private:
  [[nodiscard]] Metrics gather();

  std::string path_;
  std::string store_;
  Recorder* recorder_;
  std::unique_ptr<store::Reader> reader_ = nullptr;
  std::optional<TimePoint> written_at_ = std::nullopt;
  std::string trouble_ = {};  ///< what was told of it; empty: it can be written
};

}  // namespace spindle::commands
