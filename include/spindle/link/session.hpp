#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spindle/link/demux.hpp"
#include "spindle/link/line_doubt.hpp"
#include "spindle/link/local_echo.hpp"
#include "spindle/link/trace.hpp"
#include "spindle/link/transport.hpp"
#include "spindle/link/veil.hpp"

namespace spindle::link {

struct SessionOptions {
  DemuxRules rules = {};
  modbus::UnitId unit = {};
  Duration answer_timeout = std::chrono::seconds(1);
  /// RTU: silence kept before each request, from the last byte in either direction. What is
  /// received meanwhile is sorted like any frame that was not asked for.
  Duration gap = Duration::zero();
  /// RTU: silence after a broadcast before the next request; the gap is part of it.
  Duration broadcast_gap = Duration::zero();
  /// RTU: time that one character needs on the line; a lower bound where the port cannot tell when
  /// sending ended.
  Duration character_time = Duration::zero();
  /// RTU: whether the line is proved with FC 08 after a quarantine.
  enum class Proof : std::uint8_t { none, loopback } proof = Proof::none;
  /// RTU: whether the request itself comes back first. Where that is not known, a read of one
  /// register goes before the first FC 08, because its own answer and echo look the same.
  LocalEcho echo = LocalEcho::automatic;
  /// RTU: until when others may have used the line; the first gap counts from then.
  TimePoint in_use_until = {};
  /// Without ids: whether a late answer may come that an earlier session did not wait for, or
  /// other clients use the line that cannot be seen.
  enum class LateAnswers : std::uint8_t { none, possible, shared };
  LateAnswers late_answers = LateAnswers::none;
  /// RTU: whether other programs, other masters or a gateway may be on the line. Then it is
  /// listened to before the first read and behind the first answers.
  enum class Others : std::uint8_t { none, possible } others = Others::none;
  /// TCP: id of the first request, at least 8000h; tools use small ones for what they send unasked.
  std::uint16_t first_transaction = 0x8000;
};

/// Another read whose answer holds the registers of a read, too, in an answer of another shape.
struct OtherRead {
  modbus::Pdu request;
  std::size_t skip = 0;  ///< registers in front of those
};

/// A frame that was not asked for, with the time when its last byte arrived.
struct Spontaneous {
  modbus::Pdu pdu;
  TimePoint arrival;
  WallTime wall;
};

struct SessionCounters {
  std::uint64_t requests = 0;
  std::uint64_t strays = 0;  ///< late answers included
  std::uint64_t spontaneous = 0;
  std::uint64_t overflowed = 0;   ///< spontaneous frames dropped because they were not taken
  std::uint64_t noise_bytes = 0;  ///< skipped before RTU frames
};

/// The dialogue on one connection: one outstanding request, everything else sorted by judge(). What
/// arrives while the caller waits for something else is kept, not dropped and not mistaken; a late
/// answer never becomes the next value.
///
/// RTU: a frame that nothing asked for, the request of another master, junk beside an answer, the
/// same answer to another request, or another program that has the port open make the line doubtful
/// until it was quiet for a while. On a doubtful line each answer is proved: by another read that
/// holds the same registers, by FC 08 behind it, or by the same read again. What cannot be proved
/// is `no_answer`. That others are on the line is told once, by the trace's `notice`.
///
/// TCP where transaction ids are ignored: what is said of late and proved answers on RTU holds
/// here, too, and doubt behind a timeout lasts longer. After part of a frame only a new connection
/// helps.
class Session {
 public:
  Session(std::unique_ptr<Transport> transport, Clock& clock, SessionOptions options,
          Trace trace = {});
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Sends the request and waits for its answer. An exception response is returned as a PDU, not as
  /// an error. Errors: those of Transport; `no_answer`; `incomplete_answer` (part of a frame);
  /// `malformed_answer` (a frame with our id that is no answer, or a stream without frame
  /// boundaries); `bad_checksum` and `local_echo` (RTU). All within the answer timeout, counted
  /// from the end of sending.
  ///
  /// RTU: after a failure the line is in quarantine. A read then waits until no late answer can
  /// come any more and the line is proved; only FC 06 and FC 08, whose answers repeat them, go out
  /// at once. Unit 0 is `usage`: broadcast() is for that.
  ///
  /// `others` are what may be asked to prove the answer to a read on a doubtful line.
  Result<modbus::Pdu> transact(const modbus::Pdu& request,
                               const std::vector<OtherRead>& others = {});

  /// RTU: what was known of the line at some time.
  struct Mark {
    std::uint64_t requests = 0;
    std::uint64_t unproved = 0;  ///< answers that were believed as they came
    bool proves = false;         ///< each answer is proved from then on
  };
  [[nodiscard]] Mark mark() const;
  /// RTU: whether all answers since `mark` can be believed. On a new line it waits as long as an
  /// answer takes, because behind the answer to another master's request comes that to ours.
  Result<bool> is_undisturbed_since(const Mark& mark);
  /// TCP: whether the stream has lost its frame boundaries, so that only a new connection helps.
  [[nodiscard]] bool is_out_of_step() const { return out_of_step_.has_value(); }

