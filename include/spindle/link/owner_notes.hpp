#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "spindle/link/session.hpp"

namespace spindle::link {

// What two spindles say to each other beside the frames of Modbus TCP, when one asks through the
// other that has the line. Each note is a packet that looks like a frame, with a protocol
// identifier that is not Modbus. Pure.

/// The first packet of an asker, answered by Welcome.
struct Hello {
  bool urgent = false;  ///< it stops a motor
};

/// What the owner of a line answers.
struct Welcome {
  bool serial = false;                          ///< unit 0 is every unit, and none answers
  std::optional<Error> trouble = std::nullopt;  ///< why there is no link to the tool now
};

/// How the asker's requests to this unit are to be made.
struct Manner {
  SessionOptions options = {};
};

/// How the requests from now on are to be made.
struct Haste {
  Duration answer_timeout = {};
  bool urgent = false;      ///< before those of others
  bool unverified = false;  ///< see Session::skip_verification()
};

/// What became of a request that got no answer. Without an error: it was sent to all units.
struct Unanswered {
  modbus::TransactionId request = {};
  std::optional<Error> error = std::nullopt;
};

using OwnerNote = std::variant<Hello, Welcome, Manner, Haste, Unanswered>;

/// The largest packet of either kind.
inline constexpr std::size_t max_owner_packet = modbus::max_long_adu_size;

Bytes encode(const OwnerNote& note);

/// Whether a packet is a note and no Modbus frame.
bool is_owner_note(ByteView packet);
/// Empty where the packet is no note of this version.
std::optional<OwnerNote> decode_owner_note(ByteView packet);

/// The request or answer in a packet of exactly one frame of Modbus TCP; empty: it is none.
std::optional<modbus::Adu> one_frame(ByteView packet);

}  // namespace spindle::link
