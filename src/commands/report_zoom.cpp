#include "report_zoom.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "spindle/base/json.hpp"

namespace spindle::commands {
namespace {

/// More samples than a screen has columns, and still a small page.
constexpr std::size_t most_samples = 6000;

constexpr std::string_view policy =
    "default-src 'none'; style-src 'unsafe-inline'; "
    "script-src 'sha256-GcjUxq2Ikpp59K5J1vcWFWbf0Lo9FcxJXpdPeH63jx8=' "
    "'sha256-31L2CGY0LRWSQBNJB/e4PjUvBHqjedR8DdpNMfgYqf0='";

constexpr std::string_view script = R"zoom(
"use strict";
for (const place of document.querySelectorAll(".zoom")) {
  const data = JSON.parse(place.querySelector("script").textContent);
  const target = place.querySelector(".zoom-chart");
  const shifted = (seconds) => {
    const utc = new Date(seconds * 1e3);
    return new Date((seconds + data.offset * 60 + utc.getTimezoneOffset() * 60) * 1e3);
  };
  const two = (number) => String(number).padStart(2, "0");
  const clock = (seconds) => {
    const at = shifted(seconds);
    return two(at.getHours()) + ":" + two(at.getMinutes());
  };
  const day = (seconds) => {
    const at = shifted(seconds);
    return at.getFullYear() + "-" + two(at.getMonth() + 1) + "-" + two(at.getDate());
  };
  const moment = (seconds) => day(seconds) + " " + clock(seconds) + ":" + two(shifted(seconds).getSeconds());
  const ticks = (_, splits) => splits.map((at, index) => {
    const isNewDay = index === 0 || day(at) !== day(splits[index - 1]);
    return isNewDay ? clock(at) + "\n" + day(at) : clock(at);
  });
  const drawLevels = (plot) => {
    const pen = plot.ctx;
    pen.save();
    pen.beginPath();
    pen.rect(plot.bbox.left, plot.bbox.top, plot.bbox.width, plot.bbox.height);
    pen.clip();
    pen.setLineDash([8, 4]);
    pen.lineWidth = 2;
    for (const level of data.levels) {
      const y = plot.valToPos(level.value, "y", true);
      const from = level.from === null ? plot.bbox.left : plot.valToPos(level.from, "x", true);
      const to = level.to === null ? plot.bbox.left + plot.bbox.width : plot.valToPos(level.to, "x", true);
      pen.strokeStyle = level.limit ? "#a65b00" : "#2f6b3a";
      pen.beginPath();
      pen.moveTo(from, y);
      pen.lineTo(to, y);
      pen.stroke();
    }
    pen.restore();
  };
  const line = (label, color, values, isMark) => ({
    label,
    stroke: color,
    width: isMark ? 0 : 1,
    paths: isMark ? () => null : undefined,
    points: isMark ? { show: true, size: 6, fill: color } : { size: 4 },
    value: (plot, _, series, index) =>
      index === null || values[index] === null ? "\u2013" : values[index].toFixed(data.decimals),
  });
  const options = {
    title: data.title,
    width: Math.min(place.clientWidth, 960),
    height: 320,
    scales: { x: { time: data.time }, y: { range: () => [data.low, data.high] } },
    series: [
      data.time ? { label: "Time", value: (_, at) => (at === null ? "\u2013" : moment(at)) } : { label: "Result" },
      line("OK", "#28618d", data.ok, false),
      line("NG", "#b42318", data.ng, true),
    ],
    axes: [data.time ? { values: ticks } : {}, { label: data.name, size: 70 }],
    hooks: { draw: [drawLevels] },
  };
  place.classList.add("zoom-on");
  // What lies outside of the scale stands at its edge; the legend has the value.
  const atEdge = (value) => (value === null ? null : Math.min(Math.max(value, data.low), data.high));
  const plot = new uPlot(options, [data.x, data.ok, data.ng.map(atEdge)], target);
  window.addEventListener("resize", () => {
    plot.setSize({ width: Math.min(place.clientWidth, 960), height: 320 });
  });
}
)zoom";

bool is_drawn(const chart::Sample& sample) { return std::isfinite(sample.value); }

/// Of each so many neighbours the smallest and the largest OK one, and every NG one.
std::vector<chart::Sample> thinned(std::span<const chart::Sample> samples) {
  std::vector<chart::Sample> kept;
  const std::size_t bucket = std::max<std::size_t>(samples.size() * 2 / most_samples, 1);
  for (std::size_t first = 0; first < samples.size(); first += bucket) {
    const auto part = samples.subspan(first, std::min(bucket, samples.size() - first));
    std::size_t least = part.size();
    std::size_t most = part.size();
    std::size_t ng = part.size();
    for (std::size_t at = 0; at < part.size(); ++at) {
      if (!is_drawn(part[at])) continue;
      if (part[at].is_ng) {
        if (ng == part.size() || part[at].value < part[ng].value) ng = at;
        continue;
      }
      if (least == part.size() || part[at].value < part[least].value) least = at;
      if (most == part.size() || part[at].value > part[most].value) most = at;
    }
    // A pause stays one: what is no number ends the line.
    const bool is_interrupted = std::any_of(
        part.begin(), part.end(), [](const chart::Sample& each) { return each.is_first; });
    if (is_interrupted && !kept.empty()) {
      chart::Sample nothing = kept.back();
      nothing.value = std::nan("");
      kept.push_back(nothing);
    }
    std::vector<std::size_t> chosen = {least, most, ng};
    std::sort(chosen.begin(), chosen.end());
    chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
    for (const std::size_t at : chosen) {
      if (at < part.size()) kept.push_back(part[at]);
    }
  }
  return kept;
}

/// JSON that stands within a <script>: nothing in it ends the element.
std::string text_of(std::string_view text) {
  std::string json;
  append_json_string(json, text);
  std::string safe;
  for (const char c : json) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string place_of(std::int64_t at, bool is_time) {
  return is_time ? fmt::format("{:.3f}", static_cast<double>(at) / 1000) : std::to_string(at);
}

/// What the figure shows: the good values and the levels with some room.
std::pair<double, double> range_of(std::span<const chart::Sample> samples,
                                   const std::vector<chart::Level>& levels) {
  std::vector<double> values;
  for (const chart::Sample& sample : samples) {
    if (!sample.is_ng && is_drawn(sample)) values.push_back(sample.value);
  }
  for (const chart::Level& level : levels) values.push_back(level.value);
  if (values.empty()) return {0, 1};
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const double room = std::max((*high - *low) * 0.1, 1e-6);
  return {*low - room, *high + room};
}

template <typename Item, typename Text>
std::string list_of(const std::vector<Item>& items, Text text) {
  std::string list;
  for (const Item& item : items) list += (list.empty() ? "" : ",") + text(item);
  return '[' + list + ']';
}

std::string data_of(const chart::RunChart& chart) {
  const bool is_time = chart.course.along == chart::Along::time;
  const std::vector<chart::Sample> samples = thinned(chart.samples);
  const auto value = [&](const chart::Sample& sample, bool is_ng) {
    if (sample.is_ng != is_ng || !is_drawn(sample)) return std::string("null");
    return fmt::format("{:.{}f}", sample.value, chart.quantity.decimals);
  };
  const auto [low, high] = range_of(samples, chart.levels);
  const auto bound = [&](const std::optional<std::int64_t>& at) {
    return at ? place_of(*at, is_time) : std::string("null");
  };
  const std::string unit = chart.quantity.unit.empty() ? "" : ", " + chart.quantity.unit;
  return fmt::format(
      R"({{"title":{},"time":{},"offset":{},"decimals":{},"name":{},"low":{:.6f},"high":{:.6f},"levels":{},"x":{},"ok":{},"ng":{}}})",
      text_of(chart.caption.title), is_time, chart.course.utc_offset_minutes,
      chart.quantity.decimals, text_of(chart.quantity.name + unit), low, high,
      list_of(chart.levels,
              [&](const chart::Level& level) {
                return fmt::format(R"({{"value":{:.6f},"limit":{},"from":{},"to":{}}})",
                                   level.value, level.kind == chart::LevelKind::specification_limit,
                                   bound(level.from), bound(level.to));
              }),
      list_of(samples, [&](const chart::Sample& sample) { return place_of(sample.at, is_time); }),
      list_of(samples, [&](const chart::Sample& sample) { return value(sample, false); }),
      list_of(samples, [&](const chart::Sample& sample) { return value(sample, true); }));
}

}  // namespace

std::string_view zoom_policy() { return policy; }

std::string_view zoom_style() {
  return R"(.zoom-chart{display:none;max-width:960px}
@media screen{.zoom-on .chart-pair{display:none}.zoom-on .zoom-chart{display:block}}
)";
}

std::string zooming(const std::string& figure, const chart::RunChart& chart) {
  return fmt::format(
      "<div class=\"zoom\">{}<div class=\"zoom-chart\"></div>\n<script "
      "type=\"application/json\">{}</script></div>\n",
      figure, data_of(chart));
}

std::string zoom_scripts() {
  return fmt::format("<script>{}</script>\n<script>{}</script>\n", uplot_script(), script);
}

}  // namespace spindle::commands
