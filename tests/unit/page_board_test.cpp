#include <doctest/doctest.h>

#include <utility>

#include "page/board.hpp"
#include "page/metrics.hpp"
#include "page/state_json.hpp"
#include "page/view.hpp"
#include "page/words.hpp"
#include "spindle/report/record.hpp"

using namespace spindle;
using namespace spindle::page;
using namespace std::chrono_literals;
using store::Column;

namespace {

class UtcClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return {}; }
  [[nodiscard]] WallTime wall() const override { return {}; }
  Result<void> sleep_until(TimePoint /*deadline*/) override { return {}; }
};

const WallTime begin = WallTime(std::chrono::sys_days(std::chrono::year(2026) / 11 / 30)) + 6h;
const WallTime now = begin + 2h;

catalogue::CodeText code(std::string text, std::string remedy) {
  catalogue::CodeText made;
  made.text = std::move(text);
  made.remedy = std::move(remedy);
  return made;
}

const ProductWords& words_of(const std::string& profile) {
  static const ProductWords none = {};
  static const ProductWords known = [] {
    ProductWords words{.loosening = 1};
    words.codes.error = std::map<std::int64_t, catalogue::CodeText>{
        {0x30, code("overload", "take the load off")},
        {335, code("torque too high", "look at the joint")}};
    return words;
  }();
  return profile == "known" ? known : none;
}

const store::Place place{.id = 1,
                         .tool = 7,
                         .name = "station1",
                         .profile = "known",
                         .torque_unit = "N.m",
                         .since = begin - 1h};
const store::Tool tool{.id = 7, .name = {.maker = "DOGA", .serial = "42"}, .model = "3204"};

/// A board of one tool, and rows for it.
class Bench {
 public:
  Bench() { board.note(place, &tool); }

  void tell(const std::string& kind, std::int64_t torque, std::int64_t error = 0, WallTime at = now,
            std::int64_t preset = 1, std::int64_t direction = 0, bool remembered = false) {
    store::EventView row{.id = ++id_,
                         .tool = 7,
                         .place = 1,
                         .number = 5,
                         .at = at,
                         .kind = kind,
                         .remembered = remembered};
    row.columns[Column::preset] = preset;
    row.columns[Column::torque] = torque;
    row.columns[Column::target_torque] = 27'100;
    row.columns[Column::error] = error;
    row.columns[Column::direction] = direction;
    board.note(row, place);
  }
  void link(const std::string& state, const std::string& message, WallTime at = now) {
    happen({.type = "link",
            .target = "station1",
            .time = at,
            .fields = {{"state", state}, {"message", message}}});
  }
  void motor(const std::string& kind, std::int64_t alarm) {
    happen({.type = "event",
            .target = "station1",
            .time = now,
            .fields = {{"kind", kind},
                       {"speed", report::number(1200)},
                       {"alarm", report::number(alarm)},
                       {"warning", report::number(0)}}});
  }
  void happen(const report::Record& record) {
    board.note({.id = ++id_,
                .tool = 7,
                .at = record.time,
                .type = record.type,
                .json = report::to_json(record)},
               &place);
  }
  const Station& station() { return board.stations().at("station1"); }
  LinkView link_now(Recorder recorder, WallTime at = now) {
    return link_view(station(), recorder, at, UtcClock());
  }
  std::string card() {
    return card_html(station(), link_now(Recorder::runs), {.now = now, .clock = clock_});
  }

  Board board = Board({.begin = begin, .end = begin + 8h}, words_of);

 private:
  UtcClock clock_ = {};
  store::RowId id_ = 0;
};

}  // namespace

