#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"
#include "spindle/catalogue/discovery.hpp"
#include "spindle/catalogue/identity.hpp"
#include "spindle/catalogue/learning.hpp"
#include "spindle/catalogue/parameter.hpp"
#include "spindle/catalogue/run_facts.hpp"
#include "spindle/modbus/adu.hpp"
#include "spindle/modbus/serial_settings.hpp"

namespace spindle::catalogue {

/// Registers from `from` to `to`, inclusive, of one table.
struct Area {
  modbus::RegisterTable table = modbus::RegisterTable::holding;
  std::uint16_t from = 0;
  std::uint16_t to = 0;
  Text note = {};
};

/// Silence that a serial server needs before a frame at rates up to `up_to_baud` (0: any rate above
/// the others).
struct GapRule {
  unsigned up_to_baud = 0;
  Duration gap = {};
};

struct SerialSpec {
  modbus::SerialSettings line = {};
  List<GapRule> gaps = {};
  Duration broadcast_pause = {};  ///< on top of the gap

  /// The silence that the product needs at this rate; empty: the profile has no rule for it.
  [[nodiscard]] std::optional<Duration> gap_at(unsigned baud) const;
};

/// Unit identifiers, both inclusive.
struct UnitRange {
  std::uint8_t first = 1;
  std::uint8_t last = 1;
  [[nodiscard]] bool contains(modbus::UnitId unit) const {
    return unit.value >= first && unit.value <= last;
  }
};

/// Frames that may come although nothing asked for them: they look like the answer to a read of so
/// many registers by this function.
struct UnaskedFrame {
  std::uint8_t function = 0;  ///< 3 or 4
  std::uint16_t count = 0;
};

/// How to talk to this product. Values come from the profile, each with its evidence there.
struct LinkSpec {
  modbus::Framing framing = modbus::Framing::tcp;
  std::uint16_t port = 502;
  std::uint8_t unit = 0;
  modbus::TransactionIds transactions = modbus::TransactionIds::echoed;
  /// Those that the product can have; another one is asked all the same. Empty: not known.
  std::optional<UnitRange> units = std::nullopt;
  std::uint16_t max_read = 125;
  std::uint16_t max_write = 1;                          ///< registers per write; 1: only FC 06
  std::uint16_t max_read_bits = modbus::max_read_bits;  ///< coils and discrete inputs per read
  /// The one function that writes holding registers; empty: 06 for one, 10h for more.
  std::optional<std::uint8_t> write_function = std::nullopt;
  /// So many registers that were not asked for may be read along.
  std::uint16_t max_gap = 0;
  /// Exception codes of a server that only has to be waited for, and for how long.
  List<std::uint8_t> busy = {};
  Duration busy_every = std::chrono::milliseconds(100);
  Duration busy_limit = std::chrono::seconds(2);
  Duration keep_alive = {};  ///< zero: none needed
  Duration answer = std::chrono::seconds(1);
  Duration connect = std::chrono::seconds(5);
  unsigned retries = 1;  ///< repetitions of a read that got no answer
  /// How long a written value may take until it reads back, unless its parameter says otherwise.
  Duration settle = std::chrono::milliseconds(500);
  bool loopback = false;  ///< FC 08 00 is answered
  bool any_unit = false;  ///< TCP: answers may carry another unit identifier than was asked
  /// Of values that do not say it themselves.
  WordOrder word_order = WordOrder::big;
  ByteOrder byte_order = ByteOrder::big;
  bool even_pairs = false;  ///< 32-bit values begin at an even address and are never split
  SerialSpec serial = {};
  List<Area> contiguous = {};  ///< registers may be read along here
  List<Area> absent = {};      ///< registers said not to exist
  /// Beside those of `events`. Such a read is never sent.
  List<UnaskedFrame> unasked = {};
};

/// Whether a value of this encoding can be written. Error `usage`: values of several registers are
/// never split (`even_pairs`), and a request takes only one register (`max_write`).
Result<void> check_pair(const Encoding& encoding, const LinkSpec& link);

/// What an event says, as the contract names it.
enum class EventKind : std::uint8_t {
  fastening_ok,
  fastening_ng,
  direction_change,
  preset_change,
  alarm_reset,
  error,
  barcode,
  screw_count,
  other,
};

/// As written in profiles and records.
inline constexpr auto event_kind_words =
    enum_table<EventKind>({{"fastening-ok", EventKind::fastening_ok},
                           {"fastening-ng", EventKind::fastening_ng},
                           {"direction-change", EventKind::direction_change},
                           {"preset-change", EventKind::preset_change},
                           {"alarm-reset", EventKind::alarm_reset},
                           {"error", EventKind::error},
                           {"barcode", EventKind::barcode},
                           {"screw-count", EventKind::screw_count},
                           {"other", EventKind::other}});
constexpr std::string_view to_text(EventKind kind) { return event_kind_words.text(kind); }

/// How a tool lets it be known that something happened.
enum class EventModel : std::uint8_t {
  push,     ///< it sends frames unasked; a counter tells of those that were not seen
  counter,  ///< a register counts up; it sends nothing unasked
  flag,     ///< a register says that there is a new result, and reading clears it
};

/// How unasked frames are switched on. They stay on for `expires`; zero: until switched off.
struct Arming {
  std::uint16_t address = 0;  ///< holding register
  std::uint16_t value = 1;
  std::uint16_t disarm = 0;
  Duration every = {};
  Duration expires = {};
};

/// A column of a table or of CSV: what one parameter of the event block says.
struct EventColumn {
  Text heading;
  Text parameter;
  std::uint16_t width = 0;  ///< cells that a table keeps free for it
};

/// What a frame holds that a tool sends unasked.
enum class FrameContent : std::uint8_t {
  event,              ///< the event block
  event_with_curves,  ///< the event block, and behind it the samples of every channel that it
                      ///< counts
  curve,              ///< the number of a channel, how many samples, and these
};
inline constexpr auto frame_content_words =
    enum_table<FrameContent>({{"event", FrameContent::event},
                              {"event-with-curves", FrameContent::event_with_curves},
                              {"curve", FrameContent::curve}});

/// A function of frames that are sent unasked, whose data begin with their own length in two bytes.
struct EventFrame {
  std::uint8_t function = 0;
  FrameContent holds = FrameContent::event;
};

/// One channel of a result's curves, by parameters of the event block.
struct CurveChannel {
  Text type;   ///< what is measured; its labels name it
  Text count;  ///< how many samples there are
};

/// What a channel measures.
enum class CurveQuantity : std::uint8_t { none, torque, angle, torque_over_angle, other };
inline constexpr auto curve_quantity_words =
    enum_table<CurveQuantity>({{"none", CurveQuantity::none},
                               {"torque", CurveQuantity::torque},
                               {"angle", CurveQuantity::angle},
                               {"torque-over-angle", CurveQuantity::torque_over_angle},
                               {"other", CurveQuantity::other}});

/// One type of channel by its number.
struct CurveType {
  std::uint16_t number = 0;
  CurveQuantity is = CurveQuantity::other;
  Text unit = {};  ///< "torque": that of the event; may be empty
};

/// The course of a result: binary32 numbers, the high word first, of up to so many channels.
struct CurveSpec {
  List<CurveChannel> channels = {};  ///< the first one is channel 1
  List<CurveType> types = {};
  Text sampling = {};            ///< parameter of the event block: milliseconds between two samples
  std::uint16_t most = 0;        ///< samples of a channel
  std::uint16_t steps = 0;       ///< pairs of a step's type and the sample where it begins
  std::uint16_t first_step = 0;  ///< register of the event block, from 0
  List<Label> step_types = {};   ///< 0: no step
};

/// What of a preset decides whether a result is good.
enum class SettingKind : std::uint8_t {
  target_torque,
  torque_limit,  ///< how far the torque may be off its target
  mode,
  target_angle,
  min_angle,
  max_angle,
};
inline constexpr auto setting_kind_words =
    enum_table<SettingKind>({{"target-torque", SettingKind::target_torque},
                             {"torque-limit", SettingKind::torque_limit},
                             {"mode", SettingKind::mode},
                             {"target-angle", SettingKind::target_angle},
                             {"min-angle", SettingKind::min_angle},
                             {"max-angle", SettingKind::max_angle}});
constexpr std::string_view to_text(SettingKind kind) { return setting_kind_words.text(kind); }

/// Where such a setting stands in the tool.
struct EventSetting {
  SettingKind is = SettingKind::target_torque;
  Text parameter;  ///< with {n} in place of the preset's number
};

/// A longer form of the event block, which some tools of a product have. What stands behind the
/// usual registers is known by the length alone.
struct EventForm {
  std::uint16_t count = 0;     ///< registers in all
  Text parameters;             ///< pattern of the names of what stands there; read by no other way
  unsigned firmware_from = 0;  ///< such a tool is asked for all of them; 0: it is only understood
};

/// Results and what else happens: how it is learned of, and the registers that tell of it.
struct EventSpec {
  EventModel model = EventModel::push;
  std::optional<Arming> arm = std::nullopt;  ///< of `push`; empty: frames come without
  std::uint8_t function = 0;                 ///< 3 or 4
  /// First register of the block; empty: it is not known, so that the block is only ever pushed,
  /// and `fields` say what is in it.
  std::optional<std::uint16_t> first = std::nullopt;
  std::uint16_t count = 0;  ///< registers in the block; a frame has 2 × count data bytes
  /// Parameter that counts events up. Stands in the block; may be empty for a `flag`.
  Text number;
  Text flag = {};  ///< of `flag`: parameter that is not 0 when there is a new result
  Text kind;       ///< parameter whose value names the kind
  Table<std::int64_t, EventKind> kinds = {};
  Text error = {};  ///< parameter of the block that the error codes explain; may be empty
  List<EventColumn> columns = {};
  std::optional<Duration> interval = std::nullopt;  ///< between two polls; empty: as usual
  Text preset = {};  ///< parameter of the block: which preset a result was made with; may be empty
  List<EventSetting> settings = {};  ///< of a preset, to be kept with its results
  List<EventForm> longer = {};
  List<EventFrame> frames = {};  ///< beside the answer to a read of the block
  /// Parameters of the block that tell one event from another, beside its number; none: all of it.
  List<Text> identity = {};
  Text torque_unit = {};  ///< parameter of the block whose label is the unit of its torques
  std::optional<CurveSpec> curves = std::nullopt;
  /// Where the block has no known place: its parameters, whose registers count from its first one.
  List<Parameter> fields = {};
  /// How the place of the block can be found on a tool; empty: it is not known how.
  std::optional<BlockSearch> search = std::nullopt;

