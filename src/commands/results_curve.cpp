#include "results_curve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "listing.hpp"
#include "records.hpp"
#include "result_key.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/curve.hpp"
#include "stored_choice.hpp"
#include "stored_curves.hpp"

namespace spindle::commands {
namespace {

using report::Record;

/// What is needed of the event that the curves belong to.
struct Found {
  store::RowId id = 0;
  WallTime at = {};
  bool is_ng = false;
};

Error no_curve(const std::string& key, std::string message, std::string hint) {
  return {.code = Errc::unknown_name,
          .message = std::move(message),
          .hint = std::move(hint),
          .name = key};
}

/// Tools of two makers may have one serial number; then it is the one that has the event.
Result<Found> find_event(const std::string& text, store::Reader& reader,
                         const StoredRecords& records) {
  const auto key = parse_result_key(text);
  if (!key) {
    return tl::unexpected(bad_option("--curve", fmt::format("'{}' names no result", text),
                                     std::string(result_key_hint)));
  }
  store::Filter filter = {.epoch = key->epoch, .number = key->number};
  for (const store::Tool& tool : records.tools()) {
    if (tool.name.serial == key->serial) filter.tools.push_back(tool.id);
  }
  std::optional<Found> found;
  if (!filter.tools.empty()) {
    TRY(reader.events(filter, [&](const store::EventView& row) {
      found = Found{.id = row.id, .at = row.at, .is_ng = row.kind == "fastening-ng"};
      return true;
    }));
  }
  if (found) return *found;
  return tl::unexpected(no_curve(text, "no such result is stored",
                                 "'spindle results --json' shows serial, epoch and number"));
}

/// A line for each sample, its channels beside each other.
Result<Outcome> list_samples(const StoredCurve& curve, WallTime at, Context& context) {
  std::vector<report::Column> columns = {{"SAMPLE", "sample", report::Align::right, 6},
                                         {"TIME_MS", "time_ms", report::Align::right, 8}};
  std::size_t samples = 0;
  for (std::size_t channel = 0; channel < curve.channels.size(); ++channel) {
    const StoredCurve::Channel& one = curve.channels[channel];
    const std::string name = one.type.empty() ? fmt::format("CHANNEL_{}", channel + 1) : one.type;
    columns.push_back({one.unit.empty() ? name : fmt::format("{} [{}]", name, one.unit),
                       fmt::format("channel_{}", channel + 1), report::Align::right, 10});
    samples = std::max(samples, one.samples.size());
  }
  columns.push_back({"STEP", "step", report::Align::left, 1});
  Listing listing(context, columns);
  for (std::size_t sample = 0; sample < samples && listing.open(); ++sample) {
    Record record{.type = "sample", .target = curve.header.target, .time = at, .fields = {}};
    record.fields.push_back({"sample", count(sample)});
    const auto time = Decimal(static_cast<std::int64_t>(curve.sampling_ms * 1000.0), -3)
                          .times(Decimal(static_cast<std::int64_t>(sample)));
    record.fields.push_back(
        {"time_ms", curve.sampling_ms > 0 && time ? report::Cell(*time) : report::Cell()});
    for (std::size_t channel = 0; channel < curve.channels.size(); ++channel) {
      const auto& values = curve.channels[channel].samples;
      const auto value =
          sample < values.size() ? catalogue::to_decimal(values[sample]) : std::nullopt;
      record.fields.push_back(
          {fmt::format("channel_{}", channel + 1), value ? report::Cell(*value) : report::Cell()});
    }
    const auto step = std::find_if(curve.steps.begin(), curve.steps.end(),
                                   [&](const auto& one) { return one.sample == sample; });
    record.fields.push_back(
        {"step", text_or_null(step == curve.steps.end() ? std::string() : step->name)});
    listing.add(record);
  }
  Outcome outcome;
  outcome.succeed();
  return finish(listing, outcome,
                {.counts = {{"samples", count(samples)}}, .sentence = counted(samples, "sample")},
                context);
}

/// Torque over angle, or over time where no angle was recorded.
Result<Outcome> draw(const StoredCurve& curve, const std::string& key, bool is_ng,
                     Context& context) {
  chart::Curve drawn = drawn_curve(curve, CurveAxis::angle, key, is_ng);
  CurveAxis axis = CurveAxis::angle;
  if (drawn.points.empty()) {
    axis = CurveAxis::time;
    drawn = drawn_curve(curve, axis, key, is_ng);
  }
  if (drawn.points.empty()) {
    return tl::unexpected(no_curve(key, "there is no torque among its channels",
                                   "'-o csv' writes the samples that there are"));
  }
  chart::Curves figure = {.caption = {.title = fmt::format("Torque of {}", key)},
                          .x = quantity_along(curve, axis),
                          .y = torque_of(curve),
                          .curves = {std::move(drawn)},
                          .steps = drawn_steps(curve, axis)};
  TRY(context.io.out(chart::curves(figure) + "\n"));
  Outcome outcome;
  outcome.succeed();
  return outcome;
}

}  // namespace

Result<Outcome> show_curve(const ResultsOptions& options, store::Reader& reader,
                           const StoredRecords& records, Context& context) {
  TRY_LET(const auto event, find_event(options.curve, reader, records));
  TRY_LET(const auto row, reader.curve(event.id));
  if (!row) {
    return tl::unexpected(no_curve(options.curve, "no curve of this result is stored",
                                   "only what a tool sends unasked is recorded"));
  }
  const auto curve = stored_curve(*row);
  if (!curve) {
    return tl::unexpected(Error{.code = Errc::bad_file,
                                .message = "its stored curve cannot be understood",
                                .hint = "'spindle store check' says what is damaged",
                                .name = options.curve});
  }
  if (context.user.format == report::Format::svg) {
    return draw(*curve, options.curve, event.is_ng, context);
  }
  if (context.user.format != report::Format::json) return list_samples(*curve, event.at, context);
  const std::vector<report::Column> none;
  Listing listing(context, none);
  listing.add(curve_record(*curve));
  Outcome outcome;
  outcome.succeed();
  return finish(listing, outcome, {.counts = {{"curves", count(1)}}, .sentence = "1 curve"},
                context);
}

}  // namespace spindle::commands
