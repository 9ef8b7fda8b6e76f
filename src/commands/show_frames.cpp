#include "spindle/commands/show_frames.hpp"

#include <fmt/format.h>

#include <string>

namespace spindle::commands {
namespace {

constexpr auto decision_words =
    enum_table<link::Decision>({{"request", link::Decision::request},
                                {"answer", link::Decision::answer},
                                {"exception response", link::Decision::exception_response},
                                {"event, kept", link::Decision::spontaneous},
                                {"not the answer to our request, ignored", link::Decision::broken},
                                {"stray frame, ignored", link::Decision::stray},
                                {"late answer, ignored", link::Decision::late},
                                {"echo of our request, ignored", link::Decision::echo},
                                {"no frame", link::Decision::junk},
                                {"no answer", link::Decision::unanswered},
                                {"asking again", link::Decision::retry},
                                {"resync", link::Decision::resync},
                                {"doubt", link::Decision::doubt},
                                {"proving the answer", link::Decision::proof},
                                {"remembered", link::Decision::memory}});

link::Trace frames_as_lines(const std::string& target, const report::Streams& io,
                            const Clock& clock) {
  const auto line = [&io, &clock, target](std::string text) {
    if (io.err_is_ready && !io.err_is_ready()) return;
    text.erase(text.find_last_not_of(' ') + 1);
    report::say_frame(io, fmt::format("{} {} {}", report::to_text(clock.wall()), target, text));
  };
  return {.bytes =
              [line](link::Direction direction, ByteView bytes) {
                if (bytes.empty()) return;
                const std::string_view arrow = direction == link::Direction::sent ? "->" : "<-";
                line(fmt::format("{} {}", arrow, to_hex(bytes)));
              },
          .decision =
              [line](link::Decision decision, std::string_view text) {
                line(fmt::format("   {}: {}", decision_words.text(decision), text));
              }};
}

}  // namespace

work::ShowFrames show_frames(const report::Streams& io, const Clock& clock, Frames frames) {
  return [&io, &clock, frames](const std::string& target) {
    link::Trace trace;
    if (frames == Frames::shown) trace = frames_as_lines(target, io, clock);
    trace.notice = [&io, target](std::string_view sentence) {
      report::say_warning(io, fmt::format("{}: {}", target, sentence));
    };
    return trace;
  };
}

}  // namespace spindle::commands
