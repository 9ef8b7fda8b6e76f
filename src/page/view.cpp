#include "page/view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "spindle/base/hash.hpp"
#include "spindle/base/text.hpp"
#include "spindle/chart/escape.hpp"
#include "spindle/chart/run_chart.hpp"

namespace spindle::page {
namespace {

using chart::escape;

// Shapes say what colours say, too. They are drawn, so that no letter of a font is missing.
constexpr std::string_view check_shape =
    R"(<svg class="shape" viewBox="0 0 24 24" aria-hidden="true"><circle cx="12" cy="12" r="12"/><path d="M6 12.5l4.2 4.2L18 8.4"/></svg>)";
constexpr std::string_view cross_shape =
    R"(<svg class="shape" viewBox="0 0 24 24" aria-hidden="true"><path class="body" d="M7 0h10l7 7v10l-7 7H7l-7-7V7z"/><path d="M7.5 7.5l9 9M16.5 7.5l-9 9"/></svg>)";
constexpr std::string_view triangle_shape =
    R"(<svg class="shape" viewBox="0 0 24 24" aria-hidden="true"><path class="body" d="M12 1l12 22H0z"/><path d="M12 9v6M12 18.2v1.4"/></svg>)";
constexpr std::string_view ring_shape =
    R"(<svg class="shape ring" viewBox="0 0 24 24" aria-hidden="true"><circle cx="12" cy="12" r="9.5"/></svg>)";
constexpr std::string_view dot_shape =
    R"(<svg class="shape" viewBox="0 0 24 24" aria-hidden="true"><circle cx="12" cy="12" r="10"/></svg>)";

struct LinkLook {
  std::string_view css;
  std::string_view shape;
};

LinkLook look_of(LinkShown shown) {
  switch (shown) {
    case LinkShown::up:
      return {"up", dot_shape};
    case LinkShown::down:
      return {"down", cross_shape};
    case LinkShown::unknown:
      break;
  }
  return {"unknown", ring_shape};
}

std::string link_html(const LinkView& link) {
  const auto [css, shape] = look_of(link.shown);
  const std::string detail =
      link.detail.empty() ? std::string()
                          : fmt::format(" <span class=\"detail\">{}</span>", escape(link.detail));
  return fmt::format("<p class=\"link {}\">{}<b>{}</b>{}</p>", css, shape, escape(link.word),
                     detail);
}

std::string meta_html(const Station& station) {
  std::string text;
  const auto add = [&](const std::string& part) {
    text += fmt::format("{}<span>{}</span>", text.empty() ? "" : " ", escape(part));
  };
  if (station.preset) add(fmt::format("Preset {}", *station.preset));
  if (station.target_torque) {
    add(fmt::format("target {} {}", torque_text(*station.target_torque), unit_text(station.unit)));
  }
  if (station.unit.empty() && station.last && station.last->torque) add("unit not known");
  if (text.empty() && !station.motor) add("Preset not known");
  return fmt::format("<p class=\"meta\">{}</p>", text);
}

std::string why_html(const std::string& what, const std::string& text, const std::string& remedy) {
  std::string html = fmt::format("<b>{}</b>", escape(what));
  html += text.empty() ? " <span>meaning not known</span>" : " <span>" + escape(text) + "</span>";
  if (!remedy.empty()) {
    html += fmt::format("<span class=\"remedy\"><b>What helps:</b> {}</span>", escape(remedy));
  }
  return html;
}

std::string result_html(const Station& station, const Moment& moment) {
  const Fastening& last = *station.last;
  const std::string torque =
      last.torque ? fmt::format("<span class=\"torque\">{} <small>{}</small></span>",
                                torque_text(*last.torque), escape(unit_text(station.unit)))
                  : std::string("<span class=\"torque quiet\">no torque told</span>");
  std::string html = fmt::format(
      "<div class=\"result {}\"><p class=\"verdict\">{}<b>{}</b></p><p "
      "class=\"value\">{}</p></div>",
      last.is_ok ? "ok" : "ng", last.is_ok ? check_shape : cross_shape, last.is_ok ? "OK" : "NG",
      torque);
  const std::string when =
      last.is_old ? std::string("stood in the tool when it was found, so its time is not known")
                  : time_text(last.at, moment.now, moment.clock);
  html += fmt::format(
      "<p class=\"when\"><span>{}</span> <span>number {}</span>{}</p>", when, last.number,
      last.barcode.empty() ? ""
                           : fmt::format(" <span class=\"code\">{}</span>", escape(last.barcode)));
  if (last.error != 0) {
    html += fmt::format("<p class=\"why\">{}</p>",
                        why_html(fmt::format("E{}", last.error), last.text, last.remedy));
  }
  return html;
}

std::string motor_html(const MotorNews& motor, const Moment& moment) {
  if (motor.kind.empty()) {
    return "<div class=\"result none\"><p class=\"verdict\"><b>Motor: not known</b></p></div>";
  }
  const std::string word = motor.kind == "stopped" ? "stopped" : "running";
  const std::string speed =
      motor.speed && word == "running"
          ? fmt::format("<span class=\"torque\">{} <small>speed</small></span>",
                        motor.speed->to_string())
          : std::string();
  return fmt::format(
      "<div class=\"result none\"><p class=\"verdict\"><b>Motor {}</b></p><p "
      "class=\"value\">{}</p></div><p class=\"when\"><span>{}</span></p>",
      escape(word), speed, time_text(motor.at, moment.now, moment.clock));
}

std::string last_html(const Station& station, const Moment& moment) {
  if (station.last) return result_html(station, moment);
  if (station.motor) return motor_html(*station.motor, moment);
  return "<div class=\"result none\"><p class=\"verdict\"><b>No result yet</b></p></div>";
}

std::string count_html(std::string_view css, std::string_view name, const std::string& figure) {
  return fmt::format("<div class=\"{}\"><dt>{}</dt><dd>{}</dd></div>", css, name, figure);
}

std::string counts_html(std::uint64_t ok, std::uint64_t ng, const MissedSum& missed) {
  const bool misses = missed.count > 0 || missed.at_least || missed.is_unsure;
  return fmt::format(
      "<dl class=\"counts\">{}{}{}</dl>", count_html("n-ok", "OK", std::to_string(ok)),
      count_html(ng > 0 ? "n-ng some" : "n-ng", "NG", std::to_string(ng)),
      count_html(misses ? "n-missed some" : "n-missed", "Missed", missed_figure(missed)));
}

std::string trouble_html(const Trouble& trouble, std::string_view css, const Moment& moment) {
  return fmt::format(
      "<p class=\"trouble {}\">{}<span>{}<span class=\"quiet\">told at {}</span></span></p>", css,
      triangle_shape, why_html(trouble.what, trouble.text, trouble.remedy),
      time_text(trouble.at, moment.now, moment.clock));
}

std::string misses_html(const Station& station, const Moment& moment) {
  if (station.misses.empty()) return {};
  constexpr std::size_t most = 8;
  std::string lines;
  const auto& misses = station.misses;
  for (std::size_t at = misses.size(); at > 0 && misses.size() - at < most; --at) {
    const Miss& miss = misses[at - 1];
    lines += fmt::format("<li><b>{}</b> {}: {}</li>", time_text(miss.at, moment.now, moment.clock),
                         missed_words(sum_of({miss})), escape(miss.reason));
  }
  if (misses.size() > most) {
    lines += fmt::format("<li>{} more before</li>", misses.size() - most);
  }
  return fmt::format("<details><summary>{}: when and why</summary><ul>{}</ul></details>",
                     missed_words(sum_of(misses)), lines);
}

std::string chart_html(const Station& station) {
  chart::RunChart run;
  run.caption.title = fmt::format("Last torques of {}", station.name);
  run.caption.description = station.preset ? fmt::format("Of preset {}.", *station.preset) : "";
  run.quantity = {.name = "Torque", .unit = unit_text(station.unit)};
  std::int64_t at = 0;
  for (const Fastening& result : station.recent) {
    ++at;
    if (!result.torque) continue;
    run.samples.push_back({.at = at,
                           .value = static_cast<double>(*result.torque) / store::torque_scale,
                           .is_ng = !result.is_ok});
  }
  constexpr std::size_t fewest = 2;
  if (run.samples.size() < fewest) return {};
  if (station.target_torque && *station.target_torque > 0) {
    run.levels.push_back(
        {.kind = chart::LevelKind::target,
         .value = static_cast<double>(*station.target_torque) / store::torque_scale,
         .name = "target"});
  }
  return fmt::format("<div class=\"run\">{}<p class=\"quiet\">last {} torques</p></div>",
                     chart::small_run_chart(run), run.samples.size());
}

std::string banner(std::string_view css, std::string_view shape, const std::string& text) {
  return fmt::format("<p class=\"banner {}\">{}<span>{}</span></p>", css, shape, text);
}

std::string names_text(const std::vector<std::string>& names) {
  constexpr std::size_t most = 10;
  std::string text;
  for (std::size_t at = 0; at < std::min(most, names.size()); ++at) {
    text += (at == 0 ? "" : ", ") + names[at];
  }
  if (names.size() > most) text += fmt::format(" and {} more", names.size() - most);
  return text;
}

}  // namespace

std::string key_of(const std::string& name) { return fmt::format("t{:016x}", hash_of(name)); }

std::string card_html(const Station& station, const LinkView& link, const Moment& moment) {
  const std::string key = key_of(station.name);
  std::string_view tone = "none";
  if (station.last) tone = station.last->is_ok ? "ok" : "ng";
  if (station.alarm) tone = "ng";
  std::string html = fmt::format(
      "<article class=\"card {}\" id=\"{}\" aria-labelledby=\"{}n\"><header><h2 "
      "id=\"{}n\">{}</h2>{}</header>{}",
      tone, key, key, key, escape(station.name), link_html(link), meta_html(station));
  if (station.alarm) html += trouble_html(*station.alarm, "alarm", moment);
  if (station.warning) html += trouble_html(*station.warning, "warning", moment);
  html += last_html(station, moment);
  if (!station.motor || station.last) {
    html += counts_html(station.ok, station.ng, sum_of(station.misses));
    html += chart_html(station);
  }
  html += misses_html(station, moment);
  return html + "</article>";
}

std::string overview_html(const Overview& overview, const Moment& moment) {
  std::string html;
  if (!overview.problem.empty()) {
    html += banner("bad", triangle_shape, escape(overview.problem));
  } else if (overview.recorder == Recorder::stopped) {
    html += banner("bad", triangle_shape,
                   "<b>Nothing is recorded now.</b> spindle record does not run; what is shown was "
                   "known when it ended.");
  }
  const auto part = [](std::string_view css, std::size_t count, std::string_view word) {
    return count == 0 ? std::string()
                      : fmt::format(" <span class=\"{}\">{} {}</span>", css, count, word);
  };
  const std::string shift =
      overview.shift.begin == WallTime()
          ? std::string()
          : fmt::format("<p class=\"shift\">Shift since {}</p>",
                        minute_text(overview.shift.begin, moment.now, moment.clock));
  html += fmt::format("<div class=\"sum\"><p class=\"tools\"><span>{}</span>{}{}{}</p>{}{}</div>",
                      counted(overview.tools, "tool"), part("up", overview.up, "connected"),
                      part("down", overview.down, "without link"),
                      part("unknown", overview.unknown, "not known"), shift,
                      counts_html(overview.ok, overview.ng, overview.missed));
  if (overview.tools == 0 && overview.old.empty() && overview.problem.empty()) {
    html += banner("calm", ring_shape, "No tool was recorded yet.");
  }
  if (!overview.old.empty()) {
    html += fmt::format("<p class=\"old\">Not heard for a week and left out: {}</p>",
                        escape(names_text(overview.old)));
  }
  return html;
}

}  // namespace spindle::page