  /// Whether a block of so many registers is one of its forms.
  [[nodiscard]] bool has_form(std::size_t registers) const;
  /// Of the form that a tool with this firmware is asked for.
  [[nodiscard]] std::uint16_t count_for(unsigned firmware) const;
  /// The form whose own part this is; null: none's.
  [[nodiscard]] const EventForm* form_of(const Parameter& parameter) const;
};

/// The name of a setting's parameter for one preset.
std::string name_of(const EventSetting& setting, std::int64_t preset);

/// The table that the event block stands in.
modbus::RegisterTable table_of(const EventSpec& events);

/// The tool's own limits of parameter n: registers n + offset.
struct LimitSpec {
  std::uint16_t minimum_offset = 0;
  std::uint16_t maximum_offset = 0;
  std::uint16_t from = 0;
  std::uint16_t to = 0;
};

/// Parameters that exist by number only.
struct NumberedSpec {
  Text prefix;
  modbus::RegisterTable table = modbus::RegisterTable::holding;
  std::uint16_t from = 0;
  std::uint16_t to = 0;
  Access access = Access::read_only;
  Evidence evidence = Evidence::inferred;
  Text source;
};

/// What an action does to a product that is run by a command word.
enum class Motion : std::uint8_t { none, start, stop };

/// Done before an action is sent: these bits of a register are cleared. A broadcast clears all of
/// it, because it cannot be read.
struct Preparation {
  modbus::RegisterAddress address = {};
  std::uint16_t clear = 0;
};

/// A deed, as opposed to a stored value: a write that makes the tool do something.
struct Action {
  Text name;
  Text title;
  modbus::RegisterTable table = modbus::RegisterTable::holding;  ///< or `coil`
  modbus::RegisterAddress address = {};
  Encoding encoding = {};                             ///< of the value; a pair is sent whole
  std::optional<std::uint16_t> value = std::nullopt;  ///< fixed value; empty: the user gives one
  std::optional<std::uint16_t> stop_value = std::nullopt;  ///< ends what the action began
  std::uint16_t minimum = 0;                               ///< of a given value
  std::uint16_t maximum = 0;
  bool has_range = false;  ///< numbers from minimum to maximum may be given beside the labels
  List<Label> labels = {};
  Motion motion = Motion::none;  ///< the words are those of RunSpec
  /// The register acts when its value changes to `value`: this is written before it and behind it.
  std::optional<std::uint16_t> rest = std::nullopt;
  std::optional<Preparation> prepare = std::nullopt;
  Duration busy = {};  ///< how long the tool may be busy with it; zero: not at all
  Hazard hazard = Hazard::none;
  Evidence evidence = Evidence::inferred;
  Text source;
  Text note = {};  ///< what a user should know before sending it; may be empty
  /// Parameter that says what a value stands for, with {n} in place of the value; may be empty.
  Text tells = {};
  List<Label> effects = {};  ///< what a value does to a user who works with the tool, in words
  Text check;                ///< how to verify the assignment on the tool; one sentence
  Text confirm;              ///< parameter whose reading proves the effect; empty: nothing can
  /// Reading that proves it; empty: the value written.
  std::optional<std::int64_t> confirm_value = std::nullopt;
};

/// Whether an alarm can be reset by command once its cause is gone.
enum class Resettable : std::uint8_t { unknown, yes, no };

/// Whether a rundown that ended with an error came to its end, so that its values are those of a
/// whole one.
enum class Completion : std::uint8_t { unknown, yes, no };

/// Meaning of one code: alarm, error, exception.
struct CodeText {
  Text text;
  Text remedy;
  Evidence evidence = Evidence::inferred;
  Text source;
  Resettable resettable = Resettable::unknown;
  Completion completed = Completion::unknown;  ///< of a rundown
};

using CodeTexts = Table<std::int64_t, CodeText>;

/// Which table explains the codes of a list.
enum class CodeTable : std::uint8_t {
  error,
  warning,
  refusal,
  none,  ///< the numbers of the list are shown, not explained
};

/// The tables of a profile that are loaded only by those who show codes.
struct CodeTables {
  CodeTexts error = {};
  CodeTexts warning = {};
};

/// What a product says, in a register of its own, of the exception response that it sent last.
struct ExtendedErrorSpec {
  Text parameter = {};
  CodeTexts codes = {};
  List<std::int64_t> busy = {};  ///< codes of a tool that only has to be waited for
  Duration retry_every = {};
  Duration give_up_after = {};

