#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/decimal.hpp"
#include "spindle/base/enum_table.hpp"
#include "spindle/catalogue/encoding.hpp"
#include "spindle/catalogue/list.hpp"
#include "spindle/catalogue/text.hpp"
#include "spindle/modbus/types.hpp"

namespace spindle::catalogue {

/// Where a fact comes from, strongest first (contract, section 5, Evidence). `verified` is what was
/// seen on a user's own tool: only profiles of users have it.
enum class Evidence : std::uint8_t { verified, manual, transcribed, sibling, inferred };
inline constexpr auto evidence_words = enum_table<Evidence>({{"verified", Evidence::verified},
                                                             {"manual", Evidence::manual},
                                                             {"transcribed", Evidence::transcribed},
                                                             {"sibling", Evidence::sibling},
                                                             {"inferred", Evidence::inferred}});

enum class Access : std::uint8_t { read_only, read_write };
inline constexpr auto access_words =
    enum_table<Access>({{"r", Access::read_only}, {"rw", Access::read_write}});

/// Whether a value may be restored to another tool than its own.
enum class Cloning : std::uint8_t { allowed, never };
/// What reading does to the register.
enum class Reading : std::uint8_t {
  harmless,
  consumes,  ///< it clears it: only who waits for what it says may read it
};
/// Whether a value is shown, and held by backups, without being told to.
enum class Secrecy : std::uint8_t { open, secret };
/// Whether a write may change what other values mean, or the tool may change them along.
enum class Guarding : std::uint8_t {
  none,
  alone,  ///< it is asked about, and written alone, between two readings of everything
};
/// What a write may do beyond storing a value.
enum class Hazard : std::uint8_t {
  none,
  moves,    ///< starts or changes a motion
  locks,    ///< takes the tool away from its operator
  unclear,  ///< the register's meaning is not certain: it may move or lock
  erases,   ///< overwrites stored settings
  link,     ///< erases settings without which the tool may no longer be reached
};
inline constexpr auto hazard_words = enum_table<Hazard>({{"none", Hazard::none},
                                                         {"moves", Hazard::moves},
                                                         {"locks", Hazard::locks},
                                                         {"unclear", Hazard::unclear},
                                                         {"erases", Hazard::erases},
                                                         {"link", Hazard::link}});

/// Meaning of one number of an enumeration.
struct Label {
  std::int64_t number = 0;
  Text text;
};

/// Allowed values in units of the parameter (already scaled), inclusive. Either side may be
/// unknown.
struct Range {
  std::optional<Decimal> minimum;
  std::optional<Decimal> maximum;
};

/// Stands in `Parameter::unit` for the torque unit that is set on the tool.
inline constexpr std::string_view torque_unit = "torque";

/// When a written value begins to act.
enum class Effect : std::uint8_t {
  at_once,
  after_stop,           ///< when the motor stands still
  after_configuration,  ///< when the product was told to configure itself, or was switched on anew
  after_power_cycle,    ///< when it was stored and the product switched off and on
  unknown,              ///< no source says
};
inline constexpr auto effect_words =
    enum_table<Effect>({{"at-once", Effect::at_once},
                        {"after-stop", Effect::after_stop},
                        {"after-configuration", Effect::after_configuration},
                        {"after-power-cycle", Effect::after_power_cycle},
                        {"unknown", Effect::unknown}});

enum class Notation : std::uint8_t {
  decimal,
  hexadecimal,  ///< codes that documents print as "30h"; shown so beside the number
};

/// Name of one bit of a bit field, or of some that stand together.
struct BitName {
  std::uint8_t bit = 0;  ///< 0: the lowest
  Text text;
  /// The name counts only while `Parameter::bits_by` has this value; empty: always.
  std::optional<std::int64_t> when = std::nullopt;
  std::uint8_t width = 1;  ///< bits from `bit` on that are one number
};

/// One entry of the catalogue.
struct Parameter {
  Text name;   ///< "preset.1.target-torque", "p242", "@holding:2"
  Text title;  ///< what it is, for people
  modbus::RegisterTable table = modbus::RegisterTable::holding;
  modbus::RegisterAddress address = {};
  Encoding encoding = {};
  Text unit;  ///< "%", "rpm", "deg"; "torque" stands for the tool's own torque unit
  Range range = {};
  std::optional<Range> except = std::nullopt;  ///< a hole in the range, both sides known
  std::optional<Decimal> default_value = std::nullopt;
  List<Label> labels = {};
  List<BitName> bits = {};  ///< of a bit field
  Text bits_by = {};        ///< parameter whose value decides between names; may be empty
  /// Name of the bits that are meant, where only `bits_by` says which these are: until
  /// with_bits_for() they are all that the register holds. Empty in a profile.
  Text part = {};
  Notation notation = Notation::decimal;
  Access access = Access::read_only;
  Cloning cloning = Cloning::allowed;
  Secrecy secrecy = Secrecy::open;
  Guarding guarding = Guarding::none;
  Reading reading = Reading::harmless;
  Evidence evidence = Evidence::inferred;
  Text source;  ///< document and section
  Text note;    ///< what a user should know, such as when a change takes effect; may be empty
  std::optional<Effect> effect = std::nullopt;  ///< empty: the profile does not speak of it
  Text risk = {};  ///< what a change may cost, told before it is written; may be empty
  /// How long a written value may take until it reads back; empty: as `LinkSpec::settle` says.
  std::optional<Duration> settle = std::nullopt;
  Hazard hazard = Hazard::none;  ///< declared; danger_of() says what counts
  /// Patterns that say that there is no value, as to_pattern() gives them.
  List<std::uint64_t> nulls = {};
  /// Parameter whose value is a power of ten that the scale is multiplied with; may be empty.
  Text scale_by = {};
  /// Where it is written, when that is not where it is read.
  std::optional<modbus::RegisterAddress> write_address = std::nullopt;
  /// Parameters that are written before and behind this one, where they are written together.
  List<Text> before = {};
  List<Text> after = {};

  /// Where it is written.
  [[nodiscard]] modbus::RegisterAddress written_at() const {
    return write_address.value_or(address);
  }
};

/// The same texts, where strings are asked for.
std::vector<std::string> to_strings(const List<Text>& texts);

/// The bit field with only the names that count while `bits_by` has this value; empty: not known,
/// so only names that always count. Where only a `part` is meant, that part; with its `part` still
/// there when it does not count.
Parameter with_bits_for(Parameter parameter, std::optional<std::int64_t> value);

/// The bits of a bit field that have this name, as a parameter of their own: "control.start". Its
/// other bits stay as they are when it is written.
Parameter part_of(const Parameter& parameter, const BitName& bit);

/// The parameter with the scale that counts while `scale_by` has this value.
Parameter with_power(Parameter parameter, std::int64_t power);

/// Whether two parameters, where they are read, have a register in common.
bool share_registers(const Parameter& a, const Parameter& b);

/// The same of bits: parts of one register may share it without a bit in common. Parts that begin
/// at different registers count as a whole.
bool share_bits(const Parameter& a, const Parameter& b);

// As written in profiles and records.
constexpr std::string_view to_text(Kind kind) { return kind_words.text(kind); }
constexpr std::string_view to_text(Hazard hazard) { return hazard_words.text(hazard); }
constexpr std::string_view to_text(Effect effect) { return effect_words.text(effect); }
constexpr std::string_view to_text(Evidence evidence) { return evidence_words.text(evidence); }
constexpr std::string_view to_text(Access access) { return access_words.text(access); }
using modbus::to_text;  // "holding" or "input"

}  // namespace spindle::catalogue
