#include "page/metrics.hpp"

#include <fmt/format.h>

namespace spindle::page {
namespace {

std::string gauge(std::string_view name, std::string_view help, std::size_t value) {
  return fmt::format("# HELP {} {}\n# TYPE {} gauge\n{} {}\n", name, help, name, name, value);
}

}  // namespace

std::string metrics_text(const commands::Metrics& metrics, const PageFacts& page) {
  std::string text = commands::to_prometheus(metrics);
  if (page.recorder != Recorder::unknown) {
    text += gauge("spindle_recorder_up", "Whether a recorder writes the store.",
                  page.recorder == Recorder::runs ? 1 : 0);
  }
  text +=
      gauge("spindle_store_readable", "Whether the store can be read.", page.is_readable ? 1 : 0);
  text += gauge("spindle_page_streams", "Streams of events that are open.", page.streams);
  return text;
}

}  // namespace spindle::page
