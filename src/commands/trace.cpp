#include "trace.hpp"

#include <fmt/format.h>

#include <functional>
#include <utility>
#include <variant>

#include "spindle/files/capture.hpp"
#include "spindle/modbus/adu.hpp"

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

using Hear = std::function<void(link::Direction, ByteView)>;

/// Puts the bytes of one connection together to frames and appends them to a capture file.
class Capture {
 public:
  Capture(std::string target, modbus::Framing framing, const Context& context)
      : target_(std::move(target)),
        framing_(framing),
        path_(context.common.trace_file),
        disk_(&context.disk),
        clock_(&context.clock) {}

  void operator()(link::Direction direction, ByteView bytes) {
    if (direction == link::Direction::sent) {
      leave_off();
      return write(files::Sender::client, bytes);
    }
    if (bytes.empty()) return leave_off();
    pending_.insert(pending_.end(), bytes.begin(), bytes.end());
    while (const std::size_t size = next_size()) {
      write(files::Sender::server, ByteView(pending_).first(size));
      pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(size));
    }
  }

 private:
  /// Bytes at the front that are a frame, or noise; 0 while more has to come.
  [[nodiscard]] std::size_t next_size() const {
    if (pending_.empty()) return 0;
    const auto found = modbus::deframe(framing_, modbus::Role::client, pending_);
    if (const auto* frame = std::get_if<modbus::Deframed>(&found)) {
      return frame->skipped > 0 ? frame->skipped : frame->consumed;
    }
    const auto* junk = std::get_if<modbus::Junk>(&found);
    if (junk == nullptr) return 0;
    return junk->size > 0 ? junk->size : pending_.size();
  }

  /// What never became a frame is kept as it is.
  void leave_off() {
    if (!pending_.empty()) write(files::Sender::server, std::exchange(pending_, {}));
  }

  void write(files::Sender sender, ByteView bytes) {
    const auto appended = disk_->append(path_, files::capture_block({.sender = sender,
                                                                     .framing = framing_,
                                                                     .time = clock_->wall(),
                                                                     .target = target_,
                                                                     .bytes = bytes}));
    static_cast<void>(appended);  // a full disk must not stop a tool from being stopped
  }

  std::string target_;
  modbus::Framing framing_;
  std::string path_;
  const Disk* disk_;
  const Clock* clock_;
  Bytes pending_ = {};
};

Hear both(Hear first, Hear second) {
  if (!first) return second;
  if (!second) return first;
  return [first = std::move(first), second = std::move(second)](link::Direction direction,
                                                                ByteView bytes) {
    first(direction, bytes);
    second(direction, bytes);
  };
}

link::Trace spoken(const std::string& target, const Context& context) {
  if (context.common.verbosity == Verbosity::normal) return {};
  const auto line = [&io = context.io, &clock = context.clock, target](std::string text) {
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

link::Trace make_trace(const std::string& target, modbus::Framing framing, const Context& context) {
  link::Trace trace = spoken(target, context);
  trace.notice = [&io = context.io, target](std::string_view sentence) {
    report::say_warning(io, fmt::format("{}: {}", target, sentence));
  };
  if (context.common.trace_file.empty()) return trace;
  trace.bytes = both(std::move(trace.bytes), Capture(target, framing, context));
  return trace;
}

}  // namespace spindle::commands
