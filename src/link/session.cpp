#include "spindle/link/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"

namespace spindle::link {
namespace {

// Events are taken at once where they are watched; this bounds memory elsewhere.
constexpr std::size_t max_queued = 4096;
constexpr std::size_t max_queued_bytes = 4U << 20U;

// A curve is many times as long as an answer.
constexpr std::size_t most_received = 4096;

// A tool that answers at all has long done so; a user who pressed Ctrl-C hardly notices.
constexpr Duration longest_settling = std::chrono::milliseconds(250);

// Times the answer timeout, behind the quarantine: it is not known how late an answer can be, but
// it hardly is by more, and every proof takes time that a stop may be waiting for.
constexpr Duration::rep longest_doubt = 2;
/// For how long the next program on the line doubts, at least: it may ask much sooner than this one
/// would have.
constexpr Duration least_doubt_left = std::chrono::seconds(2);

constexpr std::uint16_t smallest_transaction = 0x8000;

// An answer that was asked for by another master is over by then.
constexpr Duration first_listening = std::chrono::milliseconds(20);

// A line that was quiet for so long after it was opened is believed.
constexpr Duration newness = std::chrono::seconds(1);

// Behind an answer the line is listened to for as many round trips, as the quickest of them may
// have been that of another one's answer, and a bit longer.
constexpr Duration::rep trips_listened = 2;
constexpr Duration trip_margin = std::chrono::milliseconds(20);
constexpr Duration longest_listening = std::chrono::milliseconds(250);

/// A network may hold back answers for longer than a serial line, and a gateway queues requests.
constexpr Duration least_gateway_doubt = std::chrono::seconds(30);

// More late answers than these hardly come at once.
constexpr std::size_t most_unanswered = 8;

// With ids, so many answers that were given up can still be told from what comes unasked.
constexpr std::size_t most_given_up = 64;

// Another master that polls all the time leaves few quiet moments.
constexpr int most_proofs = 4;

using modbus::FunctionCode;

/// The part of the answer to another read that the answer to `request` would be.
modbus::Pdu part_of(const OtherRead& other, const modbus::Pdu& answer, const modbus::Pdu& request) {
  const Registers registers = modbus::registers_of(other.request, answer);
  const auto asked = modbus::parse_request(request);
  const auto& read = std::get<modbus::ReadRequest>(*asked);
  return modbus::read_response(read.table, RegisterView(registers).subspan(other.skip, read.count));
}

bool would_answer(const modbus::Adu& request, const modbus::Adu& received,
                  const DemuxRules& rules) {
  const Verdict verdict = judge(&request, received, rules);
  return verdict == Verdict::answer || verdict == Verdict::exception_response;
}

/// A frame of any kind within bytes that no client expects.
bool holds_request(ByteView bytes) {
  if (modbus::whole_rtu_frame(bytes)) return true;
  const auto found = modbus::deframe(modbus::Framing::rtu, modbus::Role::server, bytes);
  return std::holds_alternative<modbus::Deframed>(found);
}

std::string_view sentence_of(Evidence evidence, modbus::Framing framing) {
  if (framing == modbus::Framing::tcp) {
    return "answers come that nothing asked for; each answer is proved";
  }
  switch (evidence) {
    case Evidence::noise:
      return "bytes come that belong to no answer: noise, or another master is on this line; each "
             "answer is proved";
    case Evidence::repeated:
      return "answers come twice on this line; each answer is proved";
    case Evidence::master:
      break;
  }
  return "another master is on this line; each answer is proved";
}

/// Whether the answer is a copy of the request, so that only an echo can be mistaken for it.
bool is_repeated_by_answer(const modbus::Pdu& request) {
  const auto function = static_cast<modbus::FunctionCode>(request.function);
  return function == modbus::FunctionCode::write_single_coil ||
         function == modbus::FunctionCode::write_single_register ||
         function == modbus::FunctionCode::diagnostics;
}

Error everybody_error() {
  return {.code = Errc::usage,
          .message = "unit 0 means every unit of the line at once, and none of them answers",
          .hint = "name one, such as unit=1; 'spindle scan' shows which are there"};
}

/// How long an RTU frame is that answers the request, judged by what has come of it.
std::size_t whole_answer_size(const modbus::Pdu& request, ByteView begun) {
  constexpr std::size_t around_count = 5;  // unit, function, byte count, CRC; an exception likewise
  constexpr std::size_t two_words = 8;
  constexpr std::size_t bits_per_byte = 8;
  if (begun.size() > 1 && (begun[1] & modbus::exception_bit) != 0) return around_count;
  switch (static_cast<modbus::FunctionCode>(request.function)) {
    case modbus::FunctionCode::read_holding_registers:
    case modbus::FunctionCode::read_input_registers:
      return around_count + std::size_t{get_u16(request.data, 2)} * 2;
    case modbus::FunctionCode::read_coils:
    case modbus::FunctionCode::read_discrete_inputs:
      return around_count +
             (std::size_t{get_u16(request.data, 2)} + bits_per_byte - 1) / bits_per_byte;
    case modbus::FunctionCode::report_server_id:
      return around_count + (begun.size() > 2 ? begun[2] : 1U);
    default:
      break;
  }
  return two_words;
}

/// Where another program has the line, all that is special about it is that program's affair.
SessionOptions asking(const SessionOptions& own) {
  return {.rules = {.framing = modbus::Framing::tcp,
                    .spontaneous = own.rules.spontaneous,
                    .units = own.rules.units,
                    .transactions = modbus::TransactionIds::echoed},
          .unit = own.unit,
          .answer_timeout = own.answer_timeout,
          .first_transaction = own.first_transaction};
}

using modbus::Framing;

/// When what came is whole frames of the other framing: the target names the wrong one.
/// An echo of an RTU request can look like a frame of Modbus TCP, but not like an answer to it.
std::optional<Error> foreign_framing(Framing framing, ByteView heard,
                                     std::optional<std::uint8_t> function = std::nullopt) {
  const Framing other = framing == Framing::tcp ? Framing::rtu : Framing::tcp;
  const auto found = modbus::deframe(other, modbus::Role::client, heard);
  const auto* frame = std::get_if<modbus::Deframed>(&found);
  if (frame == nullptr || frame->skipped > 0) return std::nullopt;
  const unsigned exception = modbus::exception_bit;
  const unsigned answered = frame->adu.pdu.function & ~exception;
  if (function && answered != *function) return std::nullopt;
  constexpr std::size_t protocol_at = 2;
  if (other == Framing::tcp && get_u16(heard, protocol_at) != 0) return std::nullopt;
  const bool rtu = other == Framing::rtu;
  return Error{.code = Errc::malformed_answer,
               .message = rtu ? "what came are RTU frames, not Modbus TCP"
                              : "what came are frames of Modbus TCP, not RTU",
               .hint = rtu ? "write the target as rtu+tcp://HOST:PORT"
                           : "write the target as tcp://HOST:PORT"};
}

}  // namespace

struct Session::Outstanding {
  modbus::Adu request;
  Bytes bytes;  ///< the request as sent
  TimePoint sent = {};
  TimePoint deadline = {};
  std::optional<modbus::Pdu> answer = std::nullopt;
  std::string broken = {};  ///< what came with our id and was no answer
  std::optional<modbus::UnitId> other_unit = std::nullopt;  ///< that answered with our id
  std::size_t events = 0;  ///< frames that the tool sent unasked meanwhile
  std::optional<modbus::TransactionId> other_id = std::nullopt;  ///< of what is else the answer
  std::size_t strangers = 0;  ///< whole frames that answer nothing of ours
  std::string stranger = {};  ///< the last of them
  std::size_t echoes = 0;     ///< copies of the request that came back
};

Session::Session(std::unique_ptr<Transport> transport, Clock& clock, SessionOptions options,
                 Trace trace)
    : transport_(std::move(transport)),
      clock_(&clock),
      asked_as_(transport_->asks_owner() ? std::optional(options) : std::nullopt),
      options_(asked_as_ ? asking(options) : std::move(options)),
      trace_(std::move(trace)),
      first_transaction_(std::max(options_.first_transaction, smallest_transaction)),
      next_transaction_(first_transaction_),
      created_(clock.now()),
      last_activity_(options_.in_use_until),
      echo_(options_.echo) {
  transport_->introduce(asked_as_.value_or(options_));
  if (options_.late_answers == SessionOptions::LateAnswers::shared) require_verification(created_);
  if (options_.late_answers == SessionOptions::LateAnswers::possible) {
    require_verification(created_);
    others_late_until_ = past_until_ = doubtful_until_;
  }
  if (!has_ids(options_.rules)) {
    const TimePoint late = transport_->late_until();
    doubt_.raise(late);
    past_until_ = std::max(past_until_, late);
    others_late_until_ = std::max(others_late_until_, late);
    // A unit may be deaf while it says what is late: behind it, neither our request nor what is to
    // prove its answer is sure to be heard. So the line is proved before it is used.
    if (past_until_ > created_ && answers_come_in_order()) quarantined_until_ = created_;
  }
  const std::string company = is_rtu() ? transport_->company() : std::string();
  if (company.empty()) return;
  doubt_.stay();
  if (trace_.notice) {
    trace_.notice(
        fmt::format("{} has this line open, too: perhaps another master is on this line; "
                    "each answer is proved",
                    company));
  }
}

Session::~Session() {
  const TimePoint now = clock_->now();
  if (!unanswered_.empty() && now < doubtful_until_) {
    transport_->leave_late(std::max(doubtful_until_, now + least_doubt_left));
  }
  if (!trace_.bytes) return;
  if (const Bytes rest = veil_.rest(); !rest.empty()) trace_.bytes(Direction::received, rest);
  trace_.bytes(Direction::received, {});
}

/// The line is ours as long as this lives. Who has it next keeps the silence that we owe, and goes
/// on where the stream of a connection was left.
class Session::Lease {
 public:
  explicit Lease(Session& session) : session_(&session) {
    Transport::BusLease left = session_->transport_->acquire_bus();
    session_->last_activity_ = std::max(session_->last_activity_, left.used_until);
    session_->others_late_until_ = std::max(session_->past_until_, left.late_until);
    session_->hear_what_others_heard(std::move(left.heard));
    if (left.stream) session_->go_on_with(std::move(*left.stream));
    dialogues_ = std::move(left.dialogues);
    const auto dialogue = dialogues_.find(session_->options_.unit);
    if (dialogue != dialogues_.end()) session_->go_on_with(dialogue->second);
    session_->has_turn_ = session_->had_turn_ = session_->transport_->is_shared();
  }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;
  ~Lease() {
    Transport::BusLease left{.used_until = session_->last_activity_,
                             .late_until = session_->doubtful_until_};
    if (!session_->is_rtu()) left.stream = session_->stream();
    if (session_->has_turn_) {
      // Bytes of a stream are the line's, where more may come before the next turn.
      if (left.stream) session_->buffer_.clear();
      if (session_->is_rtu()) {
        dialogues_.insert_or_assign(session_->options_.unit, session_->dialogue());
      }
      left.dialogues = std::move(dialogues_);
      session_->has_turn_ = false;
    }
    session_->transport_->release_bus(left);
  }

