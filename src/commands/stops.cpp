#include "stops.hpp"

#include <array>

#include "records.hpp"

namespace spindle::commands {
namespace {

std::string_view to_text(device::StopResult result) {
  switch (result) {
    case device::StopResult::confirmed:
      return "confirmed";
    case device::StopResult::sent:
      return "sent";
    case device::StopResult::unconfirmed:
      return "not-confirmed";
  }
  return "";
}

}  // namespace

Result<catalogue::Action> find_start(const catalogue::Profile& profile) {
  auto start = profile.find_action("start");
  if (start && start->value && start->stop_value) return start;
  return tl::unexpected(Error{.code = Errc::usage,
                              .message = "this product can not be started and stopped by Modbus",
                              .hint = "start and stop it at the tool",
                              .name = profile.id});
}

report::Record stop_record(device::StopResult result, const Target& target, const Clock& clock) {
  return {.type = "action",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"action", std::string("stop")},
                     {"value", report::Cell()},
                     {"result", std::string(to_text(result))}}};
}

std::span<const report::Column> stop_columns() {
  static const std::array<report::Column, 3> columns = {
      {{"TARGET", "target"}, {"ACTION", "action"}, {"RESULT", "result"}}};
  return columns;
}

std::string where_to_stop(const catalogue::Profile* profile) {
  const std::string here = "stop it at the tool";
  const bool has_more = profile != nullptr && profile->run && !profile->run->still_runs.empty();
  return has_more ? here + "; " + profile->run->still_runs : here;
}

Error still_runs(const Target& target, const catalogue::Profile* profile) {
  return target.blamed(
      {.code = Errc::mismatch,
       .message = "the stop was acknowledged, but the tool still says that it runs",
       .hint = where_to_stop(profile)});
}

}  // namespace spindle::commands
