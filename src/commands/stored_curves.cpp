#include "stored_curves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "spindle/catalogue/curve.hpp"

namespace spindle::commands {
namespace {

using catalogue::CurveQuantity;
using report::Record;

constexpr std::size_t sample_size = 4;
/// No product has more.
constexpr std::size_t most_channels = 16;

std::string text_of(const Record& record, const std::string& key) {
  const report::Field* field = record.find(key);
  const auto* text = field == nullptr ? nullptr : std::get_if<std::string>(&field->cell);
  return text == nullptr ? std::string() : *text;
}

std::optional<std::int64_t> number_of(const Record& record, const std::string& key) {
  const report::Field* field = record.find(key);
  const auto* value = field == nullptr ? nullptr : std::get_if<Decimal>(&field->cell);
  return value == nullptr ? std::nullopt : value->divided_by(Decimal(1));
}

/// False where the bytes end before the samples.
bool add_channels(StoredCurve& curve, ByteView bytes) {
  for (std::size_t channel = 1; channel <= most_channels; ++channel) {
    const std::string key = fmt::format("channel_{}", channel);
    const auto samples = number_of(curve.header, key + "_count");
    if (!samples) break;
    const auto size = sample_size * static_cast<std::size_t>(std::max<std::int64_t>(*samples, 0));
    if (size > bytes.size()) return false;
    const auto is = catalogue::curve_quantity_words.find(text_of(curve.header, key + "_is"));
    curve.channels.push_back({.type = text_of(curve.header, key + "_type"),
                              .is = is.value_or(CurveQuantity::other),
                              .unit = text_of(curve.header, key + "_unit"),
                              .samples = catalogue::to_samples(bytes.first(size))});
    bytes = bytes.subspan(size);
  }
  return bytes.empty();
}

void add_steps(StoredCurve& curve) {
  const report::Field* names = curve.header.find("steps");
  const report::Field* places = curve.header.find("step_at");
  if (names == nullptr || places == nullptr) return;
  const auto* words = std::get_if<report::Texts>(&names->cell);
  const auto* samples = std::get_if<report::Numbers>(&places->cell);
  if (words == nullptr || samples == nullptr) return;
  for (std::size_t at = 0; at < std::min(words->size(), samples->size()); ++at) {
    const auto place = (*samples)[at].value_or(Decimal(-1)).divided_by(Decimal(1));
    const std::int64_t sample = place.value_or(-1);
    if (sample < 0) continue;
    curve.steps.push_back({.name = (*words)[at], .sample = static_cast<std::size_t>(sample)});
  }
}

const StoredCurve::Channel* channel_of(const StoredCurve& curve, CurveQuantity quantity) {
  const auto found = std::find_if(curve.channels.begin(), curve.channels.end(),
                                  [quantity](const auto& one) { return one.is == quantity; });
  return found == curve.channels.end() || found->samples.empty() ? nullptr : &*found;
}

const StoredCurve::Channel* torque_channel(const StoredCurve& curve) {
  const auto* torque = channel_of(curve, CurveQuantity::torque);
  return torque != nullptr ? torque : channel_of(curve, CurveQuantity::torque_over_angle);
}

/// Where a sample stands along the axis; empty: nowhere.
std::optional<double> place_of(const StoredCurve& curve, CurveAxis axis, std::size_t sample) {
  if (axis == CurveAxis::time) {
    return static_cast<double>(sample) * (curve.sampling_ms > 0 ? curve.sampling_ms : 1.0);
  }
  if (const auto* angle = channel_of(curve, CurveQuantity::angle)) {
    if (sample >= angle->samples.size()) return std::nullopt;
    return static_cast<double>(angle->samples[sample]);
  }
  if (channel_of(curve, CurveQuantity::torque_over_angle) == nullptr) return std::nullopt;
  return static_cast<double>(sample);
}

}  // namespace

std::optional<StoredCurve> stored_curve(const store::Curve& row) {
  auto header = report::record_of(row.channels, row.at);
  if (!header) return std::nullopt;
  for (report::Field& field : header->fields) {
    if (field.key == "epoch") field.cell = report::number(row.epoch);
  }
  StoredCurve curve = {.header = std::move(*header)};
  constexpr double us_in_ms = 1000;
  curve.sampling_ms = static_cast<double>(row.interval_us) / us_in_ms;
  if (!add_channels(curve, row.samples)) return std::nullopt;
  add_steps(curve);
  return curve;
}

Record curve_record(const StoredCurve& curve) {
  Record record = curve.header;
  for (std::size_t at = 0; at < curve.channels.size(); ++at) {
    report::Numbers numbers;
    for (const float sample : curve.channels[at].samples) {
      numbers.push_back(catalogue::to_decimal(sample));
    }
    record.fields.push_back({fmt::format("channel_{}", at + 1), std::move(numbers)});
  }
  return record;
}

chart::Curve drawn_curve(const StoredCurve& curve, CurveAxis axis, std::string name, bool is_ng) {
  chart::Curve drawn = {.name = std::move(name), .points = {}, .is_ng = is_ng};
  const StoredCurve::Channel* torque = torque_channel(curve);
  // The samples of a channel of torque over angle are no moments.
  const bool is_of_angle = torque != nullptr && torque->is == CurveQuantity::torque_over_angle;
  if (torque == nullptr || (is_of_angle && axis == CurveAxis::time)) return drawn;
  for (std::size_t at = 0; at < torque->samples.size(); ++at) {
    const auto place = place_of(curve, axis, at);
    if (!place) break;
    drawn.points.push_back({.x = *place, .y = static_cast<double>(torque->samples[at])});
  }
  return drawn;
}

std::vector<chart::StepMark> drawn_steps(const StoredCurve& curve, CurveAxis axis) {
  std::vector<chart::StepMark> marks;
  const StoredCurve::Channel* torque = torque_channel(curve);
  for (const StoredCurve::Step& step : curve.steps) {
    if (torque == nullptr || step.sample >= torque->samples.size()) continue;
    const auto place = place_of(curve, axis, step.sample);
    if (place) marks.push_back({.at = *place, .word = step.name});
  }
  return marks;
}

chart::Quantity quantity_along(const StoredCurve& curve, CurveAxis axis) {
  const chart::Quantity sample = {.name = "Sample", .unit = {}, .decimals = 0};
  if (axis == CurveAxis::time) {
    return curve.sampling_ms > 0 ? chart::Quantity{.name = "Time", .unit = "ms", .decimals = 0}
                                 : sample;
  }
  const StoredCurve::Channel* angle = channel_of(curve, CurveQuantity::angle);
  return angle == nullptr ? sample
                          : chart::Quantity{.name = "Angle", .unit = angle->unit, .decimals = 0};
}

chart::Quantity torque_of(const StoredCurve& curve) {
  const StoredCurve::Channel* torque = torque_channel(curve);
  return {
      .name = "Torque", .unit = torque == nullptr ? std::string() : torque->unit, .decimals = 2};
}

}  // namespace spindle::commands