 private:
  Session* session_;
  std::map<modbus::UnitId, Transport::Dialogue> dialogues_ = {};
};

void Session::set_unit(modbus::UnitId unit) {
  options_.unit = unit;
  if (!asked_as_) return;
  asked_as_->unit = unit;
  transport_->introduce(*asked_as_);
}

void Session::set_rules(DemuxRules rules) {
  if (asked_as_) {
    asked_as_->rules = std::move(rules);
    options_.rules = asking(*asked_as_).rules;
  } else {
    options_.rules = std::move(rules);
  }
  transport_->introduce(asked_as_.value_or(options_));
}

Transport::Dialogue Session::dialogue() const {
  return {.quarantined_until = quarantined_until_,
          .doubtful_until = doubtful_until_,
          .past_until = past_until_,
          .abandoned = abandoned_,
          .unanswered = unanswered_,
          .doubt = doubt_};
}

/// Another session may have asked the same unit since. What this one knew before its first turn
/// still counts.
void Session::go_on_with(const Transport::Dialogue& dialogue) {
  if (had_turn_) {
    quarantined_until_ = dialogue.quarantined_until;
    doubtful_until_ = dialogue.doubtful_until;
    past_until_ = dialogue.past_until;
    doubt_ = dialogue.doubt;
  } else {
    quarantined_until_ = std::max(quarantined_until_, dialogue.quarantined_until);
    doubtful_until_ = std::max(doubtful_until_, dialogue.doubtful_until);
    past_until_ = std::max(past_until_, dialogue.past_until);
    doubt_.learn(dialogue.doubt);
  }
  abandoned_ = dialogue.abandoned;
  unanswered_ = dialogue.unanswered;
}

/// Frames that came in the turn of another session come before all that comes in this one.
void Session::hear_what_others_heard(Bytes frames) {
  if (frames.empty()) return;
  show_received(frames);
  buffer_ = std::move(frames);
  torn_ = 0;
  static_cast<void>(sort_buffered(nullptr));  // what is no frame shows when the line is used
}

/// What was not asked for on this connection may be an event for another session. It may have the
/// id of any request, so those that look like an event are passed on whatever their id.
void Session::pass_on(const modbus::Adu& received) const {
  if (has_turn_ && has_ids(options_.rules)) {
    transport_->pass_on(modbus::frame(Framing::tcp, received));
  }
}

/// The answer to a request that was given up, told by its id and its shape: no event, although it
/// may look like one.
bool Session::take_late_with_id(const modbus::Adu& received) {
  if (!has_ids(options_.rules) || unanswered_.empty()) return false;
  const auto late = std::find_if(unanswered_.begin(), unanswered_.end(), [&](const auto& each) {
    return each.request.transaction == received.transaction &&
           would_answer(each.request, received, options_.rules);
  });
  if (late == unanswered_.end()) return false;
  unanswered_.erase(late);
  decide(Decision::late, received);
  ++counters_.strays;
  return true;
}

Transport::Stream Session::stream() const {
  return {.rest = buffer_,
          .torn = torn_,
          .first_transaction = first_transaction_,
          .next_transaction = next_transaction_,
          .unanswered = unanswered_,
          .out_of_step = out_of_step_};
}

void Session::go_on_with(Transport::Stream stream) {
  buffer_ = std::move(stream.rest);
  torn_ = stream.torn;
  first_transaction_ = stream.first_transaction;
  next_transaction_ = stream.next_transaction;
  unanswered_ = std::move(stream.unanswered);
}

Result<modbus::Pdu> Session::transact(const modbus::Pdu& request, const Others& others) {
  const Lease lease(*this);
  return ask(request, others);
}

Result<modbus::Pdu> Session::ask(const modbus::Pdu& request, const Others& others) {
  // An answer that repeats its request cannot be another one's, so a stop need not wait here.
  if (quarantined_until_ && !is_repeated_by_answer(request)) {
    TRY(leave_quarantine());
  }
  TRY(find_echo(request));
  const bool proves_itself = has_ids(options_.rules) || is_repeated_by_answer(request) ||
                             modbus::is_write(request.function);
  if (proves_itself) {
    TRY(let_copies_pass(request));
    return exchange(request);
  }
  TRY(listen_first());
  const bool provable = has_loopback() && proves_ == Proves::in_doubt;
  const bool behind_late =
      provable && clock_->now() < doubtful_until_ && !doubt_.is_raised(clock_->now());
  return behind_late ? ask_behind_late(request) : ask_carefully(request, others);
}

/// Units answer in order. So an answer is one to an earlier request when yet another one comes
/// before that of a loop-back sent behind it.
Result<modbus::Pdu> Session::ask_behind_late(const modbus::Pdu& request) {
  auto answer = exchange(request);
  if (!answer) return answer;
  const std::uint64_t strays = counters_.strays;
  const Duration round_trip = last_round_trip_;
  auto proved = exchange(modbus::loopback_request(fresh_word()));
  if (!proved) return tl::unexpected(std::move(proved.error()));
  last_round_trip_ = round_trip;
  if (counters_.strays == strays) return answer;
  quarantined_until_ = clock_->now() + options_.answer_timeout;
  require_verification(*quarantined_until_);
  return tl::unexpected(Error{.code = Errc::no_answer,
                              .message = "only the late answer to an earlier request came",
                              .hint = "a longer --timeout waits for a slow unit",
                              .tried = modbus::describe_request(request)});
}

/// A read whose answer is proved where there is doubt: about the line, or about this answer.
Result<modbus::Pdu> Session::ask_carefully(const modbus::Pdu& request, const Others& others) {
  for (int proofs = 0; proofs < most_proofs; ++proofs) {
    if (proofs > 0) {
      // Where one answer was another's, ours may still come, and each would be one too late.
      auto silent = wait_for_silence(clock_->now() + time_to_listen());
      if (!silent) return tl::unexpected(std::move(silent.error()));
    }
    const std::uint64_t disturbances = doubt_.disturbances();
    const std::uint64_t noises = noises_;
    auto answer = exchange(request);
    if (!answer) return answer;
    const TimePoint now = clock_->now();
    const bool may_be_copy = expects_others() && doubt_.may_be_copy(request, *answer, now);
    const bool beside =
        doubt_.disturbances() != disturbances || noises_ != noises || !buffer_.empty();
    std::optional<modbus::Pdu> believed = *answer;
    if (doubt_.is_raised(now) || beside || may_be_copy) {
      const Duration round_trip = last_round_trip_;
      TRY_LET(auto proved, prove(request, *answer, others));
      last_round_trip_ = round_trip;
      believed = std::move(proved);
    } else {
      ++unproved_;
    }
    if (believed) return std::move(*believed);
  }
  return tl::unexpected(Error{
      .code = Errc::no_answer,
      .message = fmt::format("no answer to '{}' can be told from what others say on this line",
                             modbus::describe_request(request)),
      .hint = "end the other master or program on this line, or wait until it is quiet",
      .tried = modbus::describe_request(request)});
}

/// The answer that is proved, or none where another one came. A frame that could be the answer,
/// too, and says something else, refutes.
Result<std::optional<modbus::Pdu>> Session::prove(const modbus::Pdu& request,
                                                  const modbus::Pdu& answer, const Others& others) {
  decide(Decision::proof, modbus::explain_request(request));
  const TimePoint now = clock_->now();
  if (doubt_.is_raised(now) && doubt_.may_be_copy(request, answer, now)) {
    // Copies of what was asked before must not prove each other; what comes instead refutes.
    contested_ = {request};
    accepted_ = answer;
    refutations_ = 0;
    auto silent = wait_for_silence(now + longest_copy);
    contested_.clear();
    if (!silent) return tl::unexpected(std::move(silent.error()));
    if (refutations_ > 0) return std::nullopt;
  }
  const bool is_exception = modbus::exception_of(answer).has_value();
  std::vector<OtherRead> own = is_exception ? std::vector<OtherRead>() : with_own_shapes(others);
  if (!own.empty()) return prove_by_others(request, answer, std::move(own));
  return prove_by_repeating(request, answer);
}

/// Answers come in order over TCP. So where some were given up, one more than those has to agree.
Result<std::optional<modbus::Pdu>> Session::prove_by_repeating(const modbus::Pdu& request,
                                                               const modbus::Pdu& answer) {
  constexpr std::size_t once = 1;
  const std::size_t repetitions = is_rtu() ? once : std::max(once, late_ones_like(answer));
  for (std::size_t count = 0; count < repetitions; ++count) {
    contested_ = {request};
    TRY_LET(auto again, exchange_contested(request, answer));
    if (again != answer || refutations_ > 0) return std::nullopt;
  }
  if (!has_loopback()) {
    const bool may_lose_ours = !transport_->company().empty();
    return may_lose_ours ? std::nullopt : std::optional(answer);
  }
  contested_ = {request};
  return prove_by_loopback(answer);
}

/// What has an unusual shape is hardly the answer to another master's request. Two such answers
/// that agree are proof even where the value changed since it was asked for first. Where another
/// program takes ours away, two of one shape may both be answers to its request: there they agree
/// across shapes.
Result<std::optional<modbus::Pdu>> Session::prove_by_others(const modbus::Pdu& request,
                                                            const modbus::Pdu& answer,
                                                            std::vector<OtherRead> reads) {
  constexpr std::size_t most_turns = 4;
  const bool may_lose_ours = !transport_->company().empty();
  if (!may_lose_ours) reads.resize(1);
  std::vector<modbus::Pdu> parts = {answer};  // of the request, then of the turns
  const auto agrees = [&](const modbus::Pdu& part) {
    if (!may_lose_ours) return part == parts.back();
    for (std::size_t at = 0; at < parts.size(); ++at) {
      const bool is_other_shape = at == 0 || (parts.size() - at) % reads.size() != 0;
      if (is_other_shape && parts[at] == part) return true;
    }
    return false;
  };
  modbus::Pdu accepted = answer;
  for (std::size_t turn = 0; turn < most_turns; ++turn) {
    const OtherRead& other = reads[turn % reads.size()];
    contested_ = {other.request};
    if (turn == 0) contested_.push_back(request);
    TRY_LET(auto again, exchange_contested(other.request, accepted));
    if (modbus::exception_of(again)) return std::nullopt;
    modbus::Pdu part = part_of(other, again, request);
    if (refutations_ == 0 && agrees(part)) return part;
    accepted = std::move(again);
    parts.push_back(std::move(part));
  }
  // Else a value that never stands still can be proved.
  if (!has_loopback() || may_lose_ours) return std::nullopt;
  contested_ = {reads.front().request};
  return prove_by_loopback(accepted).map([&](const std::optional<modbus::Pdu>& proved) {
    return proved ? std::optional(parts.back()) : std::nullopt;
  });
}

Result<std::optional<modbus::Pdu>> Session::prove_by_loopback(const modbus::Pdu& answer) {
  return exchange_contested(modbus::loopback_request(fresh_word()), answer)
      .map([&](const modbus::Pdu&) {
        return refutations_ == 0 ? std::optional(answer) : std::nullopt;
      });
}

/// An exchange that counts what refutes the answer accepted before.
Result<modbus::Pdu> Session::exchange_contested(const modbus::Pdu& request,
                                                const modbus::Pdu& accepted) {
  refutations_ = 0;
  accepted_ = accepted;
  auto answer = exchange(request);
  contested_.clear();
  return answer;
}

void Session::note_refutation(const modbus::Adu& stray) {
  const bool refutes =
      stray.pdu != accepted_ &&
      std::any_of(contested_.begin(), contested_.end(), [&](const auto& request) {
        const modbus::Adu asked{.transaction = {}, .unit = options_.unit, .pdu = request};
        return would_answer(asked, stray, options_.rules);
      });
  if (refutes) ++refutations_;
}

/// Those whose answers have a shape that nothing else had here.
std::vector<OtherRead> Session::with_own_shapes(const Others& others) const {
  std::vector<OtherRead> own;
  std::copy_if(others.begin(), others.end(), std::back_inserter(own), [&](const OtherRead& other) {
    const bool is_late = !is_rtu() && may_be_late_to_like(other.request);
    return !is_late && !doubt_.is_shape_taken(other.request);
  });
  return own;
}

/// Units answer in order: had an answer been another's, ours would come in front of that of a
/// loop-back behind it. But where others read what comes for us, too, they may have taken ours.
bool Session::answers_come_in_order() const {
  return has_loopback() && order_ == Order::kept && transport_->company().empty();
}

/// The copy of the answer to an equal write is no answer to this one.
Result<void> Session::let_copies_pass(const modbus::Pdu& write) {
  const bool careful = !has_ids(options_.rules) && modbus::is_write(write.function) &&
                       doubt_.is_raised(clock_->now()) && proves_ == Proves::in_doubt;
  if (!careful) return {};
  const modbus::Pdu answer{.function = write.function,
                           .data = Bytes(write.data.begin(), write.data.begin() + 4)};
  const auto end = doubt_.copies_end(answer);
  return end ? wait_for_silence(*end) : Result<void>();
}

/// A line that others may have in use is listened to once, before the first read.
Result<void> Session::listen_first() {
  if (!is_rtu() || heard_ == Heard::line || !expects_others()) return {};
  heard_ = Heard::line;
  return wait_for_silence(std::max(clock_->now(), last_activity_ + options_.gap) + first_listening);
}

Duration Session::time_to_listen() const {
  return std::min(trips_listened * longest_round_trip_ + trip_margin, longest_listening);
}

Session::Mark Session::mark() const {
  return {.requests = counters_.requests,
          .unproved = unproved_,
          .proves = doubt_.is_raised(clock_->now())};
}

Result<bool> Session::is_undisturbed_since(const Mark& mark) {
  if (mark.proves || mark.requests == counters_.requests) return true;
  const TimePoint now = clock_->now();
  const bool is_new = now < created_ + newness;
  const bool listens = is_rtu() && expects_others() && is_new && proves_ == Proves::in_doubt &&
                       !doubt_.is_raised(now);
  if (listens) {
    const Lease lease(*this);
    TRY(wait_for_silence(now + time_to_listen()));
  }
  return doubted_ <= mark.unproved;
}

/// Whether a late answer of our own, or of another session of this program, may still come.
bool Session::may_be_late() const {
  return clock_->now() < std::max(doubtful_until_, others_late_until_);
}

/// A late answer of our own is no sign of another master. Each request has one.
bool Session::take_late(const modbus::Adu& stray) {
  const TimePoint now = clock_->now();
  const bool ours = stray.unit == options_.unit;
  const bool expected = ours ? now < past_until_ : now < others_late_until_;
  if (expected && is_rtu()) return true;
  if (now >= doubtful_until_ && is_rtu()) unanswered_.clear();
  const auto late = std::find_if(unanswered_.begin(), unanswered_.end(), [&](const auto& each) {
    return would_answer(each.request, stray, options_.rules);
  });
  if (late == unanswered_.end()) return expected;
  unanswered_.erase(late);
  return true;
}

/// How many answers that were given up may still come and look like this one.
std::size_t Session::late_ones_like(const modbus::Pdu& answer) const {
  const modbus::Adu received{.transaction = {}, .unit = options_.unit, .pdu = answer};
  const TimePoint now = clock_->now();
  return static_cast<std::size_t>(
      std::count_if(unanswered_.begin(), unanswered_.end(), [&](const auto& each) {
        return now < each.late_until && would_answer(each.request, received, options_.rules);
      }));
}

/// Whether an answer to another read of as many registers was given up and may still come.
bool Session::may_be_late_to_like(const modbus::Pdu& request) const {
  constexpr std::size_t count_at = 2;
  const TimePoint now = clock_->now();
  return std::any_of(unanswered_.begin(), unanswered_.end(), [&](const auto& each) {
    const modbus::Pdu& other = each.request.pdu;
    return now < each.late_until && each.request.unit == options_.unit &&
           other.function == request.function && other.data.size() == request.data.size() &&
           get_u16(other.data, count_at) == get_u16(request.data, count_at);
  });
}

void Session::find(Evidence evidence, std::string_view what) {
  if (evidence == Evidence::noise) ++noises_;
  doubted_ = unproved_;
  decide(Decision::doubt, what);
  if (doubt_.find(evidence, clock_->now()) && trace_.notice) {
    trace_.notice(sentence_of(evidence, options_.rules.framing));
  }
}

/// Bytes beside the frames: those of another master's request, or noise.
void Session::judge_noise(ByteView bytes) {
  if (bytes.empty() || !is_rtu()) return;
  const bool echo = !sent_.empty() && std::search(bytes.begin(), bytes.end(), sent_.begin(),
                                                  sent_.end()) != bytes.end();
  if (!echo && holds_request(bytes)) {
    ++queries_;
    return find(Evidence::master, "the request of another master");
  }
  if (!may_be_late()) find(Evidence::noise, "unexpected bytes");
}

void Session::require_verification(TimePoint since) {
  const Duration usual = longest_doubt * options_.answer_timeout;
  doubtful_until_ = since + (is_rtu() ? usual : std::max(usual, least_gateway_doubt));
  // Behind a gateway there is hardly a loop-back that could tell a late answer.
  const bool proves_by_reading = !is_rtu() && !has_ids(options_.rules) && !has_loopback();
  if (proves_by_reading) doubt_.raise(doubtful_until_);
}

Result<modbus::Pdu> Session::exchange(const modbus::Pdu& request) {
  const modbus::Adu adu{.transaction = {next_transaction_}, .unit = options_.unit, .pdu = request};
  next_transaction_ = next_transaction_ == 0xFFFF
                          ? smallest_transaction
                          : static_cast<std::uint16_t>(next_transaction_ + 1);
  if (is_rtu() && options_.unit == modbus::UnitId{}) return tl::unexpected(everybody_error());
  Outstanding outstanding{.request = adu, .bytes = modbus::frame(options_.rules.framing, adu)};
  auto answer = keep_gap().and_then([&]() -> Result<modbus::Pdu> {
    if (out_of_step_) return tl::unexpected(*out_of_step_);
    return send_and_await(outstanding);
  });
  if (answer) {
    last_round_trip_ = clock_->now() - outstanding.sent;
    longest_round_trip_ = std::max(longest_round_trip_, last_round_trip_);
    return answer;
  }
  Error error = std::move(answer.error());
  if (error.tried.empty()) error.tried = modbus::describe_request(request);
  decide(Decision::unanswered, message_of(error));
  return tl::unexpected(std::move(error));
}

void Session::tell_retry(const modbus::Pdu& request) const {
  decide(Decision::retry, modbus::explain_request(veil_.request(request)));
}

Result<modbus::Pdu> Session::send_and_await(Outstanding& outstanding) {
  const TimePoint began = clock_->now();
  auto answer = send(outstanding.request, outstanding.bytes).and_then([&] {
    // On a near network the answer may be there before the call that sends has returned; a line has
    // to take all bytes of a request before a unit can answer it.
    outstanding.sent = is_rtu() ? clock_->now() : began;
    outstanding.deadline = std::max(outstanding.sent, last_activity_) + options_.answer_timeout;
    return await(outstanding);
  });
  if (has_ids(options_.rules)) {
    if (!answer && has_turn_) {
      if (unanswered_.size() == most_given_up) unanswered_.erase(unanswered_.begin());
      unanswered_.push_back({outstanding.request, TimePoint::max()});
    }
    return answer;
  }
  if (!answer) {
    quarantined_until_ = std::max(clock_->now(), outstanding.deadline) + options_.answer_timeout;
    require_verification(*quarantined_until_);
    if (is_rtu()) {
      buffer_.clear();
    } else {
      check_step();
    }
    remember_unanswered(outstanding.request);
    const bool mistakable = !is_repeated_by_answer(outstanding.request.pdu);
    if (mistakable && is_rtu()) abandoned_ = outstanding.request;
  }
  if (is_rtu()) learn_echo(outstanding);
  return answer;
}

void Session::remember_unanswered(const modbus::Adu& request) {
  const TimePoint now = clock_->now();
  const auto is_over = [&](const auto& each) { return each.late_until < now; };
  if (!is_rtu()) std::erase_if(unanswered_, is_over);
  if (is_rtu() && unanswered_.size() == most_unanswered) unanswered_.erase(unanswered_.begin());
  unanswered_.push_back({request, doubtful_until_});
}

/// TCP without ids: what is left of a frame would become one with the bytes of the next answer, and
/// nothing would show it.
void Session::check_step() {
  if (buffer_.empty() || out_of_step_) return;
  out_of_step_ = Error{.code = Errc::incomplete_answer,
                       .message = "only part of an answer came, and what follows cannot be told",
                       .hint = "the connection has to be opened anew"};
}

/// An exchange whose echo cannot be taken for its answer shows whether there is one.
void Session::learn_echo(const Outstanding& outstanding) {
  const bool telling = !is_repeated_by_answer(outstanding.request.pdu);
  if (options_.echo != LocalEcho::automatic || !telling) return;
  const bool complete = outstanding.answer || clock_->now() >= outstanding.deadline;
  if (outstanding.echoes > 0) {
    echo_ = LocalEcho::present;
  } else if (complete) {
    echo_ = LocalEcho::absent;
  }
}

/// The answer to a loop-back is its own echo. Before the first one a read, whose answer is not,
/// shows whether the adapter hears itself; a unit that does not answer it is not there.
Result<void> Session::find_echo(const modbus::Pdu& request) {
  const bool loopback = request.function == static_cast<std::uint8_t>(FunctionCode::diagnostics);
  if (!is_rtu() || !loopback || echo_ != LocalEcho::automatic) return {};
  return ask(modbus::read_request(modbus::RegisterTable::holding, {}, 1), {})
      .map([](const modbus::Pdu&) {});
}

Result<void> Session::broadcast(const modbus::Pdu& request) {
  const Lease lease(*this);
  if (quarantined_until_) {
    TRY(leave_quarantine());
  }
  const modbus::Adu adu{.transaction = {}, .unit = {}, .pdu = request};
  return keep_gap()
      .and_then([&] { return send(adu, modbus::frame(options_.rules.framing, adu)); })
      .map([&] {
        last_activity_ += std::max(Duration::zero(), options_.broadcast_gap - options_.gap);
        // The next owner of the line does not know of the pause; and it was sent, come what may.
        static_cast<void>(keep_gap());
      });
}

Result<std::optional<Spontaneous>> Session::next_spontaneous(TimePoint deadline) {
  bool expired = false;
  while (true) {
    auto sorted = sort_buffered(nullptr);
    if (!queue_.empty()) break;
    if (!sorted) return tl::unexpected(std::move(sorted.error()));
    if (expired) return std::nullopt;
    TRY_LET(auto more, fill(deadline));
    expired = !more || clock_->now() >= deadline;
  }
  std::optional<Spontaneous> oldest = std::move(queue_.front());
  queue_.pop_front();
  queued_bytes_ -= oldest->pdu.data.size();
  return oldest;
}

Result<void> Session::send(const modbus::Adu& adu, ByteView bytes) {
  ++counters_.requests;
  sent_.assign(bytes.begin(), bytes.end());
  came_.clear();
  const Bytes rest = veil_.rest();
  const Bytes shown = veil_.request(options_.rules.framing, adu);
  if (trace_.bytes) {
    if (!rest.empty()) trace_.bytes(Direction::received, rest);
    trace_.bytes(Direction::sent, shown);
  }
  decide(Decision::request, adu);
  const TimePoint began = clock_->now();
  auto sent = transport_->send(bytes, began + options_.answer_timeout);
  // Where the port returns before the last bit has left, the time on the wire is the lower bound.
  const Duration on_the_wire = options_.character_time * static_cast<Duration::rep>(bytes.size());
  last_activity_ = std::max(clock_->now(), began + on_the_wire);
  return sent;
}

Result<modbus::Pdu> Session::await(Outstanding& outstanding) {
  // Strays, noise or single bytes without end must not keep the caller beyond the deadline; what
  // was already there when the deadline passed still counts.
  bool expired = false;
  while (true) {
    strip_echo(outstanding);
    auto sorted = sort_buffered(&outstanding);
    if (!sorted) return tl::unexpected(std::move(sorted.error()));
    if (outstanding.answer) return *outstanding.answer;
    if (expired) {
      if (!is_rtu()) torn_ = buffer_.size();
      return tl::unexpected(timeout_error(outstanding));
    }
    TRY_LET(auto more, fill(outstanding.deadline));
    expired = !more || clock_->now() >= outstanding.deadline;
  }
}

/// Takes away the copy of the request that some adapters receive of all that they send. Where the
/// copy looks like an answer, accept() tells them apart.
void Session::strip_echo(Outstanding& outstanding) {
  const Bytes& sent = outstanding.bytes;
  const bool strippable = is_rtu() && options_.echo != LocalEcho::absent &&
                          outstanding.echoes == 0 &&
                          !is_repeated_by_answer(outstanding.request.pdu);
  if (!strippable || buffer_.size() < sent.size()) return;
  const auto end = buffer_.begin() + static_cast<std::ptrdiff_t>(sent.size());
  if (!std::equal(sent.begin(), sent.end(), buffer_.begin(), end)) return;
  buffer_.erase(buffer_.begin(), end);
  decide(Decision::echo, outstanding.request);
  ++outstanding.echoes;
}

/// Appends what has arrived; false at the deadline.
Result<bool> Session::fill(TimePoint deadline) {
  std::array<std::uint8_t, most_received> chunk;  // NOLINT: filled by receive()
  TRY_LET(auto count, transport_->receive(chunk, deadline));
  if (count == 0) return false;
  const ByteView bytes = ByteView(chunk).first(count);
  show_received(bytes);
  if (came_.size() < modbus::max_adu_size) came_.insert(came_.end(), bytes.begin(), bytes.end());
  last_activity_ = std::max(last_activity_, clock_->now());
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  return true;
}

/// The next complete frame in the buffer, if there is one.
Result<std::optional<modbus::Adu>> Session::take_frame(const Outstanding* outstanding) {
  while (!buffer_.empty()) {
    if (!leave_torn(outstanding)) return std::nullopt;
    auto deframing = modbus::deframe(options_.rules.framing, modbus::Role::client, buffer_);
    if (std::holds_alternative<modbus::NeedMore>(deframing)) return std::nullopt;
    if (auto* frame = std::get_if<modbus::Deframed>(&deframing)) {
      note_noise(ByteView(buffer_).first(frame->skipped));
      buffer_.erase(buffer_.begin(),
                    buffer_.begin() + static_cast<std::ptrdiff_t>(frame->consumed));
      return std::move(frame->adu);
    }
    const auto& junk = std::get<modbus::Junk>(deframing);
    decide(Decision::junk, junk.reason);
    if (options_.rules.framing == modbus::Framing::tcp) {
      // Left in the buffer: every later attempt on this connection fails alike, until it is
      // reopened.
      out_of_step_ = foreign_framing(Framing::tcp, came_)
                         .value_or(Error{
                             .code = Errc::malformed_answer,
                             .message = fmt::format("what came is not Modbus TCP: {}", junk.reason),
                             .hint = "is this a Modbus TCP port? the connection has to be opened "
                                     "anew"});
      return tl::unexpected(*out_of_step_);
    }
    counters_.noise_bytes += junk.size;
    judge_noise(ByteView(buffer_).first(junk.size));
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(junk.size));
  }
  return std::nullopt;
}

