#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "spindle/link/register_scan.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::work {

/// Registers by table and address, both ends inclusive.
struct RegisterSpan {
  modbus::RegisterTable table = modbus::RegisterTable::holding;
  std::uint16_t from = 0;
  std::uint16_t to = 0;
};

/// What was read of a tool, register by register.
struct RegisterSurvey {
  std::vector<link::RegisterRun> runs = {};
  std::size_t answered = 0;  ///< registers
  std::size_t requests = 0;
  std::optional<Error> error = std::nullopt;  ///< why it ended before all was known
};

/// The time between two requests, so that a tool has time for its own work.
inline constexpr Duration usual_pause = std::chrono::milliseconds(20);

/// The registers of a span without what reading clears, and without `left_out`.
std::vector<link::RegisterRange> askable(const RegisterSpan& span,
                                         const catalogue::Profile& profile,
                                         const std::set<std::uint16_t>& left_out = {});

/// Asks for all of `wanted`, in blocks that are halved where the tool refuses them (exceptions 02,
/// 03 and 04). Reads only. Whatever else goes wrong ends it, with what is known by then; a busy
/// tool is waited for.
RegisterSurvey survey_registers(OpenTool& tool, const std::vector<link::RegisterRange>& wanted,
                                Duration pause, Clock& clock, const link::Progress& progress = {});

}  // namespace spindle::work
