#include "spindle/link/owner_notes.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "spindle/modbus/adu.hpp"

namespace spindle::link {
namespace {

// Transaction, protocol, length: as in front of a frame; then the kind of note and the version.
constexpr std::uint16_t protocol = 0x5350;
constexpr std::size_t protocol_at = 2;
constexpr std::size_t length_at = 4;
constexpr std::size_t head_size = 6;
constexpr std::uint8_t version = 1;

enum class Kind : std::uint8_t { hello = 1, welcome, manner, haste, unanswered };

/// Errors by words, so that another version's list does not shift them.
struct Word {
  std::string_view word;
  Errc code;
};
constexpr std::array words = {Word{"no-answer", Errc::no_answer},
                              Word{"incomplete-answer", Errc::incomplete_answer},
                              Word{"malformed-answer", Errc::malformed_answer},
                              Word{"bad-checksum", Errc::bad_checksum},
                              Word{"local-echo", Errc::local_echo},
                              Word{"closed", Errc::closed},
                              Word{"reset", Errc::reset},
                              Word{"usage", Errc::usage},
                              Word{"name-not-found", Errc::name_not_found},
                              Word{"connection-refused", Errc::connection_refused},
                              Word{"no-route", Errc::no_route},
                              Word{"connect-timeout", Errc::connect_timeout},
                              Word{"port-missing", Errc::port_missing},
                              Word{"port-busy", Errc::port_busy},
                              Word{"port-unusable", Errc::port_unusable},
                              Word{"mismatch", Errc::mismatch},
                              Word{"wrong-generation", Errc::wrong_generation},
                              Word{"internal", Errc::internal}};

/// What is not known here is trouble of the link.
constexpr Errc unknown_trouble = Errc::reset;

std::string_view word_of(Errc code) {
  const auto* const found =
      std::find_if(words.begin(), words.end(), [&](const Word& one) { return one.code == code; });
  return found == words.end() ? "reset" : found->word;
}

Errc code_of(std::string_view text) {
  const auto* const found =
      std::find_if(words.begin(), words.end(), [&](const Word& one) { return one.word == text; });
  return found == words.end() ? unknown_trouble : found->code;
}

class Writer {
 public:
  void put(std::uint8_t value) { bytes_.push_back(value); }
  void put(bool value) { put(static_cast<std::uint8_t>(value ? 1 : 0)); }
  void put(std::uint16_t value) { put_u16(bytes_, value); }
  void put(std::uint64_t value) {
    for (int shift = 48; shift >= 0; shift -= 16) {
      put_u16(bytes_, static_cast<std::uint16_t>((value >> shift) & 0xFFFFU));
    }
  }
  void put(Duration value) { put(static_cast<std::uint64_t>(value.count())); }
  void put(std::string_view text) {
    constexpr std::size_t longest = 1000;
    const std::string_view kept = text.substr(0, longest);
    put(static_cast<std::uint16_t>(kept.size()));
    bytes_.insert(bytes_.end(), kept.begin(), kept.end());
  }
  template <typename Enum>
  void put_enum(Enum value) {
    put(static_cast<std::uint8_t>(value));
  }
  void put(const std::optional<Error>& error) {
    put(error.has_value());
    if (!error) return;
    put(word_of(error->code));
    put(std::string_view(error->message));
    put(std::string_view(error->hint));
    put(std::string_view(error->tried));
    put(error->waited.value_or(Duration::zero()));
  }

  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_ = {};
};

/// What is missing reads as nothing, and makes the whole invalid.
class Reader {
 public:
  explicit Reader(ByteView bytes) : bytes_(bytes) {}

  [[nodiscard]] bool is_valid() const { return valid_; }
  std::uint8_t u8() {
    if (!has(1)) return 0;
    const std::uint8_t value = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return value;
  }
  bool flag() { return u8() != 0; }
  std::uint16_t u16() {
    if (!has(2)) return 0;
    const std::uint16_t value = get_u16(bytes_, 0);
    bytes_ = bytes_.subspan(2);
    return value;
  }
  Duration duration() {
    std::uint64_t value = 0;
    for (int part = 0; part < 4; ++part) value = (value << 16U) | u16();
    return Duration(static_cast<Duration::rep>(value));
  }
  std::string text() {
    const std::size_t size = u16();
    if (!has(size)) return {};
    const std::string value(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size));
    bytes_ = bytes_.subspan(size);
    return value;
  }
  /// Of one of the values from the first to `last`.
  template <typename Enum>
  Enum one_of(Enum last) {
    const std::uint8_t value = u8();
    if (value > static_cast<std::uint8_t>(last)) valid_ = false;
    return static_cast<Enum>(std::min(value, static_cast<std::uint8_t>(last)));
  }
  std::optional<Error> error() {
    if (!flag()) return std::nullopt;
    Error error;
    error.code = code_of(text());
    error.message = text();
    error.hint = text();
    error.tried = text();
    if (const Duration waited = duration(); waited > Duration::zero()) error.waited = waited;
    return error;
  }