/// TCP: where the answer to the request that is out begins behind a frame whose rest never came,
/// the torn frame is left. False while too little has come to tell.
bool Session::leave_torn(const Outstanding* outstanding) {
  if (torn_ == 0 || buffer_.size() <= torn_) return true;
  if (outstanding == nullptr) {
    torn_ = 0;
    return true;
  }
  constexpr std::size_t telling = 4;  // transaction id, protocol identifier
  const ByteView answer = ByteView(outstanding->bytes).first(telling);
  const ByteView behind = ByteView(buffer_).subspan(torn_);
  const std::size_t known = std::min(telling, behind.size());
  const bool begins = std::equal(
      answer.begin(), answer.begin() + static_cast<std::ptrdiff_t>(known), behind.begin());
  if (begins && known < telling) return false;
  if (begins) {
    note_noise(ByteView(buffer_).first(torn_));
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(torn_));
  }
  torn_ = 0;
  return true;
}

/// Sorts every complete frame, so that each is kept with the time of its own arrival.
Result<void> Session::sort_buffered(Outstanding* outstanding) {
  const auto answered = [&] { return outstanding != nullptr && outstanding->answer; };
  while (true) {
    auto frame = take_frame(outstanding);
    // Junk behind the answer is left for the next who asks.
    if (!frame && !answered()) return tl::unexpected(std::move(frame.error()));
    if (!frame || !*frame) return {};
    sort(**frame, answered() ? nullptr : outstanding);
  }
}

