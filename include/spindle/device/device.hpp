#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spindle/catalogue/identity.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/catalogue/value.hpp"
#include "spindle/link/client.hpp"
#include "spindle/link/endpoint.hpp"
#include "spindle/link/reopening_transport.hpp"
#include "spindle/link/session.hpp"

namespace spindle::device {

/// Opens the line to an endpoint; `posix` and `sim` bring the implementations.
using OpenTransport = std::function<Result<std::unique_ptr<link::Transport>>(
    const link::Endpoint& endpoint, const catalogue::LinkSpec& facts, Duration connect_timeout)>;

/// How frames are bounded there: by the medium, and by the product where it is simulated.
modbus::Framing framing_of(const link::Endpoint& endpoint, const catalogue::LinkSpec& facts);

/// All that a product sends unasked: the answer to a read of the block, in each of its forms, and
/// longer frames.
std::vector<link::SpontaneousShape> shapes_of(const catalogue::EventSpec& events);
link::SpontaneousShape shape_of(const catalogue::UnaskedFrame& frame);

/// What the user may override of a profile's link facts.
struct LinkOptions {
  std::optional<Duration> answer_timeout = std::nullopt;
  std::optional<Duration> connect_timeout = std::nullopt;
  std::optional<unsigned> retries = std::nullopt;  ///< of reads
  link::Trace trace = {};
  std::string shown = {};  ///< how errors name the tool; empty: by its endpoint's text
  link::SessionOptions::LateAnswers late_answers = link::SessionOptions::LateAnswers::none;
  /// Of a product that is not known: what it may send unasked. Nothing is asked whose answer could
  /// look like that.
  std::vector<link::SpontaneousShape> unasked = {};
  /// TCP only. What the opener refers to must then outlive the device.
  link::Reopening reopening = link::Reopening::never;
};

/// One parameter as read. `registers` and `value` hold the same error when it could not be.
struct Reading {
  catalogue::Parameter parameter;
  Result<Registers> registers;
  Result<catalogue::Value> value;
  /// The tool's own limits, when they were asked for and exist.
  std::optional<catalogue::Value> minimum = std::nullopt;
  std::optional<catalogue::Value> maximum = std::nullopt;
  std::optional<Error> limits_error = std::nullopt;
  /// What cannot be shown as a value of the encoding; see catalogue::decode_or_raw().
  std::optional<catalogue::Value> raw = std::nullopt;

  /// The value, or what can be written over and put back all the same.
  [[nodiscard]] Result<catalogue::Value> held() const {
    return raw ? Result<catalogue::Value>(*raw) : value;
  }
};

enum class Limits : std::uint8_t { skip, read };

/// How a write ended, as proven by reading back.
enum class WriteResult : std::uint8_t {
  written,   ///< the tool holds the new value, whatever it answered
  coerced,   ///< the tool holds a third value
  mismatch,  ///< the tool did not refuse, but still holds the old value
  refused,   ///< the tool refused, and holds the old value
  unknown,   ///< it could not be read back: the tool holds the old value, the new one or a third
};

/// As in records.
inline constexpr auto write_result_words =
    enum_table<WriteResult>({{"written", WriteResult::written},
                             {"coerced", WriteResult::coerced},
                             {"mismatch", WriteResult::mismatch},
                             {"refused", WriteResult::refused},
                             {"unknown", WriteResult::unknown}});
constexpr std::string_view to_text(WriteResult result) { return write_result_words.text(result); }

/// Whether the tool says by its exception that it did nothing. Acknowledge (05), busy (06) and what
/// a gateway says (0A, 0B) leave open what became of a request.
bool is_refusal(const Error& error);

/// Whether the write may still act after its last reading: it was sent, and neither was it seen to
/// act nor was it refused.
enum class Doubt : std::uint8_t { none, may_act_late };

struct Written {
  WriteResult result;
  std::optional<catalogue::Value> now;        ///< as last read; empty: not known
  std::optional<Error> error = std::nullopt;  ///< why it is not `written`
  Doubt doubt = Doubt::none;

