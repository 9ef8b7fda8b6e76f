#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/decimal.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/catalogue/value.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/device/device.hpp"

namespace spindle::commands {

/// A change against what the tool holds: "NAME+=0.1", "NAME-=5%", "NAME=+5%".
struct ValueStep {
  Sign sign = Sign::plus;
  Decimal amount = {};      ///< in the unit of the parameter, or so many hundredths of the value
  bool is_percent = false;  ///< hundredths
};

/// What was typed, taken apart; nothing is known of the name yet.
struct TypedAssignment {
  std::string name;
  std::string value;
  std::optional<Sign> sign = std::nullopt;  ///< of "+=" and "-="
};

/// "NAME=VALUE", "NAME+=VALUE" or "NAME-=VALUE". A name that ends in a sign is one where the
/// profile has it. Error `usage`.
Result<TypedAssignment> take_apart(const std::string& text, const catalogue::Profile& profile);

/// The parameters that a name or pattern means to a command that writes: a pattern means named ones
/// only. Errors of Profile::find() and one_meant_by(); `unknown_name` for a pattern without a
/// match.
Result<std::vector<catalogue::Parameter>> parameters_to_set(const std::string& name,
                                                            const catalogue::Profile& profile);

/// The step that was typed for this parameter, whose values are shown in this unit; empty: the
/// value is one as it stands. What was a value before there were steps is none: a sign alone makes
/// no step, and labels and texts are what they are. Error `bad_value` where the step cannot be
/// made, or "5%" may be of the value or of the unit.
Result<std::optional<ValueStep>> step_of(const TypedAssignment& typed,
                                         const catalogue::Parameter& parameter,
                                         const std::string& unit);

/// What the tool holds with the step, exactly. Error `bad_value` where that is no number, or has
/// too many digits.
Result<Decimal> stepped(const catalogue::Value& before, const ValueStep& step);

/// "2.71 + 5 % is 2.8455".
std::string step_in_words(const catalogue::Value& before, const ValueStep& step,
                          const Decimal& result);

/// One assignment with where it stands; no place: on the command line.
struct PlacedText {
  std::string text;
  std::string place = {};
};

/// The lines of a file that assign: NAME=VALUE each, with blanks around the name and the value;
/// empty lines and those that begin with '#' are left out. `name` is that of the file.
std::vector<PlacedText> assignments_in(std::string_view text, const std::string& name);

/// What is to be set: the words of the command line, then the lines of its file. Errors: those of
/// reading the file; `usage` where nothing is to be set.
Result<std::vector<PlacedText>> texts_to_set(const SetOptions& options, const Context& context);

/// One error for all of them: the first one, with the others as its details.
Error all_of(std::vector<Error> errors);

}  // namespace spindle::commands
