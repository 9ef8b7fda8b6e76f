#pragma once

#include <cstdint>

#include "spindle/base/enum_table.hpp"
#include "spindle/catalogue/list.hpp"
#include "spindle/catalogue/parameter.hpp"
#include "spindle/catalogue/text.hpp"

namespace spindle::catalogue {

/// Where the event block may stand that is only known as it is pushed: the places at which a search
/// on the user's own tool looks, reading only.
struct BlockSearch {
  Text name;  ///< what it is called on the command line
  Text title = {};
  std::uint16_t count = 0;  ///< registers that are read at once: more than the block has
  std::uint16_t from = 0;   ///< the first place
  std::uint16_t to = 0;     ///< the last one, at most
  std::uint16_t step = 1;   ///< from one place to the next
};

/// How a command register shows itself while the user does on the tool what it commands.
enum class LearnedBy : std::uint8_t {
  value,     ///< it holds what the parameter says
  clearing,  ///< it changes when the parameter becomes 0, and at no other time
};
inline constexpr auto learned_by_words =
    enum_table<LearnedBy>({{"value", LearnedBy::value}, {"clearing", LearnedBy::clearing}});

/// An action whose register no source says, and a tool can show.
struct LearnedAction {
  Text name;
  Text title;
  Text follows;  ///< parameter of the same tool that says what happened
  LearnedBy by = LearnedBy::value;
  Text deed;  ///< what the user does on the tool, as a request: "choose another preset"
  std::uint16_t minimum = 0;  ///< of the numbers that may be given, where there are no labels
  std::uint16_t maximum = 0;
  List<Label> labels = {};
  Hazard hazard = Hazard::unclear;
  Text check;  ///< how to verify on the tool that a write acts; one sentence
};

/// What can be found out on a user's own tool, and the registers among which it is looked for.
struct LearnSpec {
  modbus::RegisterTable table = modbus::RegisterTable::holding;
  std::uint16_t from = 0;
  std::uint16_t to = 0;
  List<LearnedAction> actions = {};
};

}  // namespace spindle::catalogue