  [[nodiscard]] bool done() const { return result == WriteResult::written; }
  /// Whether the tool may hold something else than before, now or in a moment.
  [[nodiscard]] bool may_have_changed() const {
    return result != WriteResult::refused || doubt == Doubt::may_act_late;
  }
};

/// When a reading proves a write.
enum class Proof : std::uint8_t {
  first_right,     ///< as soon as the value reads right: nothing else was sent before
  after_settling,  ///< not before the settling time is over: an earlier write may still act
};

/// What a reading says of an expectation.
enum class Shown : std::uint8_t { no, yes };

/// How an action ended.
enum class ActionResult : std::uint8_t {
  confirmed,      ///< a reading proves the effect
  sent,           ///< acknowledged; nothing that can be read proves the effect
  finished,       ///< acknowledged, and the tool says that it no longer works on it
  not_confirmed,  ///< acknowledged, but the reading does not show the effect in time
};
/// As in records.
inline constexpr auto action_result_words =
    enum_table<ActionResult>({{"confirmed", ActionResult::confirmed},
                              {"sent", ActionResult::sent},
                              {"finished", ActionResult::finished},
                              {"not-confirmed", ActionResult::not_confirmed}});
constexpr std::string_view to_text(ActionResult result) { return action_result_words.text(result); }

/// What came back for a loop-back that any unit may answer.
enum class Answered : std::uint8_t { data, exception };

struct Probe {
  Answered answered;
  Duration round_trip;
  std::optional<std::uint8_t> exception = std::nullopt;  ///< its code
};

enum class EventOutput : std::uint8_t { on, off };

/// One tool behind one connection: reads, writes and acts by catalogue entries.
class Device {
 public:
  /// Connects. `profile` must outlive the device. Errors name the tool and its endpoint, here
  /// and in every other function.
  static Result<Device> open(const link::Endpoint& endpoint, const catalogue::Profile& profile,
                             const LinkOptions& options, const OpenTransport& open_transport,
                             Clock& clock);
  /// On a serial line: leaves nothing behind that the next one would take for its answer.
  ~Device();
  Device(Device&&) noexcept = default;
  Device& operator=(Device&&) noexcept = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] const catalogue::Profile& profile() const { return *profile_; }
  [[nodiscard]] link::Session& session() { return *session_; }

  /// The bytes of FC 11h. An exception response is an error like any other.
  Result<Bytes> report_server_id();

  /// Goes on with a profile that was found by the answer to FC 11h, and what that says.
  void use(const catalogue::Profile& profile, catalogue::Identity identity);

  /// What the tool said of itself when its registers were last checked; empty before, and for a
  /// product without an identity.
  [[nodiscard]] const std::optional<catalogue::Identity>& identity() const { return identity_; }

  /// Ends the connection; everything that needs it fails with `closed` from now on. A tool that
  /// serves one client at a time must be let go before it is opened anew.
  void disconnect();

  /// How often a read without an answer is repeated from now on.
  void set_retries(unsigned retries);

  /// Whether the registers are those of the profile. Asks FC 11h where the profile has an identity,
  /// and refuses with `wrong_generation` a tool whose firmware is earlier, later, or unknown (also
  /// when FC 11h is refused), and with `mismatch` another product: on such a tool only raw
  /// registers may be read.
  Result<void> require_known_registers();

  /// Reads what else the tool says of itself, where the profile says in which registers, into
  /// identity(). What it refuses stays empty. Requires registers that are known.
  Result<void> ask_more();

  /// What the tool said of itself when its registers were last checked: "serial 1021100042,
  /// firmware 2103"; empty before.
  [[nodiscard]] const std::string& identity_text() const { return identity_text_; }

  /// Reads all in the fewest requests, and the limits of what exists. A refused register stands in
  /// its reading; anything else ends it, and first of all one that reading clears (`usage`).
  Result<std::vector<Reading>> read_each(const std::vector<catalogue::Parameter>& parameters,
                                         Limits limits, const link::Progress& progress = {});