  /// RTU: sends to unit 0, and keeps the pause behind it. No unit answers, so success means "sent",
  /// never "done".
  Result<void> broadcast(const modbus::Pdu& request);

  /// The oldest spontaneous frame, waiting for one until the deadline; empty at the deadline.
  Result<std::optional<Spontaneous>> next_spontaneous(TimePoint deadline);

  /// From now on spontaneous frames are told as they come, also while an answer is awaited, instead
  /// of being kept; an empty function ends that. What was kept before stays. `handle` must not use
  /// the session.
  void on_spontaneous(std::function<void(const Spontaneous&)> handle) {
    handle_spontaneous_ = std::move(handle);
  }

  /// For traces: the request is about to be sent once more.
  void tell_retry(const modbus::Pdu& request) const;

  /// RTU: before the line is left to others, waits for the answer to a request that was abandoned,
  /// though not for long: they would take it for theirs. Interrupts do not end this wait.
  void drain_late_answer();

  /// After this, interrupts no longer end waits on this connection.
  void set_uninterruptible() { transport_->set_uninterruptible(); }

  /// From now on its requests go before those of others on the same line.
  void set_urgent() { transport_->set_urgent(); }

  /// Whether another program has the line and is asked for everything.
  [[nodiscard]] bool asks_owner() const { return asked_as_.has_value(); }

  /// RTU: from now on answers are believed without a proof behind them, also after trouble: a stop
  /// and its confirmation must not wait for more answers than they need.
  void skip_verification() {
    proves_ = Proves::never;
    transport_->skip_verification();
  }

  void set_answer_timeout(Duration timeout) { options_.answer_timeout = timeout; }
  /// Whom the requests from now on are for.
  void set_unit(modbus::UnitId unit);
  /// For FC 08: another word for every request, and hardly that of an earlier process.
  [[nodiscard]] std::uint16_t fresh_word() const;
  /// For a profile that is only known after the first answer.
  void set_rules(DemuxRules rules);
  /// These registers are secret: no trace and no message says what they hold.
  void hide(std::vector<RegisterRange> secrets) { veil_.hide(std::move(secrets)); }
  [[nodiscard]] const SessionOptions& options() const { return options_; }
  [[nodiscard]] const SessionCounters& counters() const { return counters_; }
  [[nodiscard]] Clock& clock() const { return *clock_; }
  /// Time between sending the last request and having its answer.
  [[nodiscard]] Duration last_round_trip() const { return last_round_trip_; }

 private:
  struct Outstanding;
  class Lease;

  using Others = std::vector<OtherRead>;

  Result<modbus::Pdu> ask(const modbus::Pdu& request, const Others& others);
  Result<modbus::Pdu> ask_behind_late(const modbus::Pdu& request);
  Result<modbus::Pdu> ask_carefully(const modbus::Pdu& request, const Others& others);
  Result<void> let_copies_pass(const modbus::Pdu& write);
  Result<std::optional<modbus::Pdu>> prove(const modbus::Pdu& request, const modbus::Pdu& answer,
                                           const Others& others);
  Result<std::optional<modbus::Pdu>> prove_by_others(const modbus::Pdu& request,
                                                     const modbus::Pdu& answer,
                                                     std::vector<OtherRead> reads);
  Result<std::optional<modbus::Pdu>> prove_by_repeating(const modbus::Pdu& request,
                                                        const modbus::Pdu& answer);
  Result<std::optional<modbus::Pdu>> prove_by_loopback(const modbus::Pdu& answer);
  [[nodiscard]] std::size_t late_ones_like(const modbus::Pdu& answer) const;
  [[nodiscard]] bool may_be_late_to_like(const modbus::Pdu& request) const;
  void remember_unanswered(const modbus::Adu& request);
  Result<modbus::Pdu> exchange_contested(const modbus::Pdu& request, const modbus::Pdu& accepted);
  void note_refutation(const modbus::Adu& stray);
  [[nodiscard]] std::vector<OtherRead> with_own_shapes(const Others& others) const;
  [[nodiscard]] bool answers_come_in_order() const;
  [[nodiscard]] bool has_loopback() const {
    return options_.proof == SessionOptions::Proof::loopback;
  }
  Result<void> listen_first();
  Result<void> discard_early();
  void find(Evidence evidence, std::string_view what);
  void judge_noise(ByteView bytes);
  void doubt_because_of(const modbus::Adu& stray);
  [[nodiscard]] bool may_be_late() const;
  [[nodiscard]] bool expects_others() const {
    return options_.others == SessionOptions::Others::possible && !transport_->is_private();
  }
  [[nodiscard]] Duration time_to_listen() const;
  bool take_late(const modbus::Adu& stray);
  void require_verification(TimePoint since);
  Result<modbus::Pdu> exchange(const modbus::Pdu& request);
  Result<modbus::Pdu> send_and_await(Outstanding& outstanding);
  Result<void> send(const modbus::Adu& adu, ByteView bytes);
  Result<modbus::Pdu> await(Outstanding& outstanding);
  Result<bool> fill(TimePoint deadline);
  Result<std::optional<modbus::Adu>> take_frame(const Outstanding* outstanding = nullptr);
  bool leave_torn(const Outstanding* outstanding);
  void strip_echo(Outstanding& outstanding);
  void accept(const modbus::Adu& received, Outstanding& outstanding);
  void learn_echo(const Outstanding& outstanding);
  Result<void> find_echo(const modbus::Pdu& request);
  Result<void> sort_buffered(Outstanding* outstanding);
  void sort(const modbus::Adu& received, Outstanding* outstanding);
  void take_as_answer(const modbus::Adu& received, Outstanding& outstanding);
  [[nodiscard]] bool answers_with_other_id(const modbus::Adu& received,
                                           const modbus::Adu& request) const;
  [[nodiscard]] bool was_given(modbus::TransactionId id) const;
  void check_step();
  [[nodiscard]] Transport::Stream stream() const;
  void go_on_with(Transport::Stream stream);
  [[nodiscard]] Transport::Dialogue dialogue() const;
  void go_on_with(const Transport::Dialogue& dialogue);
  void hear_what_others_heard(Bytes frames);
  void pass_on(const modbus::Adu& received) const;
  bool take_late_with_id(const modbus::Adu& received);
  void keep(const modbus::Pdu& pdu);
  Result<void> keep_gap();
  Result<void> wait_for_silence(TimePoint not_before);
  Result<void> leave_quarantine();
  [[nodiscard]] bool is_rtu() const { return options_.rules.framing == modbus::Framing::rtu; }
  [[nodiscard]] bool is_late(const modbus::Adu& stray) const;
  [[nodiscard]] bool begins_answer(const Outstanding& outstanding) const;
  Error timeout_error(const Outstanding& outstanding) const;
  void note_noise(ByteView bytes);
  Error with_evidence(Error error, const Outstanding& outstanding) const;
  void decide(Decision decision, const modbus::Adu& adu) const;
  void decide(Decision decision, std::string_view text) const;
  [[nodiscard]] std::string describe_address(const modbus::Adu& adu) const;
  [[nodiscard]] std::string describe_frame(const modbus::Adu& adu) const;
  [[nodiscard]] std::string describe_buffer() const;
  void show_received(ByteView bytes);