void Session::sort(const modbus::Adu& received, Outstanding* outstanding) {
  if (take_late_with_id(received)) return;
  const modbus::Adu* request = outstanding == nullptr ? nullptr : &outstanding->request;
  switch (judge(request, received, options_.rules)) {
    case Verdict::answer:
      accept(received, *outstanding);
      return;
    case Verdict::exception_response:
      decide(Decision::exception_response, received);
      take_as_answer(received, *outstanding);
      return;
    case Verdict::spontaneous:
      decide(Decision::spontaneous, received);
      if (outstanding != nullptr) ++outstanding->events;
      pass_on(received);
      keep(received.pdu);
      return;
    case Verdict::broken:
      decide(Decision::broken, received);
      outstanding->broken = describe_frame(received);
      ++counters_.strays;
      return doubt_because_of(received);
    case Verdict::other_unit:
      decide(Decision::broken, received);
      outstanding->other_unit = received.unit;
      ++counters_.strays;
      return;
    case Verdict::stray:
      decide(is_late(received) ? Decision::late : Decision::stray, received);
      ++counters_.strays;
      if (!was_given(received.transaction)) pass_on(received);
      if (outstanding != nullptr) {
        ++outstanding->strangers;
        outstanding->stranger = describe_frame(received);
        if (answers_with_other_id(received, *request)) outstanding->other_id = received.transaction;
      }
      return doubt_because_of(received);
  }
}

