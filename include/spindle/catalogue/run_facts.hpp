#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/catalogue/parameter.hpp"

namespace spindle::catalogue {

enum class Direction : std::uint8_t { forward, reverse };
enum class StopMode : std::uint8_t { decelerate, instant };

/// Words that command a motor in one input mode, without the bits that select operation data.
struct RunWords {
  std::uint16_t forward = 0;
  std::uint16_t reverse = 0;
  std::uint16_t decelerate = 0;
  std::uint16_t instant = 0;
};

/// What a number in the assignment of inputs means.
struct InputFunction {
  std::int64_t number = 0;
  /// The bit that has this function in the words of the profile; empty: it does nothing.
  std::optional<std::uint8_t> bit = std::nullopt;
  Evidence evidence = Evidence::inferred;
  Text source = {};
};

/// Where a driver keeps what each bit of its command word does.
struct InputSpec {
  Text parameter = {};      ///< with {n}, the number of the bit; empty: the bits are fixed
  std::uint16_t first = 0;  ///< bits from
  std::uint16_t last = 0;   ///< to
  List<InputFunction> functions = {};

  [[nodiscard]] const InputFunction* find(std::int64_t number) const;
};

/// What the bits of the command word do on one driver. Words of the profile are made for the
/// default assignment; these are the same words for this driver.
class CommandBits {
 public:
  /// Every bit does what the profile says.
  CommandBits();
  /// `numbers` are those of the bits from the first on; what is not known of further bits is
  /// unknown.
  CommandBits(const InputSpec& facts, std::span<const std::int64_t> numbers);

  /// The word of the profile in the bits of this driver. Empty where no bit has a function that it
  /// needs.
  [[nodiscard]] std::optional<std::uint16_t> word(std::uint16_t standard) const;
  /// The other way round: a word of this driver in the bits of the profile. Empty where it has a
  /// bit whose function is unknown.
  [[nodiscard]] std::optional<std::uint16_t> standard(std::uint16_t word) const;
  /// All bits of this driver that have one of these functions, and those whose function is unknown:
  /// what has to be off so that none of them acts.
  [[nodiscard]] std::uint16_t any_of(std::uint16_t standard) const;
  /// The bits whose function is unknown.
  [[nodiscard]] std::uint16_t unknown() const { return unknown_; }

 private:
  static constexpr int width = 16;

  std::uint16_t unknown_ = 0;
  /// The function of each bit as a bit of the profile; 0: it does nothing, or is unknown.
  std::array<std::uint16_t, width> functions_ = {};
};

/// What a motor says of itself. Names are those of parameters; an empty one: it does not say it.
struct MonitorSpec {
  Text status = {};
  std::optional<std::uint8_t> running = std::nullopt;   ///< bit of the status; empty: its values
  List<std::int64_t> running_values = {};               ///< values of a status that says "runs"
  List<std::int64_t> stopped_values = {};               ///< and of one that says "stands still"
  std::optional<std::uint8_t> at_speed = std::nullopt;  ///< bit: the speed asked for is reached
  std::optional<std::uint8_t> busy = std::nullopt;      ///< bit: internal processing
  Text command_speed = {};   ///< signed; 0 when the motor is told to stand still
  Text feedback_speed = {};  ///< signed where the motor tells its direction
  Text load = {};
  Text alarm = {};    ///< present alarm; 0: none
  Text warning = {};  ///< present warning; 0: none
};

/// An option of a start, and the action that it gives a value to before.
struct StartOption {
  Text option = {};  ///< "preset", as typed behind two hyphens
  Text action = {};
};

/// How a product is run that starts by an action with a `stop`, and ends by itself.
struct StartActionSpec {
  Text start = {};                    ///< the action; its `confirm` says whether it runs
  List<StartOption> selections = {};  ///< what may be selected before, in this order
  Text alarm = {};                    ///< present alarm; 0: none
};

/// How a product is run whose motor follows a command word: a level, which holds until it is told
/// otherwise. Names are those of parameters; of a 32-bit one the word is the low half.
struct CommandWordSpec {
  Text command = {};  ///< the command word
  Text mode = {};     ///< parameter whose value decides what the bits of the word mean
  Table<std::int64_t, RunWords> modes = {};
  /// Bits of which every motion needs at least one, whatever the mode: a word without them never
  /// moves a motor.
  std::uint16_t starting = 0;
  /// Words that stop in every mode: for broadcasts, and when the mode cannot be read.
  std::uint16_t decelerate_always = 0;
  std::uint16_t instant_always = 0;
  std::uint16_t select = 0;  ///< adjoining bits that hold the number of the operation data
  InputSpec inputs = {};     ///< which bit does what on one driver

