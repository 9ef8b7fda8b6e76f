#include "spindle/sim/peer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "spindle/modbus/pdu.hpp"

namespace spindle::sim {
namespace {

using modbus::Framing;
using modbus::FunctionCode;
using std::chrono::milliseconds;

constexpr Duration piece_distance = milliseconds(1);
// What is longer than a frame of the standard comes over a wireless link as this, with pauses.
constexpr std::size_t wireless_segment = 1460;
constexpr Duration wireless_pause = milliseconds(20);
constexpr Duration longest_hold = milliseconds(50);

// Where no gap is kept, what has waited so long for its rest is a torn frame.
constexpr Duration longest_pause = milliseconds(50);

// Cannot begin a frame: no protocol identifier, length or function of that kind exists.
constexpr std::uint8_t noise_byte = 0xFF;

constexpr std::size_t mbap_protocol_at = 2;
constexpr std::size_t mbap_length_at = 4;

// The faults that strike one answer.
class ActiveFaults {
 public:
  ActiveFaults(const FaultPlan& plan, std::uint32_t answer_number) {
    for (const Fault& fault : plan) {
      if (fault.applies_to(answer_number)) faults_.push_back(&fault);
    }
  }

  [[nodiscard]] const Fault* find(FaultKind kind) const {
    const auto found = std::find_if(faults_.begin(), faults_.end(),
                                    [kind](const Fault* fault) { return fault->kind == kind; });
    return found == faults_.end() ? nullptr : *found;
  }

  [[nodiscard]] bool has(FaultKind kind) const { return find(kind) != nullptr; }

  [[nodiscard]] Duration longest(FaultKind kind) const {
    Duration longest = Duration::zero();
    for (const Fault* fault : faults_) {
      if (fault->kind == kind) longest = std::max(longest, fault->duration.value_or(longest));
    }
    return longest;
  }