  /// One request for registers of which nothing need be known. Error `usage` where reading clears
  /// one of them.
  Result<Registers> read_block(const link::RegisterRange& range);

  /// What the server allows of reads.
  [[nodiscard]] const link::ReadLimits& limits() const { return limits_; }

  /// Writes and reads back, again and again with growing pauses until the value reads right or its
  /// settling time is over. A busy tool (exception 06) is asked again for one answer time; a write
  /// that was acknowledged (05) is never repeated; one without an answer is repeated once, and only
  /// after reading back has shown that it did not take. Of a register of which only some bits are
  /// the value's the others are kept as they are read just before. What the profile says has to be
  /// unlocked first is, and is put back. Does not check ranges. `before` is the value read before.
  Written write(const catalogue::Parameter& parameter, const catalogue::Value& before,
                const catalogue::Value& value, Proof proof = Proof::first_right);

  /// Goes on with a clock and a line that interrupts do not end. The clock must outlive the device.
  void shield(Clock& calm);

  /// Sends an action's value once, never again; acknowledged is all that it means.
  Result<void> send(const catalogue::Action& action, std::int64_t value);

  /// Sends a number to all registers of a parameter, once: as a whole where the tool takes that.
  /// Does not read back; acknowledged is all that it means.
  Result<void> send(const catalogue::Parameter& parameter, const Decimal& number);

  /// Sends an action's stop value. Requires an action that has one.
  Result<void> send_stop(const catalogue::Action& action) {
    return send(action, *action.stop_value);
  }

  /// Whether a parameter reads as this number now.
  Result<Shown> shows(const std::string& parameter, std::int64_t number);

  /// Sends the action once, never again, and waits for its confirming parameter. Prepares it,
  /// makes an edge of it and waits until the tool has worked on it, as the action says. What needs
  /// a preparation is not sent when its effect is there already. Not for motions.
  Result<ActionResult> perform(const catalogue::Action& action, std::int64_t value);

  /// To one register, once, without reading back or waiting for a busy tool.
  Result<void> write_word(modbus::RegisterAddress address, std::uint16_t word);

  /// To everybody on a serial line: sent is all that is known.
  Result<void> broadcast(const catalogue::Parameter& parameter, const catalogue::Value& value);
  Result<void> broadcast(const catalogue::Action& action, std::int64_t value);
  Result<void> broadcast_word(modbus::RegisterAddress address, std::uint16_t word);

  /// Switches the tool's unasked event frames on or off; on expires unless it is repeated. Does
  /// nothing where the profile says of no way to do so. Requires a profile with events.
  Result<void> switch_events(EventOutput output);

  /// The counter of events, read alone. Requires a profile whose events are counted.
  Result<std::uint16_t> event_number();

  /// The whole last event, as it was while its number stood; read anew when an event came in
  /// between. Empty when events come faster than that. Never in one read whose answer would look
  /// like an event frame. Requires a profile whose events are counted.
  Result<std::optional<Registers>> last_event();

  /// The registers of the event block as they are now, in the longest form that a tool with this
  /// firmware has, or in the usual one where that is refused. Requires a profile with events.
  Result<Registers> event_block();

  /// Whether the flag of events is set. Reading clears it, so it is asked once and never again:
  /// where the answer is lost, it may have been set. Requires a profile whose events have a flag.
  /// Error `usage` on a serial line, where an answer may be proved by another reading.
  Result<Shown> take_event_flag();

  /// One exchange that touches no value: FC 08 where the profile has it, else FC 11h. An exception
  /// response counts as an answer.
  Result<Duration> ping();

  /// Whether the unit is there, which an open serial port does not say: FC 08, again where no
  /// answer comes. An exception response counts as an answer.
  Result<void> require_answer();

  /// FC 08 to this unit of a serial line, once; all later requests go to it too. An exception
  /// response counts as an answer.
  Result<Probe> probe(modbus::UnitId unit);

 private:
  Device(const link::Endpoint& endpoint, const catalogue::Profile& profile,
         const LinkOptions& options, std::unique_ptr<link::Session> session);