/// Whether it would be the answer without its id, which no request of this connection has had.
bool Session::answers_with_other_id(const modbus::Adu& received, const modbus::Adu& request) const {
  DemuxRules rules = options_.rules;
  const bool can_be_ignored =
      has_ids(rules) && rules.spontaneous.empty() && rules.units != Units::any;
  if (!can_be_ignored || was_given(received.transaction)) return false;
  rules.transactions = modbus::TransactionIds::ignored;
  return would_answer(request, received, rules);
}

/// Whether a request of this connection has had the id, as far as they have not begun anew.
bool Session::was_given(modbus::TransactionId id) const {
  if (id.value < smallest_transaction) return false;
  const auto behind_first = [&](std::uint16_t value) {
    return static_cast<std::uint16_t>(value - first_transaction_) % smallest_transaction;
  };
  return behind_first(id.value) < behind_first(next_transaction_);
}

/// Without ids: a frame that answered nothing.
void Session::doubt_because_of(const modbus::Adu& stray) {
  if (has_ids(options_.rules)) return;
  note_refutation(stray);
  if (take_late(stray)) return;
  doubt_.note_shape(stray.pdu);
  const bool copy = doubt_.is_copy(stray.pdu, clock_->now());
  if (!copy && queries_ == 0) order_ = Order::unknown;
  find(copy ? Evidence::repeated : Evidence::master,
       copy ? "an answer came twice" : "a frame that answers nothing");
}

