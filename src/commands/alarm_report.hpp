#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/commands/context.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// One parameter that holds a code, and the list in which it is shown.
struct AlarmSource {
  std::string list;
  catalogue::Parameter parameter;
  catalogue::CodeTable table = catalogue::CodeTable::error;
};

/// The parameters of a product that hold the codes of alarms, list by list. Error `usage` where its
/// profile names none.
Result<std::vector<AlarmSource>> alarm_sources(const catalogue::Profile& profile);

/// What was found, and what became of the reset.
struct AlarmReport {
  Outcome outcome = {};
  catalogue::Value present = {};  ///< the present alarm; 0: none was found
  bool was_asked = false;         ///< something that tells the present alarm was asked for
  bool was_told = true;           ///< and it answered
  catalogue::Resettable resettable = catalogue::Resettable::unknown;
  enum class Reset : std::uint8_t { none, done, failed } reset = Reset::none;

  /// Whether it is known that there was an alarm, or that there was none.
  [[nodiscard]] bool is_known() const { return was_present() || (was_asked && was_told); }
  [[nodiscard]] bool was_present() const { return present.number != Decimal(0); }
  /// Whether there is still an alarm now.
  [[nodiscard]] bool is_present() const { return was_present() && reset != Reset::done; }
};

/// Reads the lists of a tool and shows them. Fails where none of them can be read, or shown.
Result<void> show_alarms(const std::vector<AlarmSource>& sources, OpenTool& tool,
                         AlarmReport& report, Context& context);

/// What is known of the present alarm, for people.
std::string sentence_of(const AlarmReport& report);

}  // namespace spindle::commands