  Result<Registers> read_raw(const link::RegisterRange& range);
  Error located(Error error) const;
  Error with_exception_text(Error error) const;
  Error with_device_code(Error error) const;
  [[nodiscard]] Result<catalogue::Parameter> meant_by(const catalogue::Parameter& parameter,
                                                      const link::RegisterImage& image) const;
  Reading reading_of(const catalogue::Parameter& parameter, Limits limits,
                     const link::RegisterImage& values,
                     const link::RegisterImage& limit_values) const;
  std::vector<link::RegisterRange> limit_ranges(const std::vector<catalogue::Parameter>& parameters,
                                                const link::RegisterImage* values);
  Result<void> send_write(const catalogue::Parameter& parameter, const Registers& registers);
  [[nodiscard]] Error misfit(catalogue::Judgement judgement,
                             const catalogue::Identity& identity) const;
  Result<Registers> event_registers(std::uint16_t count);
  Result<void> write_registers(modbus::RegisterTable table, modbus::RegisterAddress first,
                               const Registers& registers);
  Result<Registers> registers_for(const catalogue::Parameter& parameter,
                                  const catalogue::Value& value);
  /// A register that was written to so that others can be.
  struct Lock {
    catalogue::Parameter parameter;
    catalogue::Value before;
  };
  Result<std::optional<Lock>> unlock_for(const catalogue::Parameter& parameter);
  Result<void> lock_again(const Lock& lock);
  [[nodiscard]] std::string not_put_back(std::string_view what, const Error& why) const;
  Result<void> broadcast_registers(modbus::RegisterTable table, modbus::RegisterAddress first,
                                   const Registers& registers);
  Written write_unlocked(const catalogue::Parameter& parameter, const catalogue::Value& before,
                         const catalogue::Value& value, Proof proof);
  Result<void> send_while_busy(const catalogue::Parameter& parameter, const catalogue::Value& value,
                               Registers registers);
  Written refused(Error error, const catalogue::Parameter& parameter,
                  const catalogue::Value& before, const catalogue::Value& value);
  Written judged(const catalogue::Parameter& parameter, const catalogue::Value& before,
                 const catalogue::Value& value, const Result<void>& sent,
                 const Result<catalogue::Value>& now) const;
  Result<catalogue::Value> settled(const catalogue::Parameter& parameter,
                                   const catalogue::Value& expected, Duration limit, Proof proof);
  [[nodiscard]] Clock& clock() const { return calm_ != nullptr ? *calm_ : session_->clock(); }
  Result<void> while_busy(const std::function<Result<void>()>& write);
  Result<void> prepare(const catalogue::Preparation& preparation);
  [[nodiscard]] std::uint16_t bits_to_clear(const catalogue::Preparation& preparation);
  Result<Shown> await_ready(Duration limit);
  Result<ActionResult> carry_out(const catalogue::Action& action, std::int64_t value);
  Result<ActionResult> found_done(const catalogue::Action& action,
                                  const catalogue::Parameter& confirming,
                                  const catalogue::Value& expected, Error error);
  Result<ActionResult> confirm(const catalogue::Action& action,
                               const catalogue::Parameter& confirming,
                               const catalogue::Value& expected);
  [[nodiscard]] std::vector<catalogue::Parameter> deciders_of(
      const catalogue::Parameter& parameter) const;
  Error about(Error error, const std::string& name, modbus::RegisterAddress address) const;
  Result<catalogue::Value> read_value(const catalogue::Parameter& parameter);

  std::string target_;
  std::string endpoint_;  ///< empty: the target says it
  link::Endpoint at_;
  const catalogue::Profile* profile_;
  std::unique_ptr<link::Session> session_;
  unsigned retries_;
  link::ReadLimits limits_;
  link::Client client_;
  Clock* calm_ = nullptr;  ///< empty: the session's
  bool registers_known_ = false;
  bool has_usual_events_ = false;  ///< it refused the longer form of its event block
  std::string identity_text_ = {};
  std::optional<catalogue::Identity> identity_ = std::nullopt;
};

}  // namespace spindle::device
