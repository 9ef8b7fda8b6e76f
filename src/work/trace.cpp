#include "spindle/work/trace.hpp"

#include <functional>
#include <utility>
#include <variant>

#include "spindle/files/capture.hpp"
#include "spindle/modbus/adu.hpp"

namespace spindle::work {
namespace {

using Hear = std::function<void(link::Direction, ByteView)>;

/// Puts the bytes of one connection together to frames and appends them to a capture file.
class Capture {
 public:
  Capture(std::string target, modbus::Framing framing, const Environment& environment)
      : target_(std::move(target)),
        framing_(framing),
        path_(environment.common.trace_file),
        disk_(&environment.disk),
        clock_(&environment.clock) {}

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

}  // namespace

link::Trace make_trace(const std::string& target, modbus::Framing framing,
                       const Environment& environment) {
  link::Trace trace = environment.show_frames ? environment.show_frames(target) : link::Trace();
  if (environment.common.trace_file.empty()) return trace;
  trace.bytes = both(std::move(trace.bytes), Capture(target, framing, environment));
  return trace;
}

}  // namespace spindle::work
