#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "spindle/base/decimal.hpp"

namespace spindle::files {

/// What is recorded of a value: its number, or its text.
using LoggedValue = std::variant<Decimal, std::string>;

/// One change that a command made, or tried to make (contract, section 5, Record of changes).
struct Change {
  std::string time;  ///< "2026-11-22T10:15:30.123Z"
  std::string user;
  std::string command;  ///< "set", "do", "restore", "alarms", "remote-start"
  std::string target;   ///< as the user named it
  std::string serial;   ///< empty: not known
  std::string name;     ///< parameter or action
  std::optional<std::uint16_t> register_address = std::nullopt;
  std::optional<LoggedValue> old_value = std::nullopt;
  std::optional<LoggedValue> new_value = std::nullopt;
  std::string result;
  std::string id = {};  ///< the same in the records of what is begun and how it ended; empty: none
  std::string unit = {};       ///< of both values; empty: none, or not known
  std::string old_label = {};  ///< of an enumeration; empty: none
  std::string new_label = {};
  std::string undoes = {};  ///< id of the change that is taken back; empty: none is
};

/// One line of the change log, a JSON object with its line end. What is not known is null.
std::string render_change(const Change& change);

/// The result of a record that is written before something is sent. Another record with the same
/// `id` says how it ended; where that is missing, the program ended in between.
inline constexpr std::string_view begun = "begun";

}  // namespace spindle::files
