#include "event_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "motor_records.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/value.hpp"

namespace spindle::commands {
namespace {

using catalogue::EventKind;
using report::Audience;
using report::Cell;
using report::Field;
using report::Record;
using report::Tone;

/// Those that the profile wants to see, where it has events.
std::vector<report::Column> result_columns(const catalogue::Profile& profile) {
  std::vector<report::Column> columns;
  if (!profile.events) return columns;
  const catalogue::EventLayout layout(profile);
  for (const catalogue::EventColumn& wanted : profile.events->columns) {
    for (const auto& field : layout.fields()) {
      const catalogue::Parameter& parameter = *field.parameter;
      if (parameter.name != wanted.parameter) continue;
      const bool words =
          !parameter.labels.empty() || parameter.encoding.kind == catalogue::Kind::text;
      const auto align = words ? report::Align::left : report::Align::right;
      const std::size_t width = std::max<std::size_t>(wanted.width, wanted.heading.size());
      columns.push_back({wanted.heading, field.key, align, width});
    }
  }
  return columns;
}

Field only_shown(std::string key, std::string text, Tone tone = Tone::plain) {
  return {.key = std::move(key),
          .cell = text_or_null(std::move(text)),
          .audience = Audience::columns,
          .tone = tone};
}

Field result_of(EventKind kind) {
  if (kind == EventKind::fastening_ok) return only_shown("result", "OK", Tone::good);
  if (kind == EventKind::fastening_ng) return only_shown("result", "NG", Tone::bad);
  return only_shown("result", "");
}

constexpr auto origin_words =
    enum_table<device::EventOrigin>({{"push", device::EventOrigin::push},
                                     {"poll", device::EventOrigin::poll},
                                     {"catch-up", device::EventOrigin::catch_up}});

constexpr auto link_words =
    enum_table<device::LinkState>({{"connecting", device::LinkState::connecting},
                                   {"connected", device::LinkState::connected},
                                   {"lost", device::LinkState::lost},
                                   {"reconnecting", device::LinkState::reconnecting}});

std::string missed_text(std::optional<std::uint32_t> missed) {
  if (!missed) return "perhaps events missed";
  if (*missed == 0) return "no event missed";
  return counted(*missed, "event") + " missed";
}

}  // namespace

NewsRecords::NewsRecords(const Target& target, const catalogue::Profile& profile,
                         catalogue::CodeTables tables)
    : target_(&target), tables_(std::move(tables)) {
  if (!profile.events) return;
  layout_.emplace(profile);
  for (const auto& field : layout_->fields()) {
    if (field.parameter->name == profile.events->error) error_key_ = field.key;
    if (field.parameter->unit == catalogue::torque_unit) has_torque_ = true;
  }
}

Record NewsRecords::blank(std::string type, WallTime time) const {
  return {.type = std::move(type), .target = target_->shown, .time = time, .fields = {}};
}

/// The name of an event or a gap, for ever.
void NewsRecords::add_name(Record& record, const Naming& naming) const {
  record.fields.push_back({"serial", text_or_null(naming.serial)});
  record.fields.push_back({"epoch", naming.epoch ? number(*naming.epoch) : Cell()});
  if (naming.id) record.fields.push_back({"id", number(*naming.id)});
}

EventKind NewsRecords::kind_of(const Registers& block) const {
  return layout_->kind_of(block).value_or(EventKind::other);
}

std::string NewsRecords::error_text(std::int64_t code) const {
  if (code == 0) return {};
  const catalogue::CodeText* known = tables_.error.find(code);
  return known == nullptr ? std::string() : known->text.to_string();
}

Record NewsRecords::event(const device::ToolEvent& news, const Naming& naming) const {
  Record record = blank("event", news.time);
  const EventKind kind = kind_of(news.block);
  record.fields.reserve(layout_->fields().size() + 10);
  add_name(record, naming);
  record.fields.push_back({"kind", std::string(catalogue::to_text(kind))});
  record.fields.push_back({"source", std::string(origin_words.text(news.source))});
  std::string text;
  for (const auto& [parameter, at, key] : layout_->fields()) {
    const auto words = catalogue::register_count(parameter->encoding);
    const auto value = catalogue::decode(*parameter, RegisterView(news.block).subspan(at, words));
    if (!value) continue;
    record.fields.push_back({key, value_cell(*value), value->to_string()});
    if (key != error_key_) continue;
    std::string meaning = error_text(value->number.mantissa());
    if (value->number.mantissa() != 0) {
      text = fmt::format("E{}{}{}", value->number.mantissa(), meaning.empty() ? "" : " ", meaning);
    }
    record.fields.push_back({key + "_text", text_or_null(std::move(meaning))});
  }
  if (has_torque_) record.fields.push_back({"torque_unit", text_or_null(target_->torque_unit)});
  record.fields.push_back({"raw", news.block});
  if (news.standing == device::Standing::result) {
    record.fields.push_back(result_of(kind));
  } else {
    record.fields.push_back({"remembered", true});
    const std::string_view why = news.standing == device::Standing::first
                                     ? "it stood in the tool at first, so its age is not known"
                                     : "remembered by a restarted tool, so perhaps an old result";
    text = fmt::format("{}{}{}", text, text.empty() ? "" : "; ", why);
  }
  record.fields.push_back(only_shown("text", std::move(text)));
  return record;
}

Record NewsRecords::value(const device::PolledValue& news, const std::string& type,
                          WallTime time) const {
  const catalogue::Parameter& parameter = *news.parameter;
  Record record = blank(type, time);
  const std::string unit = unit_of(parameter, *target_);
  record.fields = {{"name", parameter.name},
                   {"table", std::string(catalogue::to_text(parameter.table))},
                   {"register", number(parameter.address.value)},
                   {"raw", news.registers},
                   {"value", value_cell(news.value), news.value.to_string()},
                   {"label", text_or_null(news.value.label)},
                   {"unit", text_or_null(unit)},
                   {"previous", news.previous ? value_cell(*news.previous) : Cell()}};
  const bool differs = news.previous && !(*news.previous == news.value);
  const std::string before = differs ? news.previous->to_string() + " -> " : "";
  record.fields.push_back(only_shown("kind", type));
  record.fields.push_back(
      only_shown("text", fmt::format("{}: {}{}{}{}", parameter.name, before, news.value.to_string(),
                                     unit.empty() ? "" : " ", unit)));
  return record;
}

Record NewsRecords::motor(const device::MotorTransition& news) const {
  return motor_record(news, *target_, tables_);
}

Record NewsRecords::gap(const device::EventGap& news, WallTime time, const Naming& naming) const {
  Record record = blank("gap", time);
  add_name(record, naming);
  record.fields.push_back({"missed", news.missed ? number(*news.missed) : Cell()});
  record.fields.push_back({"after", news.after ? number(*news.after) : Cell()});
  record.fields.push_back({"before", news.before ? number(*news.before) : Cell()});
  record.fields.push_back({"reason", news.reason});
  record.fields.push_back(only_shown("kind", "gap", Tone::bad));
  record.fields.push_back(
      only_shown("text", fmt::format("{}: {}", missed_text(news.missed), news.reason)));
  return record;
}

Record NewsRecords::lag(const device::PollLag& news, WallTime time) const {
  const auto text_of = [](Duration duration) {
    return fmt::format("{} ms", std::chrono::round<std::chrono::milliseconds>(duration).count());
  };
  Record record = blank("lag", time);
  record.fields = {{"missed", number(news.missed)},
                   {"interval_ms", milliseconds(news.interval)},
                   {"achieved_ms", milliseconds(news.achieved)},
                   only_shown("kind", "lag", Tone::bad),
                   only_shown("text", fmt::format("{} of {} missed: one poll in {}",
                                                  counted(news.missed, "interval"),
                                                  text_of(news.interval), text_of(news.achieved)))};
  return record;
}

Record NewsRecords::link(const device::LinkChange& news, WallTime time) const {
  Record record = blank("link", time);
  const Tone tone = news.state == device::LinkState::lost ? Tone::bad : Tone::plain;
  std::string text = news.state == device::LinkState::connected
                         ? news.message
                         : fmt::format("{}: {}", link_words.text(news.state), news.message);
  if (news.state == device::LinkState::reconnecting ||
      news.state == device::LinkState::connecting) {
    text =
        fmt::format("{}, attempt {}: {}", link_words.text(news.state), news.attempt, news.message);
  }
  record.fields = {{"state", std::string(link_words.text(news.state))},
                   {"attempt", number(news.attempt)},
                   {"message", news.message},
                   only_shown("kind", "link", tone),
                   only_shown("text", std::move(text))};
  return record;
}

std::vector<report::Column> news_columns(Tools tools,
                                         const std::vector<const catalogue::Profile*>& profiles) {
  using report::Align;
  std::vector<report::Column> columns = {{"TIME", "time", Align::left, 24}};
  if (tools == Tools::several) columns.push_back({"TARGET", "target", Align::left, 16});
  columns.push_back({"KIND", "kind", Align::left, 16});
  for (const catalogue::Profile* profile : profiles) {
    for (report::Column& column : result_columns(*profile)) {
      const bool known = std::any_of(columns.begin(), columns.end(),
                                     [&](const auto& other) { return other.key == column.key; });
      if (!known) columns.push_back(std::move(column));
    }
  }
  columns.insert(columns.end(), {{"RESULT", "result", Align::left, 6},
                                 {"SOURCE", "source", Align::left, 8},
                                 {"TEXT", "text", Align::left, 1}});
  return columns;
}

}  // namespace spindle::commands