/// The answer, unless it is the adapter's copy of a request that its answer repeats.
void Session::accept(const modbus::Adu& received, Outstanding& outstanding) {
  const bool copy = is_rtu() && received.pdu == outstanding.request.pdu;
  if (copy && echo_ == LocalEcho::present && outstanding.echoes == 0) {
    decide(Decision::echo, received);
    ++outstanding.echoes;
  } else {
    decide(Decision::answer, received);
    take_as_answer(received, outstanding);
  }
}

void Session::take_as_answer(const modbus::Adu& received, Outstanding& outstanding) {
  outstanding.answer = received.pdu;
  if (has_ids(options_.rules)) return;
  doubt_.remember(outstanding.request.pdu, received.pdu, clock_->now());
}

void Session::keep(const modbus::Pdu& pdu) {
  ++counters_.spontaneous;
  Spontaneous frame{.pdu = pdu, .arrival = clock_->now(), .wall = clock_->wall()};
  if (handle_spontaneous_) return handle_spontaneous_(frame);
  queued_bytes_ += frame.pdu.data.size();
  queue_.push_back(std::move(frame));
  while (queue_.size() > max_queued || queued_bytes_ > max_queued_bytes) {
    queued_bytes_ -= queue_.front().pdu.data.size();
    queue_.pop_front();
    ++counters_.overflowed;
  }
}

