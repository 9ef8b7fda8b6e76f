#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/decimal.hpp"

namespace spindle::files {

/// What of a part was measured. Limits that are empty are not known.
struct QdasCharacteristic {
  std::string name;
  std::string unit = {};
  std::optional<Decimal> nominal = std::nullopt;
  std::optional<Decimal> lower = std::nullopt;
  std::optional<Decimal> upper = std::nullopt;
  std::string remark = {};
};

/// Whether statistics may use a value.
enum class QdasUse : std::uint8_t { evaluated, left_out };

/// What was measured at one time: a value of each characteristic; empty: none.
struct QdasRow {
  std::vector<std::optional<Decimal>> values = {};
  QdasUse use = QdasUse::evaluated;
  WallTime shown = {};  ///< what a clock showed, as if it were UTC: the format knows no zone
};

struct QdasPart {
  std::string number;
  std::string name;
  std::string remark = {};
  std::vector<QdasCharacteristic> characteristics = {};
  std::vector<QdasRow> rows = {};
};

/// One part in the ASCII transfer format of Q-DAS (AQDEF): K fields, then a line a row. ISO 8859-1;
/// what it does not have becomes "?", control characters blanks.
std::string render_qdas(const QdasPart& part);

}  // namespace spindle::files
