#include "page/state_json.hpp"

#include <fmt/format.h>

#include "spindle/base/json.hpp"
#include "spindle/report/record.hpp"

namespace spindle::page {
namespace {

std::string text_or_null(std::string_view text) { return text.empty() ? "null" : quoted(text); }

std::string torque_or_null(const std::optional<std::int64_t>& torque) {
  return torque ? torque_text(*torque) : "null";
}

template <typename Number>
std::string number_or_null(const std::optional<Number>& number) {
  return number ? fmt::format("{}", *number) : "null";
}

std::string time_or_null(const std::optional<WallTime>& time) {
  return time ? quoted(report::to_text(*time)) : "null";
}

std::string_view word_of(LinkShown shown) {
  switch (shown) {
    case LinkShown::up:
      return "connected";
    case LinkShown::down:
      return "lost";
    case LinkShown::unknown:
      break;
  }
  return "unknown";
}

std::string_view word_of(Recorder recorder) {
  switch (recorder) {
    case Recorder::runs:
      return "running";
    case Recorder::stopped:
      return "stopped";
    case Recorder::unknown:
      break;
  }
  return "unknown";
}

std::string missed_json(const MissedSum& sum) {
  return fmt::format(R"({{"count":{},"at_least":{}}})", sum.count, sum.at_least || sum.is_unsure);
}

std::string fastening_json(const Fastening& result) {
  return fmt::format(
      R"({{"time":{},"result":"{}","torque":{},"number":{},"error":{},"error_text":{},"remedy":{},"barcode":{},"remembered":{}}})",
      quoted(report::to_text(result.at)), result.is_ok ? "OK" : "NG", torque_or_null(result.torque),
      result.number, result.error, text_or_null(result.text), text_or_null(result.remedy),
      text_or_null(result.barcode), result.is_old);
}

std::string trouble_json(const std::optional<Trouble>& trouble) {
  if (!trouble) return "null";
  return fmt::format(R"({{"what":{},"text":{},"remedy":{},"time":{}}})", quoted(trouble->what),
                     text_or_null(trouble->text), text_or_null(trouble->remedy),
                     quoted(report::to_text(trouble->at)));
}

std::string motor_json(const std::optional<MotorNews>& motor) {
  if (!motor || motor->kind.empty()) return "null";
  return fmt::format(R"({{"kind":{},"speed":{},"time":{}}})", quoted(motor->kind),
                     motor->speed ? motor->speed->to_string() : "null",
                     quoted(report::to_text(motor->at)));
}

std::string joined(const std::vector<std::string>& parts) {
  return fmt::format("[{}]", fmt::join(parts, ","));
}

}  // namespace

std::string quoted(std::string_view text) {
  std::string json;
  append_json_string(json, text);
  return json;
}

std::string station_json(const Station& station, const LinkView& link) {
  std::vector<std::string> recent;
  for (const Fastening& result : station.recent) {
    recent.push_back(fmt::format(R"({{"time":{},"result":"{}","torque":{}}})",
                                 quoted(report::to_text(result.at)), result.is_ok ? "OK" : "NG",
                                 torque_or_null(result.torque)));
  }
  return fmt::format(
      R"({{"target":{},"maker":{},"serial":{},"model":{},"profile":{},"link":"{}","link_text":{},"heard":{},"preset":{},"target_torque":{},"torque_unit":{},"last":{},"motor":{},"ok":{},"ng":{},"missed":{},"alarm":{},"warning":{},"recent":{}}})",
      quoted(station.name), text_or_null(station.maker), text_or_null(station.serial),
      text_or_null(station.model), text_or_null(station.profile), word_of(link.shown),
      text_or_null(link.detail), time_or_null(station.heard), number_or_null(station.preset),
      torque_or_null(station.target_torque), text_or_null(station.unit),
      station.last ? fastening_json(*station.last) : "null", motor_json(station.motor), station.ok,
      station.ng, missed_json(sum_of(station.misses)), trouble_json(station.alarm),
      trouble_json(station.warning), joined(recent));
}

std::string state_json(const Overview& overview, const Position& position, WallTime as_of,
                       const std::vector<std::string>& tools) {
  std::vector<std::string> old;
  for (const std::string& name : overview.old) old.push_back(quoted(name));
  return fmt::format(
      R"({{"id":"{}","as_of":{},"problem":{},"recorder":"{}","shift":{{"since":{},"until":{}}},"ok":{},"ng":{},"missed":{},"left_out":{},"tools":{}}})"
      "\n",
      to_text(position), quoted(report::to_text(as_of)), text_or_null(overview.problem),
      word_of(overview.recorder), quoted(report::to_text(overview.shift.begin)),
      quoted(report::to_text(overview.shift.end)), overview.ok, overview.ng,
      missed_json(overview.missed), joined(old), joined(tools));
}

}  // namespace spindle::page
