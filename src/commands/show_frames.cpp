#include "spindle/commands/show_frames.hpp"

#include <fmt/format.h>

#include <string>

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
    case link::Decision::unanswered:
      return "no answer";
    case link::Decision::retry:
      return "asking again";
    case link::Decision::resync:
      return "resync";
    case link::Decision::doubt:
      return "doubt";
    case link::Decision::proof:
      return "proving the answer";
  }
  return "";
}

link::Trace frames_as_lines(const std::string& target, const report::Streams& io,
                            const Clock& clock) {
  const auto line = [&io, &clock, target](std::string text) {
    if (io.err_is_ready && !io.err_is_ready()) return;
    text.erase(text.find_last_not_of(' ') + 1);
    io.err(fmt::format("{} {} {}\n", report::to_text(clock.wall()), target, text));
  };
  return {.bytes =
              [line](link::Direction direction, ByteView bytes) {
                if (bytes.empty()) return;
                const std::string_view arrow = direction == link::Direction::sent ? "->" : "<-";
                line(fmt::format("{} {}", arrow, to_hex(bytes)));
              },
          .decision =
              [line](link::Decision decision, std::string_view text) {
                line(fmt::format("   {}: {}", to_text(decision), text));
              }};
}

}  // namespace

work::ShowFrames show_frames(const report::Streams& io, const Clock& clock, Verbosity verbosity) {
  return [&io, &clock, verbosity](const std::string& target) {
    link::Trace trace;
    if (verbosity == Verbosity::frames) trace = frames_as_lines(target, io, clock);
    trace.notice = [&io, target](std::string_view sentence) {
      report::say_warning(io, fmt::format("{}: {}", target, sentence));
    };
    return trace;
  };
}

}  // namespace spindle::commands
