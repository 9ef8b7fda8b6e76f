#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "spindle/work/command_word_setup.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/environment.hpp"

namespace spindle::work {
namespace {

/// A neighbour that is switched off must not keep the user waiting.
constexpr Duration neighbours_answer = std::chrono::milliseconds(150);

}  // namespace

Result<std::string> WordSetup::group_in_words() {
  if (facts().group.empty()) return std::string();
  TRY_LET(const auto parameter, tool().profile->find(facts().group));
  device::Device& device = tool().device;
  link::Session& session = device.session();
  const auto parent_of_present = [&]() -> Result<std::optional<std::int64_t>> {
    TRY_LET(const auto readings, device.read_each({parameter}, device::Limits::skip));
    const auto& value = readings.front().value;
    if (!value) return std::nullopt;
    return value->number.mantissa();
  };
  TRY_LET(const auto own_parent, parent_of_present());
  const modbus::UnitId unit = session.options().unit;
  const Duration usual = session.options().answer_timeout;
  std::vector<std::string> children;
  if (own_parent == unit.value) children.emplace_back("others");
  session.set_answer_timeout(std::min(usual, neighbours_answer));
  device.set_retries(0);
  for (const Target& neighbour : neighbours()) {
    session.set_unit(*neighbour.endpoint.unit);
    const auto parent = parent_of_present();
    if (parent && *parent == unit.value) children.push_back(neighbour.shown);
  }
  session.set_unit(unit);
  session.set_answer_timeout(usual);
  device.set_retries(environment().common.retries.value_or(tool().profile->link.retries));
  if (!children.empty()) {
    return fmt::format(
        "{} is the parent of a group ({}), of which only its own motor is set and "
        "started",
        tool().target.shown, fmt::join(children, ", "));
  }
  const bool is_child = own_parent && *own_parent > 0 && *own_parent != unit.value;
  if (!is_child) return std::string();
  return fmt::format("{} belongs to the group of unit {}, which is not started with it",
                     tool().target.shown, *own_parent);
}

/// The other drivers of the tools file on the same line; also those whose entries have a fault, as
/// they turn all the same.
std::vector<Target> WordSetup::neighbours() const {
  std::vector<Target> found;
  const std::string line = shared_line(tool().target.endpoint);
  if (line.empty()) return found;
  files::Tools tools = environment().tools;
  tools.faults.clear();
  const Environment all = with_tools(environment(), tools);
  for (const files::Tool& known : tools.tools) {
    for (Target& other : resolve_each_target({known.name}, all).targets) {
      const auto& unit = other.endpoint.unit;
      const bool is_other =
          unit && unit->value != 0 && unit->value != tool().device.session().options().unit.value;
      const bool fits =
          is_other && other.profile == tool().profile->id && shared_line(other.endpoint) == line;
      if (fits) found.push_back(std::move(other));
    }
  }
  return found;
}

}  // namespace spindle::work