  [[nodiscard]] bool is_busy(std::int64_t code) const;
};

/// One list of codes that `alarms` shows.
struct AlarmList {
  Text name;              ///< "present", "alarm-history"
  List<Text> parameters;  ///< names or patterns, the newest first
  CodeTable codes = CodeTable::error;
};

/// A start state for the simulated tool. Patterns are globs over the names of named and numbered
/// parameters; later entries win.
struct SimulationSpec {
  List<std::uint8_t> identity =
      {};  ///< device-specific bytes of the answer to FC 11h, in its longest form
  std::size_t identity_bytes = 0;  ///< how many of them the tool sends unless told otherwise
  /// Exception code that answers a write outside the limits.
  std::uint8_t limit_exception =
      static_cast<std::uint8_t>(modbus::ExceptionCode::illegal_data_value);
  std::uint16_t stopped_error = 0;  ///< error code of a run that was stopped before its target
  List<std::int64_t> permanent_alarms = {};  ///< that only switching off and on ends
  struct Value {
    Text pattern;
    std::int64_t raw = 0;
  };
  struct Limits {
    Text pattern;
    std::int64_t minimum = 0;  ///< raw
    std::int64_t maximum = 0;  ///< raw
  };
  /// What the event block says of an event of one kind, beside its number and kind.
  struct Event {
    EventKind kind = EventKind::other;
    List<Value> values = {};  ///< by name
  };
  List<Value> values = {};
  List<Limits> limits = {};
  List<Event> events = {};
  List<Area> absent = {};  ///< registers that answer exception 02
};

/// Which registers may be written.
enum class Writes : std::uint8_t {
  any,     ///< also those that the profile does not know, where the user insists
  listed,  ///< only those of its writable parameters and of its actions
};
inline constexpr auto writes_words =
    enum_table<Writes>({{"any", Writes::any}, {"listed", Writes::listed}});

/// A register that has to hold a value before others can be written. It is put back afterwards.
struct UnlockSpec {
  Text parameter = {};
  std::int64_t value = 0;
  List<Text> needed_by = {};  ///< names or patterns of parameters; empty: all
};

/// The catalogue of one product: how to talk to it and what its registers mean.
class Profile {
 public:
  Text id;
  Text title;
  Text maker;
  Text series;
  Text path;              ///< file it came from
  List<Text> bases = {};  ///< ids of the profiles that it extends, the nearest first
  LinkSpec link;
  std::optional<IdentitySpec> identity;
  std::optional<EventSpec> events;
  std::optional<LimitSpec> limits;
  std::optional<NumberedSpec> numbered;
  List<Parameter> parameters;
  List<Action> actions;
  CodeTexts exceptions;  ///< by exception code; meanings of error codes are loaded apart
  std::optional<RunSpec> run = std::nullopt;  ///< how it is started and stopped; may be missing
  std::optional<ExtendedErrorSpec> refusals = std::nullopt;
  List<AlarmList> alarm_lists = {};
  Text alarm_reset = {};    ///< action that resets an alarm; empty: none does
  List<Text> watched = {};  ///< values that `watch` polls unless others are named
  std::optional<UnlockSpec> unlock = std::nullopt;
  Writes writes = Writes::any;
  Text torque_unit_from = {};  ///< parameter whose labels are units of torque; may be empty
  std::optional<DiscoverySpec> discovery = std::nullopt;  ///< how such tools are found
  std::optional<LearnSpec> learn = std::nullopt;          ///< what a tool can show itself

