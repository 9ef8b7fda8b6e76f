#pragma once

#include <cstddef>
#include <string>

#include "page/words.hpp"
#include "spindle/commands/metrics.hpp"

namespace spindle::page {

/// What is so of the page itself.
struct PageFacts {
  Recorder recorder = Recorder::unknown;
  std::size_t streams = 0;
  bool is_readable = false;  ///< the store
};

/// What `/metrics` answers: what a recorder tells, too, and how the page is. Counters begin with
/// the shift in which the program began. What is not known is left out. Pure.
std::string metrics_text(const commands::Metrics& metrics, const PageFacts& page);

}  // namespace spindle::page
