#include "trace.hpp"

#include <fmt/format.h>

namespace spindle::commands {
namespace {

std::string_view to_text(link::Decision decision) {
  switch (decision) {
    case link::Decision::request:
      return "request";
    case link::Decision::answer:
      return "answer";
    case link::Decision::exception_response:
      return "exception response";
    case link::Decision::spontaneous:
      return "event, kept";
    case link::Decision::broken:
      return "not the answer to our request, ignored";
    case link::Decision::stray:
      return "stray frame, ignored";
    case link::Decision::late:
      return "late answer, ignored";
    case link::Decision::echo:
      return "echo of our request, ignored";
    case link::Decision::junk:
      return "no frame";
    case link::Decision::retry:
      return "asking again";
    case link::Decision::quarantine:
      return "quarantine";
  }
  return "";
}

}  // namespace

link::Trace make_trace(const std::string& target, const Context& context) {
  if (context.common.verbosity == Verbosity::normal) return {};
  const auto line = [&io = context.io, &clock = context.clock, target](std::string text) {
    if (io.err_is_ready && !io.err_is_ready()) return;
    text.erase(text.find_last_not_of(' ') + 1);
    io.err(fmt::format("{} {} {}\n", report::to_text(clock.wall()), target, text));
  };
  return {.bytes =
              [line](link::Direction direction, ByteView bytes) {
                const std::string_view arrow = direction == link::Direction::sent ? "->" : "<-";
                line(fmt::format("{} {}", arrow, to_hex(bytes)));
              },
          .decision =
              [line](link::Decision decision, std::string_view text) {
                line(fmt::format("   {}: {}", to_text(decision), text));
              }};
}

}  // namespace spindle::commands
