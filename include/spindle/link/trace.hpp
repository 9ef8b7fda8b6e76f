#pragma once

#include <functional>
#include <string_view>

#include "spindle/base/bytes.hpp"
#include "spindle/base/clock.hpp"

namespace spindle::link {

enum class Direction : std::uint8_t { sent, received };

/// What a session did with a frame, or decided on its own.
enum class Decision : std::uint8_t {
  request,
  answer,
  exception_response,
  spontaneous,
  broken,
  stray,
  late,
  junk,
  echo,
  unanswered,
  retry,
  resync,
  doubt,
  proof,
  memory
};

/// Hears all bytes and every decision of one connection, for --verbose and --trace. Bytes come as
/// they are sent and received; none at all say that the connection is over. Each function may be
/// empty.
struct Trace {
  std::function<void(Direction, ByteView bytes)> bytes = {};
  std::function<void(Decision, std::string_view text)> decision = {};
  /// A sentence that users should read, whether they trace or not.
  std::function<void(std::string_view sentence)> notice = {};
};

}  // namespace spindle::link
