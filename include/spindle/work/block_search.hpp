#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "spindle/link/client.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::work {

/// What is told while a search goes on.
struct BlockSearchNews {
  enum class Kind : std::uint8_t {
    waiting,  ///< for the first event
    event,    ///< it came, and the search begins
    again,    ///< several places hold it: another event has to tell them apart
  } kind = Kind::waiting;
  std::uint16_t number = 0;  ///< of the event
  std::size_t places = 0;    ///< of `again`
};

struct BlockSearchResult {
  /// Number of the last event that was pushed; empty: none came in time.
  std::optional<std::uint16_t> number = std::nullopt;
  std::vector<std::uint16_t> places = {};  ///< first registers of blocks that are the event
  /// Places that hold the same event by its number and time, and other registers.
  std::vector<std::uint16_t> similar = {};
  std::size_t asked = 0;     ///< places
  std::size_t answered = 0;  ///< of them, that the tool shows
};

/// Waits for an event that is pushed, reads every place of the profile's search and compares. Where
/// several hold it, waits for another one. Reads only; events are switched on as the profile says,
/// and off again, also behind an error. Requires a profile with a search. Errors: the tool does not
/// answer; an interrupt.
Result<BlockSearchResult> search_block(OpenTool& tool, Duration patience, Clock& clock,
                                       const std::function<void(const BlockSearchNews&)>& tell,
                                       const link::Progress& progress = {});

}  // namespace spindle::work
