#include "alarm_report.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "listing.hpp"
#include "records.hpp"

namespace spindle::commands {
namespace {

using catalogue::Parameter;
using catalogue::Profile;
using report::Column;

constexpr std::string_view present_list = "present";

const std::array<Column, 5> columns = {
    {{"LIST", "list"},
     {"INDEX", "index", report::Align::right},
     {"CODE", "code", report::Align::right},
     {"TEXT", "text", report::Align::left, 0, report::wrapped(16)},
     {"REMEDY", "remedy", report::Align::left, 0, report::wrapped(20)}}};

report::Record alarm_record(const AlarmSource& source, std::size_t index,
                            const catalogue::Value& value, const catalogue::CodeText* text,
                            const Target& target, const Clock& clock) {
  const std::int64_t code = value.number.mantissa();
  const bool is_free = code == 0 && source.table != catalogue::CodeTable::none;
  const bool is_present = code != 0 && source.list == present_list;
  const std::string meaning = text != nullptr ? text->text.to_string() : is_free ? "none" : "";
  return {.type = "alarm",
          .target = target.shown,
          .time = clock.wall(),
          .fields = {{"list", source.list},
                     {"index", count(index)},
                     {.key = "code",
                      .cell = number(code),
                      .shown = value.to_string(),
                      .tone = is_present ? report::Tone::bad : report::Tone::plain},
                     {.key = "text",
                      .cell = text_or_null(meaning),
                      .tone = is_present ? report::Tone::bad : report::Tone::plain},
                     {"remedy", text_or_null(text != nullptr ? text->remedy : "")}}};
}

/// The meaning of a code by the table of its list; null when it is not known.
const catalogue::CodeText* text_of(std::int64_t code, catalogue::CodeTable table,
                                   const catalogue::CodeTables& tables, const OpenTool& tool) {
  const auto& refusals = tool.profile->refusals;
  const catalogue::CodeTexts* texts = &tables.error;
  if (table == catalogue::CodeTable::none) return nullptr;
  if (table == catalogue::CodeTable::warning) texts = &tables.warning;
  if (table == catalogue::CodeTable::refusal && refusals) texts = &refusals->codes;
  return texts->find(code);
}

/// Whether places without an alarm are listed, too.
enum class Zeros : std::uint8_t { listed, left_out };

/// One code of a list, told and remembered.
void tell(const AlarmSource& source, std::size_t index, const device::Reading& reading,
          const catalogue::CodeTables& tables, const OpenTool& tool, AlarmReport& report,
          Listing& listing, Zeros shown, const Clock& clock) {
  const bool tells_present = source.list == present_list;
  report.was_asked = report.was_asked || tells_present;
  if (!reading.value) {
    report.was_told = report.was_told && !tells_present;
    report.outcome.fail(reading.value.error());
    listing.add(reading.value.error());
    return;
  }
  report.outcome.succeed();
  // The rest of a history that is not full says nothing.
  const bool unused = index > 1 && reading.value->number == Decimal(0);
  if (unused && source.table != catalogue::CodeTable::none) return;
  const catalogue::CodeText* text =
      text_of(reading.value->number.mantissa(), source.table, tables, tool);
  if (tells_present && !report.was_present()) {
    report.present = *reading.value;
    if (text != nullptr) report.resettable = text->resettable;
  }
  // A table of a tool that is well would be a list of nothing.
  if (reading.value->number == Decimal(0) && shown == Zeros::left_out) return;
  listing.add(alarm_record(source, index, *reading.value, text, tool.target, clock));
}

}  // namespace

/// The present alarm is what proves a reset.
Result<std::vector<AlarmSource>> alarm_sources(const Profile& profile) {
  std::vector<AlarmSource> sources;
  for (const catalogue::AlarmList& list : profile.alarm_lists) {
    auto parameters = profile.select(to_strings(list.parameters));
    if (!parameters) return tl::unexpected(std::move(parameters.error()));
    for (Parameter& parameter : *parameters) {
      sources.push_back({list.name, std::move(parameter), list.codes});
    }
  }
  if (!sources.empty()) return sources;
  return tl::unexpected(
      Error{.code = Errc::usage,
            .message = fmt::format("profile {} names no alarms", profile.id),
            .hint = "'alarm-lists' in the profile names what is shown, see spindle-profile(5)"});
}

Result<void> show_alarms(const std::vector<AlarmSource>& sources, OpenTool& tool,
                         AlarmReport& report, Context& context) {
  const auto tables = context.profiles.load_code_tables(tool.profile->path);
  if (!tables) return tl::unexpected(tables.error());
  std::vector<Parameter> parameters;
  parameters.reserve(sources.size());
  for (const AlarmSource& source : sources) parameters.push_back(source.parameter);
  const auto readings = tool.device.read_each(parameters, device::Limits::skip);
  if (!readings) return tl::unexpected(readings.error());
  Listing listing(context, columns);
  const Zeros zeros = report::is_table(context.user.format) ? Zeros::left_out : Zeros::listed;
  std::size_t index = 0;
  for (std::size_t at = 0; at < readings->size(); ++at) {
    const AlarmSource& source = sources[at];
    index = at > 0 && sources[at - 1].list == source.list ? index + 1 : 1;
    tell(source, index, (*readings)[at], *tables, tool, report, listing, zeros, context.clock);
  }
  return listing.end();
}

std::string sentence_of(const AlarmReport& report) {
  switch (report.reset) {
    case AlarmReport::Reset::done:
      return "no alarm present";
    case AlarmReport::Reset::failed:
      return "the alarm was not reset";
    case AlarmReport::Reset::none:
      break;
  }
  if (!report.is_known()) return "whether an alarm is present is not known";
  if (!report.is_present()) return "no alarm present";
  return fmt::format("alarm {} is present", report.present.to_string());
}

}  // namespace spindle::commands