/// RTU: returns when the line was silent for the gap. What arrives meanwhile answers nothing.
Result<void> Session::keep_gap() { return is_rtu() ? wait_for_silence({}) : discard_early(); }

/// TCP: what came before a request is sent is not its answer, whatever id it has.
Result<void> Session::discard_early() {
  constexpr int most_reads = 100;  // a flood must not keep the request for ever
  constexpr Duration longest_discarding = std::chrono::milliseconds(1);
  const TimePoint began = clock_->now();
  for (int reads = 0; reads < most_reads && clock_->now() < began + longest_discarding; ++reads) {
    const auto more = fill(began);
    if (!more || !*more) break;  // what is wrong shows when the request is sent
  }
  return sort_buffered(nullptr);
}

/// Waits by receiving, because a frame that is still unread (an answer sent twice) would be taken
/// for the next answer, and because a shielded transport waits on where the clock is interrupted.
Result<void> Session::wait_for_silence(TimePoint not_before) {
  const auto silent = [&] { return std::max(not_before, last_activity_ + options_.gap); };
  const TimePoint limit = std::max(clock_->now(), silent()) + options_.answer_timeout;
  while (true) {
    TRY_LET(auto more, fill(silent()));
    if (!more) break;
    TRY(sort_buffered(nullptr));
    if (clock_->now() > limit) {
      return tl::unexpected(Error{.code = Errc::malformed_answer,
                                  .message = "the line never falls silent",
                                  .hint = "another master, noise or a wrong rate?"});
    }
  }
  if (!is_rtu()) {
    check_step();
    return {};
  }
  note_noise(buffer_);
  buffer_.clear();
  return {};
}

void Session::note_noise(ByteView bytes) {
  if (bytes.empty()) return;
  counters_.noise_bytes += bytes.size();
  decide(Decision::junk, counted(bytes.size(), "byte") + " skipped");
  judge_noise(bytes);
}