 private:
  std::vector<const Fault*> faults_;
};

void set_u16(Bytes& bytes, std::size_t offset, std::uint16_t value) {
  bytes[offset] = static_cast<std::uint8_t>(value >> 8U);
  bytes[offset + 1] = static_cast<std::uint8_t>(value & 0xFFU);
}

bool is_echo(std::uint8_t function) {
  switch (static_cast<FunctionCode>(function)) {
    case FunctionCode::write_single_register:
    case FunctionCode::write_multiple_registers:
    case FunctionCode::diagnostics:
      return true;
    default:
      return false;
  }
}

bool has_byte_count(std::uint8_t function) {
  switch (static_cast<FunctionCode>(function)) {
    case FunctionCode::read_holding_registers:
    case FunctionCode::read_input_registers:
    case FunctionCode::report_server_id:
      return true;
    default:
      return false;
  }
}

void lengthen(modbus::Pdu& pdu, std::uint16_t registers) {
  const auto extra = static_cast<std::uint8_t>(2 * registers);
  if (has_byte_count(pdu.function)) pdu.data[0] = static_cast<std::uint8_t>(pdu.data[0] + extra);
  pdu.data.insert(pdu.data.end(), extra, 0);
}

void spoil_pdu(modbus::Pdu& pdu, const ActiveFaults& active) {
  if (active.has(FaultKind::wrong_echo) && is_echo(pdu.function)) {
    const std::size_t value_at = pdu.data.size() - 2;
    set_u16(pdu.data, value_at, static_cast<std::uint16_t>(get_u16(pdu.data, value_at) + 1));
  }
  if (const Fault* fault = active.find(FaultKind::wrong_length)) lengthen(pdu, number_of(*fault));
  if (const Fault* fault = active.find(FaultKind::wrong_function)) {
    pdu.function = static_cast<std::uint8_t>(number_of(*fault));
  }
}

void spoil_addressing(modbus::Adu& adu, const ActiveFaults& active) {
  if (const Fault* fault = active.find(FaultKind::wrong_unit)) {
    adu.unit.value = static_cast<std::uint8_t>(number_of(*fault));
  }
  if (const Fault* fault = active.find(FaultKind::wrong_transaction)) {
    adu.transaction.value = static_cast<std::uint16_t>(adu.transaction.value + number_of(*fault));
  }
  if (const Fault* fault = active.find(FaultKind::fixed_transaction)) {
    adu.transaction.value = number_of(*fault);
  }
}

void spoil_header(Bytes& bytes, const ActiveFaults& active) {
  if (const Fault* fault = active.find(FaultKind::wrong_protocol)) {
    set_u16(bytes, mbap_protocol_at, number_of(*fault));
  }
  if (const Fault* fault = active.find(FaultKind::wrong_header_length)) {
    const std::uint16_t extra = number_of(*fault);
    const std::uint16_t length = get_u16(bytes, mbap_length_at);
    set_u16(bytes, mbap_length_at, static_cast<std::uint16_t>(length + extra));
    bytes.insert(bytes.end(), extra, 0);
  }
}

// Everything that replaces, cuts or repeats the finished frame.
Bytes spoil_frame(Bytes bytes, const ActiveFaults& active) {
  if (active.has(FaultKind::lost) || active.has(FaultKind::close)) return {};
  if (const Fault* fault = active.find(FaultKind::garbage)) {
    bytes.assign(number_of(*fault), noise_byte);
  }
  if (active.has(FaultKind::half) || active.has(FaultKind::close_inside)) {
    bytes.resize(bytes.size() / 2);
  }
  if (active.has(FaultKind::repeated)) {
    const Bytes once = bytes;
    bytes.insert(bytes.end(), once.begin(), once.end());
  }
  if (const Fault* fault = active.find(FaultKind::noise)) {
    bytes.insert(bytes.begin(), number_of(*fault), noise_byte);
  }
  return bytes;
}

Bytes spoiled(Framing framing, modbus::Adu adu, const ActiveFaults& active) {
  spoil_pdu(adu.pdu, active);
  spoil_addressing(adu, active);
  Bytes bytes = modbus::frame(framing, adu);
  if (framing == Framing::tcp) spoil_header(bytes, active);
  if (framing == Framing::rtu && active.has(FaultKind::bad_crc)) bytes.back() ^= 1U;
  return spoil_frame(std::move(bytes), active);
}

bool closes(const ActiveFaults& active) {
  return active.has(FaultKind::close) || active.has(FaultKind::close_inside) ||
         active.has(FaultKind::close_after);
}

// An answer of the same shape from another unit of the bus, with other data.
Bytes foreign_bytes(const modbus::Adu& answer, const Fault* fault) {
  if (fault == nullptr) return {};
  modbus::Adu foreign = answer;
  foreign.unit.value = static_cast<std::uint8_t>(number_of(*fault));
  if (!foreign.pdu.data.empty()) foreign.pdu.data.back() ^= 1U;
  return modbus::frame(Framing::rtu, foreign);
}

void append(Bytes& to, const Bytes& bytes) { to.insert(to.end(), bytes.begin(), bytes.end()); }

std::deque<Bytes> pieces_of(const Bytes& bytes, std::size_t size) {
  std::deque<Bytes> pieces;
  for (std::size_t at = 0; at < bytes.size(); at += size) {
    const std::size_t end = std::min(at + size, bytes.size());
    pieces.emplace_back(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                        bytes.begin() + static_cast<std::ptrdiff_t>(end));
  }
  return pieces;
}

// One piece, or two where a pushed frame is cut by the answer.
std::deque<Bytes> cut_at(const Bytes& bytes, std::size_t cut) {
  if (cut == 0) return pieces_of(bytes, std::max<std::size_t>(bytes.size(), 1));
  const auto middle = bytes.begin() + static_cast<std::ptrdiff_t>(cut);
  return {Bytes(bytes.begin(), middle), Bytes(middle, bytes.end())};
}

Duration time_of(std::size_t pieces) {
  return pieces < 2 ? Duration::zero() : (static_cast<std::int64_t>(pieces) - 1) * piece_distance;
}

}  // namespace

Peer::Peer(Server& server, ConnectionId connection, Framing framing, const FaultPlan& faults,
           AnswerCounter& counter, const LineModel& line)
    : server_(&server),
      connection_(connection),
      framing_(framing),
      faults_(&faults),
      counter_(&counter),
      character_time_(framing == Framing::rtu ? line.character_time : Duration::zero()) {
  const Duration gap = server_->required_gap();
  if (framing_ == Framing::rtu && line.gaps == LineModel::Gaps::enforced &&
      gap > Duration::zero()) {
    line_.emplace(gap, character_time_);
  }
  server_->connected(connection_);
}

namespace {

/// "2.1 ms": what a user compares with the silence that a manual asks for.
std::string in_milliseconds(Duration duration) {
  using Milliseconds = std::chrono::duration<double, std::milli>;
  return fmt::format("{:.1f} ms", std::chrono::duration_cast<Milliseconds>(duration).count());
}

std::string too_early(Duration silence, Duration needed) {
  return fmt::format("{} of silence, {} needed", in_milliseconds(silence), in_milliseconds(needed));
}

std::string fault_of_frame(ByteView bytes) {
  constexpr std::size_t shortest = 4;
  if (bytes.size() < shortest) return "it is too short to be a frame";
  return "its checksum is wrong, or it is no frame";
}

}  // namespace

void Peer::ignore(ByteView bytes, std::string_view reason) const {
  if (ignored_) ignored_(bytes, reason);
}

/// The server hears noise.
void Peer::no_frame(ByteView bytes, TimePoint now) {
  ignore(bytes, fault_of_frame(bytes));
  server_->bad_frame(now);
}

void Peer::forget() {
  inbox_.clear();
  outbox_.clear();
  if (line_) line_.emplace(server_->required_gap(), character_time_);
}

Peer::~Peer() { server_->disconnected(connection_); }

void Peer::receive(ByteView bytes, TimePoint now) {
  if (closing_) return;
  if (framing_ == Framing::rtu) echo(bytes, now);
  if (line_) {
    take_burst(now);  // which ended before these bytes, when no client could look in time
    if (!closing_) line_->hear(bytes, now);
    return;
  }
  if (framing_ == Framing::rtu && !inbox_.empty() && now > last_byte_ + longest_pause) {
    no_frame(std::exchange(inbox_, {}), now);
  }
  last_byte_ = now;
  inbox_.insert(inbox_.end(), bytes.begin(), bytes.end());
  while (!closing_ && take_request(now)) {
  }
}

void Peer::echo(ByteView bytes, TimePoint now) {
  const ActiveFaults active(*faults_, counter_->value + 1);
  if (!active.has(FaultKind::echo)) return;
  enqueue(
      {.due = now + time_on_the_wire(bytes.size()), .pieces = {Bytes(bytes.begin(), bytes.end())}});
}

Duration Peer::time_on_the_wire(std::size_t bytes) const {
  return character_time_ * static_cast<Duration::rep>(bytes);
}

// The silence has ended a frame, so its bounds are known whatever is in it.
void Peer::take_burst(TimePoint now) {
  const auto burst = line_->take(now);
  if (!burst || closing_) return;
  if (burst->timing == Burst::Timing::too_early) {
    ignore(burst->bytes, too_early(burst->silence, server_->required_gap()));
    return;
  }
  const auto request = modbus::whole_rtu_frame(burst->bytes);
  if (request) {
    answer(*request, burst->end, now);
  } else {
    no_frame(burst->bytes, now);
  }
}

// True when there may be another one behind it.
bool Peer::take_request(TimePoint now) {
  const modbus::Deframing found = modbus::deframe(framing_, modbus::Role::server, inbox_);
  if (const auto* request = std::get_if<modbus::Deframed>(&found)) {
    const Bytes skipped(inbox_.begin(),
                        inbox_.begin() + static_cast<std::ptrdiff_t>(request->skipped));
    inbox_.erase(inbox_.begin(), inbox_.begin() + static_cast<std::ptrdiff_t>(request->consumed));
    if (request->skipped > 0) no_frame(skipped, now);
    answer(request->adu, now + time_on_the_wire(request->consumed), now);
    return true;
  }
  const auto* junk = std::get_if<modbus::Junk>(&found);
  if (junk == nullptr) return false;
  if (framing_ == Framing::tcp) {
    ignore(inbox_,
           fmt::format("this is not Modbus TCP ({}), so the connection is closed", junk->reason));
    disconnect(now);
    return false;
  }
  const std::size_t dropped = std::clamp<std::size_t>(junk->size, 1, inbox_.size());
  no_frame(ByteView(inbox_).first(dropped), now);
  inbox_.erase(inbox_.begin(), inbox_.begin() + static_cast<std::ptrdiff_t>(dropped));
  return !inbox_.empty();
}

std::optional<modbus::Pdu> Peer::respond(const modbus::Adu& request, const Fault* exception,
                                         TimePoint now) {
  if (exception == nullptr || !server_->answers_to(request.unit)) {
    return server_->answer(connection_, request.unit, request.pdu, now);
  }
  server_->advance(now);
  return modbus::exception_response(request.pdu.function,
                                    static_cast<std::uint8_t>(number_of(*exception)));
}

void Peer::answer(const modbus::Adu& request, TimePoint heard, TimePoint now) {
  const ActiveFaults active(*faults_, counter_->value + 1);
  unit_ = server_->answering_unit(request.unit);
  const auto response = respond(request, active.find(FaultKind::exception), now);
  const bool broadcast = framing_ == Framing::rtu && request.unit == modbus::UnitId{};
  if (!response && !broadcast) {
    ignore(modbus::frame(framing_, request),
           fmt::format("there is no unit {}", request.unit.value));
  }
  if (!response || broadcast) return;
  ++counter_->value;

  const modbus::Adu right{request.transaction, unit_, *response};
  Bytes bytes;
  if (framing_ == Framing::rtu) bytes = foreign_bytes(right, active.find(FaultKind::foreign));
  append(bytes, event_bytes(active.find(FaultKind::push_before), request.transaction));
  const Bytes inside = event_bytes(active.find(FaultKind::push_inside), request.transaction);
  const std::size_t cut = inside.empty() ? 0 : bytes.size() + inside.size() / 2;
  append(bytes, inside);
  append(bytes, spoiled(framing_, right, active));
  append(bytes, event_bytes(active.find(FaultKind::push_after), request.transaction));

  const Fault* split = active.find(FaultKind::split);
  const TimePoint ready =
      heard + server_->answer_delay(request.unit) + time_on_the_wire(bytes.size());
  Message message{
      .due = ready + active.longest(FaultKind::latency),
      .pieces = split != nullptr ? pieces_of(bytes, number_of(*split)) : cut_at(bytes, cut)};
  if (active.has(FaultKind::late)) {
    message.due = std::max(message.due, ready + active.longest(FaultKind::late));
  } else {
    message.due = std::max(message.due, in_order_from_);
    in_order_from_ = message.due + time_of(message.pieces.size());
  }
  if (closes(active)) {
    message.ending = Ending::close;
    closing_ = true;
  } else if (active.has(FaultKind::glued) && !message.pieces.empty()) {
    message.holding = Holding::until_next;
    message.due += longest_hold;
  }
  enqueue(std::move(message));
}

Bytes Peer::event_bytes(const Fault* fault, modbus::TransactionId pending) {
  if (fault == nullptr) return {};
  const auto event = server_->event_frame();
  if (!event) return {};
  modbus::TransactionId id = pending;
  if (!fault->pending_transaction) id = {fault->number ? *fault->number : push_transaction_++};
  return modbus::frame(framing_, {id, unit_, *event});
}

void Peer::push(const modbus::Pdu& pdu, TimePoint now) {
  if (closing_) return;
  const Bytes bytes = modbus::frame(framing_, {{push_transaction_++}, unit_, pdu});
  const bool is_long = bytes.size() > modbus::max_adu_size;
  // Frames leave in their order, however long one before takes.
  const TimePoint due = std::max(now, pushes_in_order_from_);
  Message message{
      .due = due,
      .pieces = is_long ? pieces_of(bytes, wireless_segment) : pieces_of(bytes, bytes.size()),
      .distance = is_long ? wireless_pause : piece_distance};
  pushes_in_order_from_ =
      due + wireless_pause * static_cast<std::int64_t>(is_long ? message.pieces.size() : 0);
  enqueue(std::move(message));
}

void Peer::disconnect(TimePoint now) {
  closing_ = true;
  inbox_.clear();
  enqueue({.due = std::max(now, in_order_from_), .ending = Ending::close});
}

void Peer::enqueue(Message message) {
  join_held(message);
  if (message.pieces.empty() && message.ending == Ending::stay) return;
  auto place = outbox_.begin();
  while (place != outbox_.end() && (place->begun || place->due <= message.due)) ++place;
  outbox_.insert(place, std::move(message));
}

// A frame that was kept back leaves in one piece with this one, unless this one comes too late.
void Peer::join_held(Message& message) {
  const auto held = std::find_if(outbox_.begin(), outbox_.end(), [](const Message& waiting) {
    return waiting.holding == Holding::until_next && !waiting.begun;
  });
  const bool carries = !message.pieces.empty() || message.ending == Ending::close;
  if (held == outbox_.end() || !carries) return;
  const TimePoint limit = held->due;
  const TimePoint ready =
      message.holding == Holding::until_next ? message.due - longest_hold : message.due;
  if (ready > limit) return;

  Bytes& last = held->pieces.back();
  if (!message.pieces.empty()) {
    append(last, message.pieces.front());
    message.pieces.pop_front();
  }
  message.pieces.insert(message.pieces.begin(), held->pieces.begin(), held->pieces.end());
  message.due = std::min(message.due, limit);
  outbox_.erase(held);
}

std::optional<TimePoint> Peer::next_due() const {
  auto due = line_ ? line_->silent_at() : std::nullopt;
  if (!outbox_.empty()) due = std::min(due.value_or(TimePoint::max()), outbox_.front().due);
  return due;
}

Bytes Peer::take(TimePoint now) {
  if (line_) take_burst(now);
  if (outbox_.empty()) return {};
  Message& front = outbox_.front();
  if (front.pieces.empty() || now < front.due) return {};
  Bytes piece = std::move(front.pieces.front());
  front.pieces.pop_front();
  front.begun = true;
  if (line_) line_->spoke(now);
  if (!front.pieces.empty()) {
    front.due += front.distance;
  } else if (front.ending == Ending::stay) {
    outbox_.pop_front();
  }
  return piece;
}

bool Peer::closed(TimePoint now) const {
  if (outbox_.empty()) return false;
  const Message& front = outbox_.front();
  return front.ending == Ending::close && front.pieces.empty() && now >= front.due;
}

}  // namespace spindle::sim
