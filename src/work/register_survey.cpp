#include "spindle/work/register_survey.hpp"

#include <algorithm>
#include <utility>

#include "spindle/catalogue/register_sets.hpp"

namespace spindle::work {
namespace {

using modbus::ExceptionCode;

/// What is asked for at a time of a tool of which nothing is known.
constexpr std::uint16_t careful_block = 16;

/// How often a busy tool is asked again, and the least time between.
constexpr int most_repetitions = 20;
constexpr Duration busy_pause = std::chrono::milliseconds(100);

link::BlockRules rules_of(const device::Device& device) {
  const catalogue::Profile& profile = device.profile();
  const link::ReadLimits& limits = device.limits();
  return {
      .longest = profile.id.empty() ? std::min(careful_block, limits.max_read) : limits.max_read,
      .most_bits = profile.id.empty() ? careful_block : limits.max_read_bits,
      .even_pairs = profile.link.even_pairs,
      .forbidden_shapes = limits.forbidden_shapes};
}

bool is_exception(const Error& error, ExceptionCode code) {
  return error.exception == static_cast<std::uint8_t>(code);
}

/// The tool says that it cannot show these registers, or not so many of them.
bool is_refusal(const Error& error) {
  using enum ExceptionCode;
  return is_exception(error, illegal_data_address) || is_exception(error, illegal_data_value) ||
         is_exception(error, server_device_failure);
}

bool is_busy(const Error& error) {
  return is_exception(error, ExceptionCode::acknowledge) ||
         is_exception(error, ExceptionCode::server_device_busy);
}

}  // namespace

std::vector<link::RegisterRange> askable(const RegisterSpan& span,
                                         const catalogue::Profile& profile,
                                         const std::set<std::uint16_t>& left_out) {
  auto without = catalogue::consumed_registers(profile, span.table);
  without.insert(left_out.begin(), left_out.end());
  return link::ranges_between(span.table, span.from, span.to, without);
}

RegisterSurvey survey_registers(OpenTool& tool, const std::vector<link::RegisterRange>& wanted,
                                Duration pause, Clock& clock, const link::Progress& progress) {
  link::RegisterScan scan(wanted, rules_of(tool.device));
  RegisterSurvey survey;
  int repetitions = 0;
  while (const auto block = scan.next()) {
    if (progress) progress(scan.known(), scan.wanted());
    const bool again = repetitions > 0;
    if (survey.requests > 0) {
      const Duration wait = again ? std::max(pause, busy_pause) : pause;
      if (auto slept = clock.sleep_until(clock.now() + wait); !slept) {
        survey.error = std::move(slept.error());
        break;
      }
    }
    ++survey.requests;
    const auto values = tool.device.read_block(*block);
    if (values) {
      scan.answer(*values);
    } else if (is_refusal(values.error())) {
      scan.refuse();
    } else if (is_busy(values.error()) && repetitions < most_repetitions) {
      ++repetitions;
      continue;
    } else {
      survey.error = values.error();
      break;
    }
    repetitions = 0;
  }
  if (progress && !survey.error) progress(scan.known(), scan.wanted());
  survey.runs = scan.runs();
  survey.answered = scan.answered();
  return survey;
}

}  // namespace spindle::work