  /// The parameter meant by a name, a number behind the numbered prefix ("p242") or a raw register
  /// ("@holding:2", "@input:3204/i16"). Errors: `unknown_name` with a suggestion; those
  /// of may_read().
  [[nodiscard]] Result<Parameter> find(std::string_view name) const;

  /// All parameters meant, in the order asked for, each once; a pattern gives catalogue order. No
  /// names: every named parameter. What reading clears is meant by its full name only. Errors:
  /// those of find(); `unknown_name` for a pattern that matches nothing.
  [[nodiscard]] Result<std::vector<Parameter>> select(const std::vector<std::string>& names) const;

  /// The same for those who show the catalogue and read nothing of a tool: with what reading
  /// clears.
  [[nodiscard]] Result<std::vector<Parameter>> describe(
      const std::vector<std::string>& names) const;

  /// Whether reading these registers takes nothing that was not asked for. What reading clears may
  /// be read by its own name, alone. Error `usage`: another register would be cleared; it is the
  /// flag of the events, which only their source reads.
  [[nodiscard]] Result<void> may_read(const Parameter& parameter) const;

  /// Whether reading these registers clears one of them.
  [[nodiscard]] bool consumes(const Parameter& parameter) const;

  /// The parameter with this number. Requires a profile with numbers.
  [[nodiscard]] Parameter numbered_parameter(std::uint16_t number) const;