TEST_CASE("page: results are counted in the shift, and only those") {
  Bench bench;
  bench.tell("fastening-ok", 27'000, 0, begin - 1ms);
  bench.tell("fastening-ok", 27'000, 0, begin);
  bench.tell("fastening-ng", 31'000, 335);
  bench.tell("fastening-ok", 27'000, 0, now, 1, 1);        // a loosening
  bench.tell("fastening-ok", 27'000, 0, now, 1, 0, true);  // stood in the tool
  bench.tell("direction-change", 0);
  CHECK(bench.station().ok == 1);
  CHECK(bench.station().ng == 1);
  CHECK(bench.board.totals().results.at({"station1", "1", "ok"}) == 1);
  bench.board.begin({.begin = now + 1h, .end = now + 9h});
  CHECK(bench.station().ok == 0);
  CHECK(bench.station().ng == 0);
  CHECK(bench.station().last);
  CHECK(bench.board.totals().results.at({"station1", "1", "ng"}) == 1);
}

TEST_CASE("page: the last result has its meaning and remedy, and NG is said") {
  Bench bench;
  bench.tell("fastening-ng", 31'050, 335);
  const Fastening& last = *bench.station().last;
  CHECK_FALSE(last.is_ok);
  CHECK(last.text == "torque too high");
  CHECK(last.remedy == "look at the joint");
  CHECK(bench.board.take_said() ==
        std::vector<std::string>{"station1: NG, 3.105 N\u00b7m, E335 torque too high"});
  CHECK(bench.board.take_said().empty());
  bench.tell("fastening-ok", 27'000);
  CHECK(bench.board.take_said().empty());
  CHECK(bench.board.take_changed() == std::set<std::string>{"station1"});
}

TEST_CASE("page: a chart is of the present preset and of so many results") {
  Bench bench;
  for (int count = 0; count < 70; ++count) bench.tell("fastening-ok", 27'000);
  CHECK(bench.station().recent.size() == Board::most_recent);
  bench.tell("fastening-ok", 40'000, 0, now, 2);
  CHECK(bench.station().recent.size() == 1);
  CHECK(bench.station().preset == 2);
}

TEST_CASE("page: an error stays until it is reset or a screw is fastened") {
  Bench bench;
  bench.tell("error", 0, 113);
  REQUIRE(bench.station().alarm);
  CHECK(bench.station().alarm->what == "Error E113");
  bench.tell("alarm-reset", 0);
  CHECK_FALSE(bench.station().alarm);
  bench.tell("error", 0, 113);
  bench.tell("fastening-ok", 27'000);
  CHECK_FALSE(bench.station().alarm);
}

TEST_CASE("page: an alarm of a motor has its remedy and goes with the next that says none") {
  Bench bench;
  bench.motor("alarm", 0x30);
  REQUIRE(bench.station().alarm);
  CHECK(bench.station().alarm->what == "Alarm 30h");
  CHECK(bench.station().alarm->remedy == "take the load off");
  CHECK(bench.card().find("take the load off") != std::string::npos);
  CHECK(bench.card().find("Motor: not known") != std::string::npos);
  bench.motor("started", 0);
  CHECK_FALSE(bench.station().alarm);
  CHECK(bench.station().motor->kind == "started");
}

TEST_CASE("page: missed results are summed up as far as they are known") {
  Bench bench;
  const auto miss = [&](std::optional<std::uint32_t> count, bool at_least, WallTime at) {
    bench.board.note({.tool = 7,
                      .missed = count,
                      .at_least = at_least,
                      .began = at,
                      .ended = at,
                      .reason = "no link"},
                     place);
  };
  miss(5, false, begin - 1ms);  // of another shift
  CHECK(missed_words(sum_of(bench.station().misses)) == "no result missed");
  CHECK(missed_figure(sum_of(bench.station().misses)) == "0");
  miss(1, false, now);
  CHECK(missed_words(sum_of(bench.station().misses)) == "1 result missed");
  miss(2, true, now);
  CHECK(missed_words(sum_of(bench.station().misses)) == "at least 3 results missed");
  CHECK(missed_figure(sum_of(bench.station().misses)) == "3+");
  CHECK(missed_words(sum_of({{.reason = "unknown"}})) == "perhaps results missed");
  CHECK(missed_figure(sum_of({{.reason = "unknown"}})) == "?");
}

TEST_CASE("page: only what is heard while it is recorded is called connected") {
  Bench bench;
  CHECK(bench.link_now(Recorder::runs).shown == LinkShown::unknown);  // heard two hours ago
  bench.link("connected", "events are pushed");
  CHECK(bench.link_now(Recorder::runs) == LinkView{LinkShown::up, "Connected", {}});
  CHECK(bench.link_now(Recorder::runs, now + 45s).shown == LinkShown::up);
  CHECK(bench.link_now(Recorder::runs, now + 46s) ==
        LinkView{LinkShown::unknown, "Not known", "last heard 08:00"});
  CHECK(bench.link_now(Recorder::stopped) ==
        LinkView{LinkShown::unknown, "Not known", "not recording, last heard 08:00"});
  CHECK(bench.link_now(Recorder::unknown).shown == LinkShown::up);
  store::Place seen = place;
  seen.seen = now + 60s;
  bench.board.note(seen, &tool);
  CHECK(bench.link_now(Recorder::runs, now + 70s).shown == LinkShown::up);
}

TEST_CASE("page: a link that is down is down since it was lost, however often it is tried") {
  Bench bench;
  bench.link("connected", "");
  bench.link("lost", "closed by the tool", now + 1min);
  bench.link("reconnecting", "connection refused", now + 5min);
  CHECK(bench.link_now(Recorder::runs, now + 5min) ==
        LinkView{LinkShown::down, "No link", "since 08:01: connection refused"});
  CHECK(bench.link_now(Recorder::stopped, now + 5min).shown == LinkShown::unknown);
  CHECK(bench.board.take_said() == std::vector<std::string>{"station1: no link"});
  bench.link("connected", "", now + 6min);
  CHECK(bench.link_now(Recorder::runs, now + 6min).shown == LinkShown::up);
}

TEST_CASE("page: another tool at a station begins anew, and what was counted stays") {
  Bench bench;
  bench.tell("fastening-ok", 27'000);
  store::Place other = place;
  other.id = 2;
  other.tool = 8;
  other.since = now;
  const store::Tool second{.id = 8, .name = {.maker = "DOGA", .serial = "43"}};
  bench.board.note(other, &second);
  CHECK(bench.station().serial == "43");
  CHECK_FALSE(bench.station().last);
  CHECK(bench.station().ok == 1);
  bench.board.note(place, &tool);  // places are told again and again, the oldest first
  CHECK(bench.station().serial == "43");
  bench.tell("fastening-ok", 27'000);  // a late row of the first one
  CHECK(bench.station().ok == 2);
  CHECK_FALSE(bench.station().last);
}

TEST_CASE("page: texts from outside are texts on the page, in JSON and in metrics") {
  const std::string evil = "<script>alert(\"1\")</script>&\n\x1b[2J\xff";
  Station station{.name = evil, .serial = evil, .unit = evil};
  station.last =
      Fastening{.at = now, .torque = 1, .error = 1, .text = evil, .remedy = evil, .barcode = evil};
  station.alarm = Trouble{.what = evil, .text = evil, .remedy = evil, .at = now};
  station.misses = {{.at = now, .reason = evil}};
  station.recent = {*station.last, *station.last};
  const UtcClock clock;
  const std::string html =
      card_html(station, {.word = evil, .detail = evil}, {.now = now, .clock = clock});
  CHECK(html.find("<script") == std::string::npos);
  CHECK(html.find('\x1b') == std::string::npos);
  CHECK(html.find("&lt;script&gt;") != std::string::npos);
  const std::string json = station_json(station, {});
  CHECK(json.find('\n') == std::string::npos);
  CHECK(json.find(R"(<script>alert(\"1\"))") != std::string::npos);
  const std::string metrics =
      metrics_text({.missed = {{evil, 1}}, .links = {{evil, true}}}, {.is_readable = true});
  CHECK(metrics.find(R"(tool="<script>alert(\"1\")</script>&\n)") != std::string::npos);
}

TEST_CASE("page: metrics leave out what is not known") {
  Bench bench;
  bench.tell("fastening-ok", 27'000);
  commands::Metrics metrics = bench.board.totals();
  const std::string known =
      metrics_text(metrics, {.recorder = Recorder::runs, .streams = 3, .is_readable = true});
  CHECK(known.find("spindle_results_total{tool=\"station1\",preset=\"1\",result=\"ok\"} 1\n") !=
        std::string::npos);
  CHECK(known.find("spindle_recorder_up 1\n") != std::string::npos);
  CHECK(known.find("spindle_page_streams 3\n") != std::string::npos);
  const std::string unknown = metrics_text({}, {});
  CHECK(unknown.find("spindle_link_up{") == std::string::npos);
  CHECK(unknown.find("\nspindle_recorder_up ") == std::string::npos);
  CHECK(unknown.find("\nspindle_store_readable 0\n") != std::string::npos);
  CHECK(unknown.find("spindle_store_bytes") == std::string::npos);
}

TEST_CASE("page: times of another day say so") {
  const UtcClock clock;
  CHECK(time_text(now, now, clock) == "08:00:00");
  CHECK(minute_text(now - 24h, now, clock) == "29 Nov, 08:00");
  CHECK(torque_text(27'000) == "2.70");
  CHECK(torque_text(-1) == "-0.0001");
  CHECK(unit_text("kgf.cm") == "kgf\u00b7cm");
}
