#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "spindle/link/doors.hpp"
#include "spindle/link/owner_notes.hpp"
#include "spindle/link/shared_line.hpp"

namespace spindle::link {

/// A line as one other program asks on it: in frames of Modbus TCP, one request after the other,
/// each with an id of its own that its answer gets back. Each unit is asked by a session, as if the
/// line was asked directly.
class AskedLine {
 public:
  /// The program at the other end.
  struct Peer {
    enum class Kind : std::uint8_t {
      spindle,  ///< understands notes, and hears what the tool sends unasked if it wants to
      any,      ///< no answer is exception 0Bh, no link to the tool 0Ah
    } kind = Kind::any;
    Rights rights = Rights::read;
    /// Answers; may wait until the other end takes it. False: it does not.
    std::function<bool(ByteView packet)> answer;
    /// Tells what comes unasked; must not wait, and drops it instead. Called by any thread.
    std::function<void(ByteView packet)> tell = {};
  };

  /// Both must outlive it.
  AskedLine(SharedLine& line, Peer peer, Clock& clock);

  /// Handles one packet and returns when it was answered. False where the connection is of no use
  /// any more: what came is no request, the answer was not taken, or the program ends.
  bool take(ByteView packet);

 private:
  struct Asked {
    std::unique_ptr<Session> session;
    std::size_t opening = 0;
  };

  bool take_note(const OwnerNote& note);
  void learn(const Manner& manner);
  bool answer(const modbus::Adu& request);
  bool answer_with(const modbus::Adu& request, modbus::Pdu pdu);
  bool tell_trouble(const modbus::Adu& request, const Error& error);
  bool broadcast(const modbus::Adu& request);
  [[nodiscard]] std::optional<modbus::ExceptionCode> refusal(const modbus::Pdu& request) const;
  Result<Session*> session_for(modbus::UnitId unit);
  [[nodiscard]] SessionOptions options_for(modbus::UnitId unit) const;
  [[nodiscard]] bool is_serial() const;
  Result<modbus::Pdu> ask(modbus::UnitId unit, const modbus::Pdu& request);
  static Result<modbus::Pdu> ask_believed(Session& session, const modbus::Pdu& request);

  SharedLine* line_;
  Peer peer_;
  Clock* clock_;
  std::map<modbus::UnitId, SessionOptions> manners_ = {};
  Haste haste_ = {};
  std::map<modbus::UnitId, Asked> sessions_ = {};
  std::unique_ptr<SharedLine::Ear> ear_ = nullptr;
};

}  // namespace spindle::link