  MonitorSpec monitor = {};  ///< with all bits of the status, both speeds and the alarm

  Text speed = {};              ///< of operation data {n}; its range is that of the parameter
  Text acceleration = {};       ///< time, seconds
  Text deceleration = {};       ///< time, seconds
  std::uint16_t first = 0;      ///< operation data from
  std::uint16_t last = 0;       ///< to
  std::uint16_t preferred = 0;  ///< used unless the user names another

  /// While this parameter is not `digital`, operation data up to `analog_to` have their speed from
  /// outside.
  Text analog = {};
  std::int64_t digital = 0;
  std::uint16_t analog_to = 0;

  Text watchdog = {};  ///< time without a query after which the driver stops; 0: never
  /// Parameter with the address of the driver whose group this one belongs to; may be empty. Writes
  /// of several registers to that driver reach this one too, and writes of one do not.
  Text group = {};

  /// The word that selects operation data.
  [[nodiscard]] std::uint16_t selecting(std::uint16_t number) const;
};

/// What lets a motor follow its command register: a value, or one bit.
struct EnableSpec {
  Text parameter = {};                             ///< empty: nothing has to be enabled
  std::optional<std::uint8_t> bit = std::nullopt;  ///< set beside the other bits
  std::uint32_t value = 0;                         ///< written where there is no bit
};

/// How a product is run by values of one register of 16 or 32 bits. Names are those of parameters.
struct CommandRegisterSpec {
  Text command = {};
  std::uint32_t forward = 0;
  std::optional<std::uint32_t> reverse = std::nullopt;  ///< empty: it turns one way only
  std::optional<std::uint32_t> stop = std::nullopt;     ///< empty: only `stop_register` stops it
  std::optional<std::uint32_t> instant = std::nullopt;  ///< stops harder than `stop`
  Text stop_register = {};  ///< another register that stops it; may be empty
  std::uint32_t stop_value = 0;
  EnableSpec enable = {};
  Text set_point = {};       ///< how fast, in its own unit; may be empty
  MonitorSpec monitor = {};  ///< without a status and a speed nothing proves a standstill
  Duration stopping = std::chrono::seconds(10);  ///< how long a stop may take at most
};

/// How a product is started and stopped.
enum class RunKind : std::uint8_t { start_action, command_word, command_register };

/// As written in profiles: "command-word".
inline constexpr auto run_words =
    enum_table<RunKind>({{"start-action", RunKind::start_action},
                         {"command-word", RunKind::command_word},
                         {"command-register", RunKind::command_register}});
constexpr std::string_view to_text(RunKind kind) { return run_words.text(kind); }

/// The section `run` of a profile.
struct RunSpec {
  std::variant<StartActionSpec, CommandWordSpec, CommandRegisterSpec> model = CommandWordSpec{};
  /// What to look at when a stop is not confirmed, as one sentence; may be empty.
  Text still_runs = {};
  Evidence evidence = Evidence::inferred;
  Text source = {};
  /// The profile does not say it, but has one action that starts a motion and ends it: it can be
  /// stopped, and is not started.
  bool is_derived = false;

  [[nodiscard]] RunKind kind() const { return static_cast<RunKind>(model.index()); }
  [[nodiscard]] const CommandWordSpec* word() const { return std::get_if<CommandWordSpec>(&model); }
  [[nodiscard]] const StartActionSpec* action() const {
    return std::get_if<StartActionSpec>(&model);
  }
  [[nodiscard]] const CommandRegisterSpec* command_register() const {
    return std::get_if<CommandRegisterSpec>(&model);
  }

  /// Whether a write to this parameter is a command to the motor.
  [[nodiscard]] bool is_command(std::string_view parameter) const;
};

/// "operation.{n}.speed" with the number in its place.
std::string numbered_name(std::string_view pattern, std::uint16_t number);

}  // namespace spindle::catalogue