  std::unique_ptr<Transport> transport_;
  Clock* clock_;
  /// How the owner of the line is to ask for us; empty: the line is ours.
  std::optional<SessionOptions> asked_as_ = std::nullopt;
  SessionOptions options_;
  Trace trace_;
  Veil veil_ = {};
  SessionCounters counters_ = {};
  Bytes buffer_ = {};
  Bytes came_ = {};  ///< since the last request, the beginning of it as it came
  std::deque<Spontaneous> queue_ = {};
  std::size_t queued_bytes_ = 0;
  std::function<void(const Spontaneous&)> handle_spontaneous_ = {};
  std::uint16_t first_transaction_;  ///< of this connection
  std::uint16_t next_transaction_;
  TimePoint created_;
  TimePoint last_activity_;
  /// RTU: when no answer to an abandoned request can come any more.
  std::optional<TimePoint> quarantined_until_ = std::nullopt;
  /// RTU: until when answers are only believed when a loop-back behind them is answered next.
  TimePoint doubtful_until_ = {};
  enum class Proves : std::uint8_t { in_doubt, never } proves_ = Proves::in_doubt;
  /// RTU: the last request whose answer may still come and be mistaken.
  std::optional<modbus::Adu> abandoned_ = std::nullopt;
  /// Without ids: what was asked without an answer, as long as it may come late.
  std::vector<Transport::Unanswered> unanswered_ = {};
  Bytes sent_ = {};  ///< the last request as it was sent
  /// RTU: until when a late answer to another session of this program may come.
  TimePoint others_late_until_ = {};
  TimePoint past_until_ = {};  ///< RTU: the same to an earlier session for this unit
  LineDoubt doubt_ = {};
  std::uint64_t unproved_ = 0;  ///< answers that were believed as they came
  std::uint64_t doubted_ = 0;   ///< how many of them were when something unexpected came last
  std::uint64_t noises_ = 0;    ///< how often unexpected bytes came
  std::uint64_t queries_ = 0;   ///< of other masters that were heard
  /// RTU: whether all answers of the line come here. On a bus the request of another master is
  /// heard in front of its answer; where it is not, others may read the same port.
  enum class Order : std::uint8_t { kept, unknown } order_ = Order::kept;
  std::vector<modbus::Pdu> contested_ = {};  ///< requests whose other answers would refute
  modbus::Pdu accepted_ = {};                ///< what would be refuted
  std::uint64_t refutations_ = 0;
  enum class Heard : std::uint8_t { nothing, line } heard_ = Heard::nothing;
  bool has_turn_ = false;  ///< of a line that others have, too
  bool had_turn_ = false;
  Duration longest_round_trip_ = {};
  std::optional<Error> out_of_step_ = std::nullopt;  ///< TCP: why nothing can be asked any more
  std::size_t torn_ = 0;  ///< TCP: bytes of a frame whose rest did not come in time
  LocalEcho echo_;        ///< as far as it is known
  Duration last_round_trip_ = {};
};

}  // namespace spindle::link
