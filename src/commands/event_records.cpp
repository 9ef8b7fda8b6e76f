#include "event_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "motor_records.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/curve.hpp"
#include "spindle/catalogue/value.hpp"
#include "spindle/device/run_model.hpp"

namespace spindle::commands {
namespace {

using catalogue::EventKind;
using report::Audience;
using report::Cell;
using report::Field;
using report::Record;
using report::Tone;

/// How a column gives way: the number of an event tells the least, then what the profile names
/// last; the torque and its preset stay.
report::Room room_of(const catalogue::Parameter& parameter, bool words, std::size_t from_the_end,
                     const catalogue::EventSpec& events) {
  constexpr std::uint8_t rank_of_number = 2;
  if (parameter.unit == catalogue::torque_unit || parameter.name == events.preset) return {};
  if (parameter.name == events.number) return report::left_out(rank_of_number);
  const auto rank = static_cast<std::uint8_t>(rank_of_number + 1 + from_the_end);
  constexpr std::uint8_t least_of_words = 8;
  return words ? report::wrapped(least_of_words, rank) : report::left_out(rank);
}

/// The unit of all torques of these tools; empty where it is not known, or there are several.
std::string common_unit(const NewsSources& sources) {
  std::string common;
  for (const std::string& unit : sources.torque_units) {
    if (unit.empty() || (!common.empty() && common != unit)) return {};
    common = unit;
  }
  return common;
}

/// Whether each event has to say the unit of its torque itself.
bool has_own_units(const NewsSources& sources) {
  const bool is_any_known = std::any_of(sources.torque_units.begin(), sources.torque_units.end(),
                                        [](const std::string& unit) { return !unit.empty(); });
  return (is_any_known && common_unit(sources).empty()) ||
         std::any_of(sources.profiles.begin(), sources.profiles.end(), [](const auto* profile) {
           return profile->events && !profile->events->torque_unit.empty();
         });
}

/// Those that the profile wants to see, where it has events.
std::vector<report::Column> result_columns(const catalogue::Profile& profile,
                                           const NewsSources& sources) {
  std::vector<report::Column> columns;
  if (!profile.events) return columns;
  const catalogue::EventLayout layout(profile);
  const bool has_own = has_own_units(sources);
  const std::string unit = has_own ? std::string() : common_unit(sources);
  std::size_t from_the_end = profile.events->columns.size();
  for (const catalogue::EventColumn& wanted : profile.events->columns) {
    --from_the_end;
    for (const auto& field : layout.fields()) {
      const catalogue::Parameter& parameter = *field.parameter;
      if (parameter.name != wanted.parameter) continue;
      const bool words =
          !parameter.labels.empty() || parameter.encoding.kind == catalogue::Kind::text;
      const auto align = words ? report::Align::left : report::Align::right;
      const bool is_torque = parameter.unit == catalogue::torque_unit;
      const std::string heading =
          is_torque && !unit.empty() ? wanted.heading + " " + unit : wanted.heading.to_string();
      const std::size_t width = std::max<std::size_t>(wanted.width, heading.size());
      columns.push_back({heading, field.key, align, width,
                         room_of(parameter, words, from_the_end, *profile.events)});
      if (is_torque && has_own) {
        columns.push_back({"UNIT", "torque_unit", report::Align::left, 6});
      }
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

bool has_unit_column(const catalogue::Parameter& parameter) {
  return !parameter.unit.empty() && parameter.unit != catalogue::torque_unit;
}

/// The unit of a parameter, of which only the name is known.
std::string unit_of(std::string_view name, const catalogue::Profile& profile) {
  for (const catalogue::Parameter& parameter : profile.parameters) {
    if (parameter.name == name) return parameter.unit.to_string();
  }
  return {};
}

std::vector<Field> units_of(const catalogue::Profile& profile) {
  std::vector<Field> units;
  if (profile.events) {
    const catalogue::EventLayout layout(profile);
    for (const auto& field : layout.fields()) {
      if (!has_unit_column(*field.parameter)) continue;
      units.push_back(only_shown(field.key + "_unit", field.parameter->unit.to_string()));
    }
  }
  if (const auto model = device::RunModel::of(profile); model && (*model)->monitor() != nullptr) {
    const device::MotorMonitor& monitor = *(*model)->monitor();
    units.push_back(only_shown("speed_unit", monitor.speed_unit()));
    units.push_back(only_shown("load_unit", unit_of(monitor.facts().load, profile)));
  }
  return units;
}

std::string missed_text(std::optional<std::uint32_t> missed) {
  if (!missed) return "perhaps events missed";
  if (*missed == 0) return "no event missed";
  return counted(*missed, "event") + " missed";
}

}  // namespace

NewsRecords::NewsRecords(const Target& target, const catalogue::Profile& profile,
                         catalogue::CodeTables tables)
    : target_(&target), profile_(&profile), units_(units_of(profile)), tables_(std::move(tables)) {
  if (!profile.events) return;
  layout_.emplace(profile);
  for (const auto& field : layout_->fields()) {
    if (field.parameter->name == profile.events->error) error_key_ = field.key;
    if (field.parameter->name == profile.events->preset) preset_key_ = field.key;
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
  for (const auto& field : layout_->fields()) {
    if (!catalogue::EventLayout::has(field, news.block)) continue;
    const auto& [parameter, at, key, form] = field;
    const auto words = catalogue::register_count(parameter->encoding);
    const auto value = catalogue::decode(*parameter, RegisterView(news.block).subspan(at, words));
    if (!value) {
      if (parameter->encoding.kind == catalogue::Kind::date) text = "its clock says no date";
      continue;
    }
    record.fields.push_back({key, value_cell(*value), value->to_string()});
    if (key != error_key_) continue;
    std::string meaning = error_text(value->number.mantissa());
    if (value->number.mantissa() != 0) {
      text = fmt::format("E{}{}{}{}{}", value->number.mantissa(), meaning.empty() ? "" : " ",
                         meaning, text.empty() ? "" : "; ", text);
    }
    record.fields.push_back({key + "_text", text_or_null(std::move(meaning))});
  }
  if (has_torque_) {
    record.fields.push_back({"torque_unit", text_or_null(torque_unit_of(news.block))});
  }
  add_steps(record, news.block);
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

std::string NewsRecords::torque_unit_of(const Registers& block) const {
  return layout_->torque_unit_of(block, target_->torque_unit);
}

/// Where the steps of a rundown begin, in samples of its curves.
void NewsRecords::add_steps(Record& record, const Registers& block) const {
  if (!profile_->events->curves) return;
  report::Texts names;
  report::Words samples;
  const auto facts = catalogue::curve_facts(*profile_, *layout_, block, target_->torque_unit);
  for (const catalogue::StepMarker& step : facts.steps) {
    names.push_back(step.name);
    samples.push_back(step.sample);
  }
  record.fields.push_back({"steps", std::move(names)});
  record.fields.push_back({"step_at", std::move(samples)});
}

Record NewsRecords::curve_header(const device::ToolCurve& news, const Naming& naming) const {
  Record record = blank("curve", news.time);
  add_name(record, naming);
  record.fields.push_back({"number", news.number ? number(*news.number) : Cell()});
  record.fields.push_back({"whole", news.is_whole});
  catalogue::CurveFacts facts;
  if (news.block) {
    facts = catalogue::curve_facts(*profile_, *layout_, *news.block, target_->torque_unit);
  }
  const bool says_sampling = facts.sampling_ms != 0;
  record.fields.push_back({"sampling_ms", says_sampling ? number(facts.sampling_ms) : Cell()});
  for (std::size_t at = 0; at < news.channels.size(); ++at) {
    const std::string key = fmt::format("channel_{}", at + 1);
    const auto known = at < facts.channels.size() ? facts.channels[at] : catalogue::ChannelFacts();
    record.fields.push_back({key + "_type", text_or_null(known.name)});
    record.fields.push_back(
        {key + "_is", std::string(catalogue::curve_quantity_words.text(known.is))});
    record.fields.push_back({key + "_unit", text_or_null(known.unit)});
    record.fields.push_back({key + "_count", count(news.channels[at].size() / sizeof(float))});
  }
  if (news.block) {
    add_steps(record, *news.block);
  }
  return record;
}

Record NewsRecords::curve(const device::ToolCurve& news, const Naming& naming) const {
  Record record = curve_header(news, naming);
  std::string counts;
  for (std::size_t at = 0; at < news.channels.size(); ++at) {
    report::Numbers numbers;
    for (const float sample : catalogue::to_samples(news.channels[at])) {
      numbers.push_back(catalogue::to_decimal(sample));
    }
    counts += fmt::format("{}{}", counts.empty() ? "" : " and ", counted(numbers.size(), "sample"));
    record.fields.push_back({fmt::format("channel_{}", at + 1), std::move(numbers)});
  }
  std::string text = news.trouble.empty() ? "curve with " + counts : news.trouble;
  if (!news.block && news.trouble.empty()) text += " of no event that was seen";
  if (news.block && !news.is_whole) text += ", not all that the event counts";
  record.fields.push_back(only_shown("kind", "curve", news.is_whole ? Tone::plain : Tone::bad));
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

void NewsRecords::add_units(Record& record) const {
  record.fields.insert(record.fields.end(), units_.begin(), units_.end());
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

std::vector<report::Column> news_columns(const NewsSources& sources) {
  using report::Align;
  using report::wrapped;
  constexpr std::uint8_t date_and_time = 14;
  constexpr std::uint8_t least = 12;  // "fastening-ok"
  std::vector<report::Column> columns = {{"TIME", "time", Align::left, 24, wrapped(date_and_time)}};
  if (sources.tools == Tools::several) {
    columns.push_back({"TARGET", "target", Align::left, 16, wrapped(least)});
  }
  columns.push_back({"KIND", "kind", Align::left, 16, wrapped(least)});
  for (const catalogue::Profile* profile : sources.profiles) {
    for (report::Column& column : result_columns(*profile, sources)) {
      add_new(columns, std::move(column));
    }
  }
  const bool is_any_pushed =
      std::any_of(sources.profiles.begin(), sources.profiles.end(),
                  [](const auto* profile) { return catalogue::sends_unasked(*profile); });
  report::Room source = report::left_out(1);
  source.usual =
      origin_words.text(is_any_pushed ? device::EventOrigin::push : device::EventOrigin::poll);
  columns.insert(columns.end(), {{"RESULT", "result", Align::left, 6},
                                 {"SOURCE", "source", Align::left, 8, source},
                                 {"TEXT", "text", Align::left, 1, report::below_row()}});
  return columns;
}

void add_new(std::vector<report::Column>& columns, report::Column column) {
  const bool is_there = std::any_of(columns.begin(), columns.end(),
                                    [&](const auto& other) { return other.key == column.key; });
  if (!is_there) columns.push_back(std::move(column));
}

void add_event_fields(std::vector<report::Column>& columns, const catalogue::Profile& profile) {
  if (!profile.events) return;
  const catalogue::EventLayout layout(profile);
  for (const auto& field : layout.fields()) {
    add_new(columns, {field.key, field.key});
    if (field.parameter->name == profile.events->error) {
      add_new(columns, {field.key, field.key + "_text"});
    }
    if (has_unit_column(*field.parameter)) add_new(columns, {field.key, field.key + "_unit"});
  }
}

std::vector<report::Column> exchange_columns(
    const std::vector<const catalogue::Profile*>& profiles) {
  std::vector<report::Column> columns;
  const auto add = [&columns](std::initializer_list<const char*> keys) {
    for (const char* key : keys) add_new(columns, {key, key});
  };
  add({"time", "target", "name", "value", "unit", "raw", "label", "previous", "type", "kind",
       "result", "source", "serial", "epoch", "id", "remembered"});
  for (const catalogue::Profile* profile : profiles) {
    add_event_fields(columns, *profile);
    if (device::has_motor(*profile)) {
      add({"speed", "speed_unit", "command_speed", "load", "load_unit", "alarm", "alarm_text",
           "warning", "warning_text"});
    }
  }
  add({"torque_unit", "state", "attempt", "message", "missed", "after", "before", "reason",
       "text"});
  return columns;
}

}  // namespace spindle::commands
