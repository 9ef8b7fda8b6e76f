#include "records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"

namespace spindle::commands {
namespace {

using catalogue::Parameter;
using report::Align;
using report::Cell;
using report::Column;
using report::Field;
using report::left_out;
using report::wrapped;

Cell number_or_null(const std::optional<Decimal>& value) {
  return value ? Cell(*value) : Cell(std::monostate());
}

Cell number_or_null(const std::optional<catalogue::Value>& value) {
  return value ? value_cell(*value) : Cell(std::monostate());
}

/// "bit 3 FWD (while motor.input-mode is 0)"; the condition only where there is one.
std::string bit_text(const catalogue::BitName& bit, const Parameter& parameter) {
  const std::string place = bit.width == 1
                                ? fmt::format("bit {}", bit.bit)
                                : fmt::format("bits {}..{}", bit.bit, bit.bit + bit.width - 1);
  if (!bit.when) return fmt::format("{} {}", place, bit.text);
  return fmt::format("{} {} while {} is {}", place, bit.text, parameter.bits_by, *bit.when);
}

/// All names of a bit field; of a part of it only its own.
report::Texts bits_of(const Parameter& parameter) {
  report::Texts bits;
  bits.reserve(parameter.bits.size());
  for (const auto& bit : parameter.bits) {
    const bool is_meant =
        parameter.part.empty() || same_ignoring_case(bit.text, parameter.part.view());
    if (is_meant) bits.push_back(bit_text(bit, parameter));
  }
  return bits;
}

/// What it means, with the labels of an enumeration or the bits of a bit field behind it.
std::string meaning_of(const Parameter& parameter, const report::Texts& bits) {
  if (parameter.labels.empty() && parameter.bits.empty()) return {};
  std::string text = parameter.title + " (";
  std::string_view between;
  const auto add = [&](const std::string& part) {
    text.append(between).append(part);
    between = ", ";
  };
  for (const std::string& bit : bits) add(bit);
  for (const auto& label : parameter.labels) add(std::to_string(label.number) + " " + label.text);
  return text + ")";
}

/// What only some products say of their parameters.
void add_drive_fields(const Parameter& parameter, report::Texts bits, report::Record& record) {
  if (!bits.empty()) record.fields.push_back({"bits", std::move(bits)});
  if (parameter.except) {
    record.fields.push_back({"except_minimum", number_or_null(parameter.except->minimum)});
    record.fields.push_back({"except_maximum", number_or_null(parameter.except->maximum)});
  }
  if (parameter.effect) {
    record.fields.push_back({"effect", std::string(catalogue::to_text(*parameter.effect))});
  }
  if (!parameter.risk.empty()) record.fields.push_back({"risk", parameter.risk});
}

/// What only some encodings have.
void add_encoding_fields(const catalogue::Encoding& encoding, report::Record& record) {
  const auto add = [&](const char* key, std::int64_t value, std::int64_t usual) {
    if (value != usual) record.fields.push_back({key, number(value)});
  };
  add("divisor", encoding.divisor, 1);
  if (encoding.offset != Decimal(0)) record.fields.push_back({"offset", encoding.offset});
  add("length", encoding.length, 0);
  add("count", encoding.count, 1);
  if (encoding.is_part()) record.fields.push_back({"first_bit", number(encoding.slice.first)});
  add("bit_count", encoding.slice.width, 0);
}

/// What may be given: nothing (a fixed value), labels, or a range.
std::string values_of(const catalogue::Action& action) {
  if (action.motion != catalogue::Motion::none) return {};
  std::vector<std::string> texts;
  for (const auto& label : action.labels) {
    texts.push_back(fmt::format("{} {}", label.number, label.text));
  }
  const bool ranged = action.labels.empty() || action.has_range;
  if (action.value) {
    if (texts.empty()) texts.push_back(std::to_string(*action.value));
  } else if (ranged) {
    texts.push_back(fmt::format("{}..{}", action.minimum, action.maximum));
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

/// The type as people read it: "u16", "u16 * 0.01".
std::string type_of(const catalogue::Encoding& encoding) {
  const std::string_view kind = catalogue::to_text(encoding.kind);
  const std::string step = catalogue::step_in_words(encoding);
  std::string type(kind);
  if (encoding.length > 0) type += std::to_string(encoding.length);
  if (encoding.count > 1) type += fmt::format("[{}]", encoding.count);
  if (!encoding.slice.is_whole()) {
    const unsigned last = unsigned{encoding.slice.first} + encoding.slice.width - 1;
    const std::string bits = encoding.slice.width == 1
                                 ? fmt::format("bit {}", last)
                                 : fmt::format("bits {}..{}", encoding.slice.first, last);
    type = encoding.kind == catalogue::Kind::bit ? bits : fmt::format("{} {}", type, bits);
  }
  if (step != "1") type += " * " + step;
  if (encoding.offset != Decimal(0)) {
    const bool is_minus = encoding.offset.sign() == Sign::minus;
    type += fmt::format(" {} {}", is_minus ? '-' : '+',
                        (is_minus ? encoding.offset.negated() : encoding.offset).to_string());
  }
  return type == kind ? std::string() : type;
}

}  // namespace

Cell value_cell(const catalogue::Value& value) {
  switch (value.content) {
    case catalogue::Content::number:
      return value.shown_number();
    case catalogue::Content::text:
      return value.text;
    case catalogue::Content::list: {
      report::Numbers numbers;
      report::Texts texts;
      for (const catalogue::Value& one : value.elements) {
        const bool is_number = one.is_number();
        numbers.push_back(is_number ? std::optional(one.shown_number()) : std::nullopt);
        if (one.content == catalogue::Content::text) texts.push_back(one.text);
      }
      return texts.empty() ? Cell(numbers) : Cell(texts);
    }
    case catalogue::Content::raw:
      return value.label;
    case catalogue::Content::none:
      break;
  }
  return {};
}

Cell milliseconds(Duration duration) {
  const auto micros = std::chrono::duration_cast<std::chrono::microseconds>(duration);
  return Decimal(micros.count(), -3);
}

report::Record value_record(const device::Reading& reading, const Target& target,
                            const Clock& clock, const GetOptions& options) {
  const Parameter& parameter = reading.parameter;
  const bool is_hidden =
      parameter.secrecy == catalogue::Secrecy::secret && options.secrets == Secrets::leave_out;
  const auto& value = *reading.value;
  report::Record record{
      .type = "value", .target = target.shown, .time = clock.wall(), .fields = {}};
  record.fields = {{"name", parameter.name},
                   {"table", std::string(catalogue::to_text(parameter.table))},
                   {"register", number(parameter.address.value)},
                   {"raw", is_hidden ? Registers() : *reading.registers},
                   {"value", is_hidden ? Cell() : value_cell(value),
                    is_hidden ? shown_of(parameter, value) : value.to_string()},
                   {"label", is_hidden ? Cell() : text_or_null(value.label)},
                   {"unit", text_or_null(unit_of(parameter, target))}};
  if (is_hidden) record.fields.push_back({"secret", true, "yes"});
  if (options.limits == device::Limits::read) {
    record.fields.push_back({"minimum", number_or_null(reading.minimum)});
    record.fields.push_back({"maximum", number_or_null(reading.maximum)});
  }
  return record;
}

std::span<const Column> value_columns(device::Limits limits) {
  using report::only_wide;
  static const std::array<Column, 9> columns = {{{"TIME", "time", Align::left, 0, only_wide()},
                                                 {"TARGET", "target", Align::left, 0, only_wide()},
                                                 {"NAME", "name"},
                                                 {"VALUE", "value", Align::right},
                                                 {"UNIT", "unit"},
                                                 {"RAW", "raw", Align::right, 0, only_wide()},
                                                 {"LABEL", "label", Align::left, 0, only_wide()},
                                                 {"MINIMUM", "minimum", Align::right},
                                                 {"MAXIMUM", "maximum", Align::right}}};
  return std::span(columns).first(limits == device::Limits::read ? 9 : 7);
}

report::Record parameter_record(const Parameter& parameter, const std::string& target,
                                const Clock& clock) {
  report::Texts bits = bits_of(parameter);
  report::Pairs labels;
  labels.reserve(parameter.labels.size());
  for (const auto& label : parameter.labels) {
    labels.emplace_back(std::to_string(label.number), label.text);
  }
  report::Record record{.type = "parameter", .target = target, .time = clock.wall(), .fields = {}};
  constexpr std::size_t most_fields = 24;  // a list is long: each record is made in one piece
  record.fields.reserve(most_fields);
  const auto add = [&](const char* key, report::Cell&& cell, std::string&& shown = {}) {
    record.fields.emplace_back(key, std::move(cell), std::move(shown));
  };
  add("name", parameter.name.to_string());
  add("title", parameter.title.to_string(), meaning_of(parameter, bits));
  add("table", std::string(catalogue::to_text(parameter.table)));
  add("register", number(parameter.address.value));
  add("encoding", std::string(catalogue::to_text(parameter.encoding.kind)),
      type_of(parameter.encoding));
  add("scale", parameter.encoding.scale);
  add("unit", text_or_null(parameter.unit));
  add("minimum", number_or_null(parameter.range.minimum));
  add("maximum", number_or_null(parameter.range.maximum));
  add("default", number_or_null(parameter.default_value));
  add("labels", std::move(labels));
  add("access", std::string(catalogue::to_text(parameter.access)));
  add("evidence", std::string(catalogue::to_text(parameter.evidence)));
  add("source", parameter.source.to_string());
  add("note", text_or_null(parameter.note));
  add_encoding_fields(parameter.encoding, record);
  add_drive_fields(parameter, std::move(bits), record);
  if (parameter.hazard != catalogue::Hazard::none) {
    record.fields.push_back({"hazard", std::string(catalogue::to_text(parameter.hazard))});
  }
  if (parameter.guarding == catalogue::Guarding::alone) record.fields.push_back({"guarded", true});
  if (parameter.secrecy == catalogue::Secrecy::secret) record.fields.push_back({"secret", true});
  return record;
}

std::vector<Column> parameter_columns(std::span<const Parameter> parameters) {
  std::vector<Column> columns = {{{"NAME", "name"},
                                  {"TABLE", "table", Align::left, 0, left_out(1)},
                                  {"REGISTER", "register", Align::right, 0, left_out(4)},
                                  {"TYPE", "encoding", Align::left, 0, left_out(3)},
                                  {"MINIMUM", "minimum", Align::right},
                                  {"MAXIMUM", "maximum", Align::right},
                                  {"UNIT", "unit"},
                                  {"ACCESS", "access", Align::left, 0, left_out(5)},
                                  {"EVIDENCE", "evidence", Align::left, 0, left_out(2)},
                                  {"MEANING", "title", Align::left, 0, wrapped(24)}}};
  const bool any = std::any_of(parameters.begin(), parameters.end(),
                               [](const Parameter& one) { return one.effect.has_value(); });
  if (any)
    columns.insert(columns.end() - 1, {"TAKES EFFECT", "effect", Align::left, 0, left_out(6)});
  return columns;
}

report::Record action_record(const catalogue::Action& action, const std::string& target,
                             const Clock& clock) {
  report::Record record{.type = "action",
                        .target = target,
                        .time = clock.wall(),
                        .fields = {{"action", action.name},
                                   {"title", action.title},
                                   {"register", number(action.address.value)},
                                   {"values", values_of(action)},
                                   {"hazard", std::string(catalogue::to_text(action.hazard))},
                                   {"evidence", std::string(catalogue::to_text(action.evidence))},
                                   {"source", action.source},
                                   {"check", text_or_null(action.check)},
                                   {"confirm", text_or_null(action.confirm)}}};
  if (!action.note.empty()) record.fields.push_back({"note", action.note});
  return record;
}

std::span<const Column> action_columns() {
  static const std::array<Column, 7> columns = {
      {{"ACTION", "action"},
       {"REGISTER", "register", Align::right, 0, left_out(2)},
       {"VALUES", "values", Align::left, 0, wrapped(16)},
       {"HAZARD", "hazard"},
       {"EVIDENCE", "evidence", Align::left, 0, left_out(3)},
       {"SOURCE", "source", Align::left, 0, left_out(1)},
       {"MEANING", "title", Align::left, 0, wrapped(24)}}};
  return columns;
}

report::Record summary_record(std::vector<Field> counts, ExitStatus status,
                              const std::string& target, const Clock& clock) {
  counts.push_back({"exit_status", number(static_cast<std::int64_t>(status))});
  return {.type = "summary", .target = target, .time = clock.wall(), .fields = std::move(counts)};
}

}  // namespace spindle::commands