/// Without ids a late answer would be taken for the next one. Wait until it can no longer come,
/// then prove the line.
Result<void> Session::leave_quarantine() {
  decide(Decision::resync, "waiting until no late answer can come");
  TRY(wait_for_silence(*quarantined_until_));
  if (options_.proof == SessionOptions::Proof::loopback) {
    auto proved = exchange(modbus::loopback_request(fresh_word()));
    if (!proved) return tl::unexpected(std::move(proved.error()));
  }
  decide(Decision::resync, "the line is in step again");
  quarantined_until_.reset();
  abandoned_.reset();
  return {};
}

void Session::drain_late_answer() {
  if (!abandoned_) return;
  const Lease lease(*this);
  transport_->set_uninterruptible();
  const TimePoint until = clock_->now() + longest_settling;
  while (abandoned_) {
    const auto frame = take_frame();
    if (frame && *frame) {
      const Verdict verdict = judge(&*abandoned_, **frame, options_.rules);
      decide(Decision::stray, **frame);
      if (verdict == Verdict::answer || verdict == Verdict::exception_response) abandoned_.reset();
      continue;
    }
    const auto more = fill(std::min(until, *quarantined_until_));
    if (!more || !*more || clock_->now() >= until) return;
  }
}

std::uint16_t Session::fresh_word() const {
  // Consecutive numbers from a start that two processes hardly share.
  using std::chrono::milliseconds;
  const auto age = std::chrono::floor<milliseconds>(created_.time_since_epoch()).count();
  return static_cast<std::uint16_t>(static_cast<std::uint64_t>(age) + next_transaction_);
}

/// Whether the frame has an id that only our own requests have had.
bool Session::is_late(const modbus::Adu& stray) const {
  return has_ids(options_.rules) && stray.transaction.value >= smallest_transaction;
}

/// Whether what is left may be the beginning of the answer, and not that of another frame.
bool Session::begins_answer(const Outstanding& outstanding) const {
  const Bytes& request = outstanding.bytes;
  if (has_ids(options_.rules)) {  // the id comes first
    const std::size_t known = std::min<std::size_t>(buffer_.size(), 2);
    return known > 0 &&
           std::equal(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(known),
                      buffer_.begin());
  }
  if (buffer_.empty()) return false;
  const bool spontaneous =
      buffer_.size() > 2 &&
      std::any_of(options_.rules.spontaneous.begin(), options_.rules.spontaneous.end(),
                  [&](const SpontaneousShape& shape) {
                    return buffer_[1] == shape.function && buffer_[2] == shape.byte_count;
                  });
  return !spontaneous;
}

Error Session::timeout_error(const Outstanding& outstanding) const {
  const std::string tried = modbus::describe_request(outstanding.request.pdu);
  Error error{.code = Errc::no_answer, .tried = tried, .waited = options_.answer_timeout};
  if (!outstanding.broken.empty()) {
    error.code = Errc::malformed_answer;
    error.message =
        fmt::format("the answer to '{}' does not fit the request ({})", tried, outstanding.broken);
    return error;
  }
  if (outstanding.other_unit) {
    error.code = Errc::malformed_answer;
    error.message =
        fmt::format("unit {} answered '{}', though unit {} was asked",
                    outstanding.other_unit->value, tried, outstanding.request.unit.value);
    error.hint =
        fmt::format("if that is the tool, ask for it with ?unit={}", outstanding.other_unit->value);
    return error;
  }
  const std::uint8_t function = outstanding.request.pdu.function;
  if (auto foreign = foreign_framing(options_.rules.framing, came_, function)) return *foreign;
  if (!begins_answer(outstanding)) {
    if (outstanding.echoes > 0) error.code = Errc::local_echo;
    return with_evidence(std::move(error), outstanding);
  }
  error.code = Errc::incomplete_answer;
  error.message = fmt::format("only part of an answer to '{}' came ({})", tried, describe_buffer());
  if (is_rtu() && buffer_.size() >= whole_answer_size(outstanding.request.pdu, buffer_)) {
    error.code = Errc::bad_checksum;
    error.message =
        fmt::format("no answer to '{}' with a right checksum ({})", tried, describe_buffer());
  }
  return error;
}

/// A device speaks, so nothing is asleep.
Error Session::with_evidence(Error error, const Outstanding& outstanding) const {
  const std::string begin =
      fmt::format("no answer to '{}' within {}", error.tried, to_text(options_.answer_timeout));
  if (outstanding.strangers > 0) {
    error.message = fmt::format(
        "{}, but {} that {} it (the last: {})", begin, counted(outstanding.strangers, "frame"),
        outstanding.strangers == 1 ? "does not answer" : "do not answer", outstanding.stranger);
    error.hint = is_rtu()
                     ? "is another master on the line, or does another unit answer? --verbose "
                       "shows every frame"
                     : "does another unit answer, or one too late? --verbose shows every frame";
    if (outstanding.other_id) {
      error.hint = fmt::format(
          "the answer has transaction id {:04X} instead of {:04X}: for a gateway that does not "
          "repeat ids, give transaction=ignored in the URL",
          outstanding.other_id->value, outstanding.request.transaction.value);
    }
  } else if (outstanding.events > 0) {
    error.message =
        fmt::format("{}, but {} meanwhile", begin, counted(outstanding.events, "event"));
    error.hint = "the tool is awake: try again, or with a longer --timeout";
  }
  return error;
}

/// A serial line has no ids.
std::string Session::describe_address(const modbus::Adu& adu) const {
  const std::string id = is_rtu() ? "" : fmt::format("id {:04X}, ", adu.transaction.value);
  return fmt::format("{}unit {}", id, adu.unit.value);
}

std::string Session::describe_frame(const modbus::Adu& adu) const {
  return fmt::format("{}, function {:02X}, data {}", describe_address(adu), adu.pdu.function,
                     to_hex(veil_.response(adu.pdu).data));
}

std::string Session::describe_buffer() const {
  return veil_.is_drawn() ? counted(buffer_.size(), "byte") : to_hex(buffer_);
}

void Session::show_received(ByteView bytes) {
  const Bytes shown = veil_.received(options_.rules.framing, bytes);
  if (trace_.bytes && !shown.empty()) trace_.bytes(Direction::received, shown);
}

void Session::decide(Decision decision, const modbus::Adu& adu) const {
  if (!trace_.decision) return;
  const bool is_ours = decision == Decision::request || decision == Decision::echo;
  decide(decision, fmt::format("{}: {}", describe_address(adu),
                               is_ours ? modbus::explain_request(veil_.request(adu.pdu))
                                       : modbus::explain_response(veil_.response(adu.pdu))));
}

void Session::decide(Decision decision, std::string_view text) const {
  if (trace_.decision) trace_.decision(decision, text);
}

}  // namespace spindle::link
