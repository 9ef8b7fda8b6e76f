#include "metrics_file.hpp"

#include <utility>

namespace spindle::commands {
namespace {

constexpr Duration written_every = std::chrono::seconds(5);

}  // namespace

MetricsFile::MetricsFile(std::string path, std::string store, Recorder& recorder)
    : path_(std::move(path)), store_(std::move(store)), recorder_(&recorder) {}

void MetricsFile::write_when_due() {
  const TimePoint now = recorder_->context().clock.now();
  if (!written_at_ || now >= *written_at_ + written_every) write();
}

/// A fault is told once, as long as it stays the same.
void MetricsFile::write() {
  if (path_.empty()) return;
  const Context& context = recorder_->context();
  written_at_ = context.clock.now();
  const auto written =
      context.disk.write(path_, to_prometheus(gather()), Overwrite::allow, Privacy::usual);
  const std::string trouble = written ? std::string() : written.error().message;
  const bool is_news = !written && trouble != trouble_;
  trouble_ = trouble;
  if (is_news) recorder_->stream().fault(written.error());
}

Metrics MetricsFile::gather() {
  Metrics metrics = recorder_->counters().metrics();
  metrics.version = recorder_->context().version;
  metrics.pending = recorder_->journal().waiting();
  if (!reader_) {
    auto opened = store::Reader::open(store_);
    if (opened) reader_ = std::move(*opened);
  }
  if (!reader_) return metrics;
  const auto bytes = reader_->bytes();
  auto sinks = sink_metrics(*reader_, recorder_->context().clock.wall());
  if (bytes) metrics.store_bytes = *bytes;
  if (sinks) metrics.sinks = std::move(*sinks);
  if (!bytes || !sinks) reader_.reset();  // the journal tells what is wrong with the store
  return metrics;
}

}  // namespace spindle::commands
