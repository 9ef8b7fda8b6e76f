#include "motor_records.hpp"

#include <fmt/format.h>

#include "records.hpp"
#include "spindle/device/run_model.hpp"

namespace spindle::commands {
namespace {

using device::MotorEvent;

std::string meaning_of(std::int64_t code, const catalogue::CodeTexts& texts) {
  const catalogue::CodeText* known = texts.find(code);
  return code == 0 || known == nullptr ? std::string() : known->text.to_string();
}

report::Cell number_or_null(const std::optional<Decimal>& number) {
  return number ? report::Cell(*number) : report::Cell();
}

/// What people read beside the kind.
std::string words_of(const device::MotorTransition& news, const catalogue::CodeTables& tables) {
  switch (news.event) {
    case MotorEvent::alarm:
      return code_words(news.state.alarm, tables.error);
    case MotorEvent::warning:
      return code_words(news.state.warning, tables.warning);
    case MotorEvent::started:
    case MotorEvent::at_speed:
    case MotorEvent::stopped:
      break;
  }
  return {};
}

}  // namespace

std::string code_words(std::int64_t code, const catalogue::CodeTexts& texts) {
  if (code == 0) return {};
  const std::string meaning = meaning_of(code, texts);
  return fmt::format("{:02X}h{}{}", code, meaning.empty() ? "" : " ", meaning);
}

report::Record motor_record(const device::MotorTransition& news, const Target& target,
                            const catalogue::CodeTables& tables) {
  const device::MotorState& state = news.state;
  const bool bad = news.event == MotorEvent::alarm || news.event == MotorEvent::warning;
  report::Record record{.type = "event", .target = target.shown, .time = news.time, .fields = {}};
  record.fields = {{"kind", std::string(motor_event_words.text(news.event))},
                   {"source", std::string("poll")},
                   {"speed", number_or_null(state.feedback_speed)},
                   {"command_speed", number_or_null(state.command_speed)},
                   {"load", number_or_null(state.load)},
                   {"alarm", number(state.alarm)},
                   {"alarm_text", text_or_null(meaning_of(state.alarm, tables.error))},
                   {"warning", number(state.warning)},
                   {"warning_text", text_or_null(meaning_of(state.warning, tables.warning))},
                   {.key = "text",
                    .cell = text_or_null(words_of(news, tables)),
                    .audience = report::Audience::columns,
                    .tone = bad ? report::Tone::bad : report::Tone::plain}};
  return record;
}

std::vector<report::Column> motor_columns(Tools tools) {
  using report::Align;
  std::vector<report::Column> columns = {{"TIME", "time", Align::left, 24, report::wrapped(14)}};
  if (tools == Tools::several)
    columns.push_back({"TARGET", "target", Align::left, 16, report::wrapped(12)});
  columns.insert(columns.end(), {{"KIND", "kind", Align::left, 8},
                                 {"SPEED", "speed", Align::right, 6},
                                 {"LOAD", "load", Align::right, 4},
                                 {"TEXT", "text", Align::left, 1, report::below_row()}});
  return columns;
}

std::string motor_state_words(OpenTool& tool) {
  const auto model = device::RunModel::of(*tool.profile);
  const device::MotorMonitor* monitor = model ? (*model)->monitor() : nullptr;
  if (monitor == nullptr) return {};
  const auto state = monitor->look(tool.device);
  if (!state) return "its registers could not be read";
  std::string words = state->running ? "it says: motor runs" : "it says: motor stands still";
  if (!monitor->facts().alarm.empty()) {
    words += state->alarm == 0 ? ", no alarm" : fmt::format(", alarm {:02X}h", state->alarm);
  }
  const std::string setting = (*model)->telling_setting();
  if (setting.empty()) return words;
  const auto parameter = tool.profile->select({setting});
  if (!parameter) return {};
  const auto readings = tool.device.read_each(*parameter, device::Limits::skip);
  if (!readings || !readings->front().value) return "its registers could not be read";
  return fmt::format("{}, {} {}", words, setting, readings->front().value->to_string());
}

}  // namespace spindle::commands
