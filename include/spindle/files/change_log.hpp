#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/decimal.hpp"

namespace spindle::files {

/// One change that a command made, or tried to make (contract, section 5, Record of changes).
struct Change {
  std::string time;  ///< "2026-11-22T10:15:30.123Z"
  std::string user;
  std::string command;  ///< "set", "do", "restore", "alarms", "remote-start"
  std::string target;   ///< as the user named it
  std::string serial;   ///< empty: not known
  std::string name;     ///< parameter or action
  std::optional<std::uint16_t> register_address = std::nullopt;
  std::optional<Decimal> old_value = std::nullopt;
  std::optional<Decimal> new_value = std::nullopt;
  std::string result;
  std::string id = {};  ///< the same in the records of what is begun and how it ended; empty: none
};

/// One line of the change log, a JSON object with its line end. What is not known is null.
std::string render_change(const Change& change);

/// The result of a record that is written before something is sent. Another record with the same
/// `id` says how it ended; where that is missing, the program ended in between.
inline constexpr std::string_view begun = "begun";

/// A record of changes as it was read.
struct ChangeRecords {
  std::vector<Change> changes = {};      ///< in the order of the file
  std::vector<std::size_t> broken = {};  ///< lines that are no whole record, counted from 1
};

/// Reads what render_change() wrote. A line that a crash cut off, or that is something else, is
/// left out and named in `broken`.
ChangeRecords read_changes(std::string_view text);

/// What was begun and has no result: nobody recorded what became of it.
std::vector<Change> without_result(const std::vector<Change>& changes);

}  // namespace spindle::files