  /// Error `unknown_name` with a suggestion.
  [[nodiscard]] Result<Action> find_action(std::string_view name) const;

  /// Whether a raw write to this register, or coil, is allowed: it belongs to a writable parameter,
  /// named or numbered.
  [[nodiscard]] bool writable(modbus::RegisterTable table, modbus::RegisterAddress address) const;

  /// Whether the profile allows a write to these registers at all, whatever the user says. Error
  /// `read_only` where only listed registers may be written (`writes`), and one of these is none;
  /// `usage` where it would write a part of a parameter, such as half of a float.
  [[nodiscard]] Result<void> may_write(modbus::RegisterTable table, modbus::RegisterAddress first,
                                       std::size_t count) const;

  /// Whether it has parameters that are written alone.
  [[nodiscard]] bool has_guarded() const;

  /// Whether a write to this parameter is a command to the motor of `run`.
  [[nodiscard]] bool commands_motion(const Parameter& parameter) const {
    return run && run->is_command(parameter.name);
  }
  /// Whether `run` starts by this action, under a guard.
  [[nodiscard]] bool is_guarded_start(std::string_view action) const;

  /// Registers with the tool's own minimum and maximum of a parameter; empty when it has none.
  struct LimitRegisters {
    modbus::RegisterAddress minimum;
    modbus::RegisterAddress maximum;
  };
  [[nodiscard]] std::optional<LimitRegisters> limit_registers(const Parameter& parameter) const;

  /// This parameter, marked as a secret, and as guarded, where one of its registers is part of one
  /// that is: by whatever name or number it is asked for.
  [[nodiscard]] Parameter marked(Parameter parameter) const;
};

/// Whether the product sends frames that nothing asked for.
bool sends_unasked(const Profile& profile);

/// What a tool's identity says of a profile that was named for it.
enum class Judgement : std::uint8_t {
  fits,           ///< nothing contradicts the profile
  other_product,  ///< the tool is another product of the same maker and generation
  earlier,        ///< its firmware has other registers
  later,          ///< its firmware has other registers
  unknown,        ///< it is no product that the profile knows
};

/// The one judgement of all verbs. A product that is named by the identity contradicts a profile
/// that is, or extends, another one of the products that the identity tells apart. Requires a
/// profile with identity facts.
Judgement judge(const Profile& profile, const Identity& identity);

/// Why it does not fit, as half a sentence: "the serial number is that of a doga-bmt, not of a
/// doga-bm". Requires a judgement other than `fits`.
std::string misfit(const Profile& profile, const Identity& identity);

/// Parses "@holding:2", "@input:3204/i16" (default u16), without any profile. Empty when the text
/// does not begin with '@'.
std::optional<Result<Parameter>> parse_raw_register(std::string_view text);

}  // namespace spindle::catalogue