 private:
  bool has(std::size_t size) {
    if (bytes_.size() < size) valid_ = false;
    return valid_;
  }

  ByteView bytes_;
  bool valid_ = true;
};

void write(const Hello& note, Writer& into) { into.put(note.urgent); }

void write(const Welcome& note, Writer& into) {
  into.put(note.serial);
  into.put(note.trouble);
}

void write(const Manner& note, Writer& into) {
  const SessionOptions& options = note.options;
  into.put(options.unit.value);
  into.put(options.answer_timeout);
  into.put(options.gap);
  into.put(options.broadcast_gap);
  into.put(options.character_time);
  into.put_enum(options.proof);
  into.put_enum(options.echo);
  into.put_enum(options.late_answers);
  into.put_enum(options.others);
  into.put_enum(options.rules.units);
  into.put_enum(options.rules.transactions);
  into.put(static_cast<std::uint8_t>(options.rules.spontaneous.size()));
  for (const SpontaneousShape& shape : options.rules.spontaneous) {
    into.put(shape.function);
    into.put(shape.byte_count);
  }
}

void write(const Haste& note, Writer& into) {
  into.put(note.answer_timeout);
  into.put(note.urgent);
  into.put(note.unverified);
}

void write(const Unanswered& note, Writer& into) {
  into.put(note.request.value);
  into.put(note.error);
}

Manner read_manner(Reader& from) {
  SessionOptions options;
  options.unit = {from.u8()};
  options.answer_timeout = from.duration();
  options.gap = from.duration();
  options.broadcast_gap = from.duration();
  options.character_time = from.duration();
  options.proof = from.one_of(SessionOptions::Proof::loopback);
  options.echo = from.one_of(LocalEcho::absent);
  options.late_answers = from.one_of(SessionOptions::LateAnswers::shared);
  options.others = from.one_of(SessionOptions::Others::possible);
  options.rules.units = from.one_of(Units::any);
  options.rules.transactions = from.one_of(modbus::TransactionIds::ignored);
  const unsigned shapes = from.u8();
  for (unsigned count = 0; count < shapes; ++count) {
    const std::uint8_t function = from.u8();
    options.rules.spontaneous.push_back({.function = function, .byte_count = from.u8()});
  }
  return {.options = std::move(options)};
}

Haste read_haste(Reader& from) {
  Haste haste;
  haste.answer_timeout = from.duration();
  haste.urgent = from.flag();
  haste.unverified = from.flag();
  return haste;
}

Welcome read_welcome(Reader& from) {
  Welcome welcome;
  welcome.serial = from.flag();
  welcome.trouble = from.error();
  return welcome;
}

Unanswered read_unanswered(Reader& from) {
  Unanswered unanswered;
  unanswered.request = {from.u16()};
  unanswered.error = from.error();
  return unanswered;
}

std::optional<OwnerNote> read(Kind kind, Reader& from) {
  switch (kind) {
    case Kind::hello:
      return Hello{.urgent = from.flag()};
    case Kind::welcome:
      return read_welcome(from);
    case Kind::manner:
      return read_manner(from);
    case Kind::haste:
      return read_haste(from);
    case Kind::unanswered:
      return read_unanswered(from);
  }
  return std::nullopt;
}

}  // namespace

Bytes encode(const OwnerNote& note) {
  Writer body;
  body.put(static_cast<std::uint8_t>(note.index() + 1));
  body.put(version);
  std::visit([&](const auto& one) { write(one, body); }, note);
  Bytes packet;
  put_u16(packet, 0);
  put_u16(packet, protocol);
  put_u16(packet, static_cast<std::uint16_t>(body.bytes().size()));
  packet.insert(packet.end(), body.bytes().begin(), body.bytes().end());
  return packet;
}

bool is_owner_note(ByteView packet) {
  return packet.size() >= head_size && get_u16(packet, protocol_at) == protocol;
}

std::optional<OwnerNote> decode_owner_note(ByteView packet) {
  if (!is_owner_note(packet)) return std::nullopt;
  if (get_u16(packet, length_at) + head_size != packet.size()) return std::nullopt;
  Reader reader(packet.subspan(head_size));
  const auto kind = static_cast<Kind>(reader.u8());
  if (reader.u8() != version) return std::nullopt;
  auto note = read(kind, reader);
  return reader.is_valid() ? std::move(note) : std::nullopt;
}

std::optional<modbus::Adu> one_frame(ByteView packet) {
  auto found = modbus::deframe(modbus::Framing::tcp, modbus::Role::client, packet);
  auto* const frame = std::get_if<modbus::Deframed>(&found);
  if (frame == nullptr || frame->consumed != packet.size() || frame->protocol != 0) {
    return std::nullopt;
  }
  return std::move(frame->adu);
}

}  // namespace spindle::link
