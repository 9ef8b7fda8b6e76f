// Tables on a terminal of some width, and the formats that choose columns.
#include <doctest/doctest.h>

#include <chrono>
#include <string>
#include <vector>

#include "spindle/report/renderer.hpp"
#include "spindle/report/screen_lines.hpp"
#include "support/fake_clock.hpp"

using namespace spindle;
using namespace spindle::report;
using namespace std::chrono_literals;

namespace {

const WallTime moment{std::chrono::milliseconds(1'795'342'530'123)};  // 2026-11-22T10:15:30.123Z

/// A clock of a user whose zone is two hours ahead.
class ZoneClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return {}; }
  [[nodiscard]] WallTime wall() const override { return moment; }
  [[nodiscard]] std::chrono::seconds utc_offset(WallTime /*time*/) const override { return 2h; }
  Result<void> sleep_until(TimePoint /*deadline*/) override { return {}; }
};

struct Screen {
  std::string out;
  std::string err;
  std::size_t columns = 80;
  Streams streams{.out = [this](std::string_view text) -> Result<void> {
                    out += text;
                    return {};
                  },
                  .err = [this](std::string_view text) { err += text; },
                  .read_line = [] { return std::nullopt; },
                  .out_is_terminal = true,
                  .out_columns = [this] { return columns; }};

  Screen() = default;
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
};

Record record(std::vector<Field> fields, std::string target = "station3") {
  return {
      .type = "value", .target = std::move(target), .time = moment, .fields = std::move(fields)};
}

const std::vector<Column> catalogue = {{"NAME", "name"},
                                       {"TABLE", "table", Align::left, 0, left_out(1)},
                                       {"VALUE", "value", Align::right},
                                       {"NOTE", "note", Align::left, 0, left_out(9)},
                                       {"MEANING", "title", Align::left, 0, wrapped(12)}};

Record entry() {
  return record({{"name", "preset.1.speed"},
                 {"table", "holding"},
                 {"value", Decimal(1000)},
                 {"title", "Speed of the run, which ends well"}});
}

std::string drawn(std::size_t columns, const std::vector<Column>& table,
                  const std::vector<Record>& records, Look look = {}) {
  Screen screen;
  screen.columns = columns;
  const auto renderer = make_renderer(look, screen.streams);
  REQUIRE(renderer->begin(table));
  for (const Record& one : records) REQUIRE(renderer->record(one));
  REQUIRE(renderer->end());
  return screen.out;
}

const std::vector<Column> live = {
    {"TIME", "time", Align::left, 24, wrapped(14)},
    {"TORQUE", "torque", Align::right, 7},
    {"SOURCE", "source", Align::left, 8, {.rank = 1, .usual = "push"}},
    {"TEXT", "text", Align::left, 1, below_row()}};

Record event(std::string source, std::string text) {
  return record({{"torque", Decimal(271, -2)},
                 {"source", std::move(source)},
                 {"text", text_or_null(std::move(text))}});
}

}  // namespace

TEST_CASE("a table that fits, or whose terminal says no width, is as in a pipe") {
  const std::string whole =
      "NAME            TABLE    VALUE  NOTE  MEANING\n"
      "preset.1.speed  holding   1000        Speed of the run, which ends well\n";
  CHECK(drawn(71, catalogue, {entry()}) == whole);
  CHECK(drawn(0, catalogue, {entry()}) == whole);
  CHECK(drawn(20, catalogue, {entry()}, {.format = Format::wide}) == whole);
}

TEST_CASE("first texts wrap that may, at spaces") {
  CHECK(drawn(60, catalogue, {entry()}) ==
        "NAME            TABLE    VALUE  NOTE  MEANING\n"
        "preset.1.speed  holding   1000        Speed of the run,\n"
        "                                      which ends well\n");
}

TEST_CASE("then columns are left out: those that say nothing, then by their rank") {
  CHECK(drawn(48, catalogue, {entry()}) ==
        "NAME            TABLE    VALUE  MEANING\n"
        "preset.1.speed  holding   1000  Speed of the\n"
        "                                run, which ends\n"
        "                                well\n");
  CHECK(drawn(40, catalogue, {entry()}) ==
        "NAME            VALUE  MEANING\n"
        "preset.1.speed   1000  Speed of the run,\n"
        "                       which ends well\n");
}

TEST_CASE("at last the widest texts wrap, and no number is ever cut") {
  CHECK(drawn(30, catalogue, {entry()}) ==
        "NAME       VALUE  MEANING\n"
        "preset.1.   1000  Speed of the\n"
        "speed             run, which\n"
        "                  ends well\n");
  const std::string narrowest = drawn(5, catalogue, {entry()});
  CHECK(narrowest.find("1000") != std::string::npos);
}

TEST_CASE("wide characters take two cells each") {
  const std::vector<Column> table = {{"NAME", "name", Align::left, 0, wrapped(6)}, {"B", "b"}};
  CHECK(drawn(10, table, {record({{"name", "トルクトルク"}, {"b", "xx"}})}) ==
        "NAME    B\nトルク  xx\nトルク\n");
}

TEST_CASE("what has no room behind a row stands below it") {
  const auto table = [](std::size_t columns, const Record& one) {
    const ZoneClock clock;
    return drawn(columns, live, {one}, {.clock = &clock});
  };
  CHECK(table(80, event("push", "E333 stopped")) ==
        "TIME                            TORQUE  SOURCE    TEXT\n"
        "2026-11-22 12:15:30.123+02:00     2.71  push      E333 stopped\n");
  CHECK(table(50, event("push", "E333 stopped")) ==
        "TIME                            TORQUE  SOURCE\n"
        "2026-11-22 12:15:30.123+02:00     2.71  push\n"
        "    E333 stopped\n");
  CHECK(table(40, event("push", "")) ==
        "TIME             TORQUE  SOURCE    TEXT\n"
        "11-22 12:15:30     2.71  push\n");
  CHECK(table(34, event("push", "ok")) ==
        "TIME             TORQUE  SOURCE\n"
        "11-22 12:15:30     2.71  push\n"
        "    ok\n");
}

TEST_CASE("what is not as usual is told although its column is left out") {
  const ZoneClock clock;
  CHECK(drawn(30, live, {event("catch-up", ""), event("push", "well")}, {.clock = &clock}) ==
        "TIME             TORQUE  TEXT\n"
        "11-22 12:15:30     2.71\n"
        "    [catch-up]\n"
        "11-22 12:15:30     2.71  well\n");
}

TEST_CASE("a terminal that gets another width gets another head") {
  const ZoneClock clock;
  Screen screen;
  const auto renderer = make_renderer({.clock = &clock}, screen.streams);
  REQUIRE(renderer->begin(live));
  REQUIRE(renderer->record(event("push", "")));
  screen.columns = 30;
  screen.out.clear();
  REQUIRE(renderer->record(event("push", "")));
  REQUIRE(renderer->record(event("push", "")));
  CHECK(screen.out ==
        "\nTIME             TORQUE  TEXT\n11-22 12:15:30     2.71\n"
        "11-22 12:15:30     2.71\n");
}

TEST_CASE("in a pipe nothing is cut, and times are UTC") {
  const ZoneClock clock;
  Screen screen;
  screen.columns = 20;
  screen.streams.out_is_terminal = false;
  const auto renderer = make_renderer({.clock = &clock}, screen.streams);
  REQUIRE(renderer->begin(live));
  REQUIRE(renderer->record(event("push", "well")));
  CHECK(screen.out ==
        "TIME                       TORQUE  SOURCE    TEXT\n"
        "2026-11-22T10:15:30.123Z     2.71  push      well\n");
}

TEST_CASE("colour is no width, and goes on in each line") {
  Screen screen;
  screen.columns = 12;
  screen.streams.color = Color::on;
  const auto renderer = make_renderer(Look(), screen.streams);
  REQUIRE(renderer->begin(std::vector<Column>{{"A", "a", Align::left, 0, wrapped(6)}, {"B", "b"}}));
  REQUIRE(renderer->record(
      record({{.key = "a", .cell = "alarm is on", .tone = Tone::bad}, {"b", "xxxx"}})));
  REQUIRE(renderer->end());
  CHECK(screen.out ==
        "\x1b[1mA       B\x1b[0m\n"
        "\x1b[31malarm\x1b[0m   xxxx\n"
        "\x1b[31mis on\x1b[0m\n");
}

TEST_CASE("columns are chosen by key or title; others are told what there is") {
  const Look look{.columns = {"value", "Name"}};
  CHECK(drawn(80, catalogue, {entry()}, look) == "VALUE  NAME\n 1000  preset.1.speed\n");
  CHECK(drawn(12, catalogue, {entry()}, {.columns = {"table"}}) == "TABLE\nholding\n");
  Screen screen;
  const auto wrong = make_renderer({.columns = {"vlaue"}}, screen.streams)->begin(catalogue);
  REQUIRE(!wrong);
  CHECK(wrong.error().code == Errc::usage);
  CHECK(wrong.error().message == "--columns: 'vlaue' is no column here");
  CHECK(wrong.error().hint == "did you mean 'value'? it has name, table, value, note, title");
}

TEST_CASE("columns that are shown only where all are wanted") {
  const std::vector<Column> table = {{"RAW", "raw", Align::left, 0, only_wide()}, {"B", "b"}};
  const std::vector<Record> records = {record({{"raw", Words{1, 2}}, {"b", "x"}})};
  CHECK(drawn(80, table, records) == "B\nx\n");
  CHECK(drawn(80, table, records, {.format = Format::wide}) == "RAW  B\n1 2  x\n");
  CHECK(drawn(80, table, records, {.columns = {"raw"}}) == "RAW\n1 2\n");
  CHECK(drawn(80, table, records, {.format = Format::csv}) == "target,raw,b\r\nstation3,1 2,x\r\n");
}

TEST_CASE("values alone: one record a line, also where there is none") {
  const Look look{.format = Format::value};
  const std::vector<Record> records = {
      record({{"name", "a"}, {"value", Decimal(271, -2), "2.71 shown"}}),
      record({{"name", "b"}, {"value", std::monostate{}}}),
      record({{"name", "c"}, {"value", "two\nlines"}})};
  CHECK(drawn(10, catalogue, records, look) == "2.71\n\ntwo lines\n");
  CHECK(drawn(10, catalogue, records, {.format = Format::value, .columns = {"name", "value"}}) ==
        "a\t2.71\nb\t\nc\ttwo lines\n");
  Screen screen;
  const auto none =
      make_renderer(look, screen.streams)->begin(std::vector<Column>{{"A", "a"}, {"B", "b"}});
  REQUIRE(!none);
  CHECK(none.error().hint == "say which with --columns: a, b");
}

TEST_CASE("YAML: a document each, numbers exact, and no text that is read as something else") {
  const Record one = record({{"name", "preset.1.speed"},
                             {"value", Decimal(310, -2)},
                             {"label", "no"},
                             {"text", "a: b"},
                             {"raw", Words{310}},
                             {"unit", std::monostate{}},
                             {"labels", Pairs{{"0", "off"}}},
                             {.key = "seen", .cell = "x", .audience = Audience::columns}});
  const std::string document =
      "---\n"
      "schema: spindle/1\n"
      "type: value\n"
      "time: \"2026-11-22T10:15:30.123Z\"\n"
      "target: station3\n"
      "name: preset.1.speed\n"
      "value: 3.10\n"
      "label: \"no\"\n"
      "text: \"a: b\"\n"
      "raw: [310]\n"
      "unit: null\n"
      "labels: {\"0\":\"off\"}\n";
  CHECK(drawn(10, catalogue, {one}, {.format = Format::yaml}) == document);
}

TEST_CASE("YAML: errors and summaries are documents as in JSON") {
  Screen screen;
  const auto renderer = make_renderer({.format = Format::yaml}, screen.streams);
  REQUIRE(renderer->summary(record({{"written", Decimal(2)}}), "2 written"));
  CHECK(screen.out.find("\nwritten: 2\n") != std::string::npos);
  CHECK(screen.err.empty());
  screen.out.clear();
  REQUIRE(renderer->error({.code = Errc::usage, .message = "wrong"}, moment));
  CHECK(screen.out.find("\ntype: error\n") != std::string::npos);
  CHECK(screen.err == "spindle: wrong\n");
}

TEST_CASE("CSV: the target always, behind the time where that comes first") {
  const std::vector<Record> records = {record({{"a", "x"}}), record({{"a", "y"}}, "b")};
  CHECK(drawn(9, {{"A", "a"}}, records, {.format = Format::csv}) ==
        "target,a\r\nstation3,x\r\nb,y\r\n");
  CHECK(drawn(9, {{"TIME", "time"}, {"A", "a"}}, {records[0]}, {.format = Format::csv}) ==
        "time,target,a\r\n2026-11-22T10:15:30.123Z,station3,x\r\n");
  CHECK(drawn(9, {{"A", "a"}, {"TARGET", "target"}}, {records[0]}, {.format = Format::csv}) ==
        "a,target\r\nx,station3\r\n");
}

TEST_CASE("lines of a screen: each fits, and what is cut says so") {
  const std::vector<Column> columns = {{"", "target", Align::left, 0, wrapped(8)},
                                       {"", "number", Align::left, 0, left_out(2)},
                                       {"", "ok", Align::right}};
  const std::vector<Record> records = {
      record({{"number", "number 1962"}, {"ok", "9 OK"}}),
      record({{"number", "number 7"}, {"ok", "12 OK"}}, "tcp://192.168.10.23")};
  const auto wide = screen_lines(columns, records, 80, Color::off);
  REQUIRE(wide.size() == 2);
  CHECK(wide[0].text == "station3             number 1962   9 OK");
  CHECK(wide[1].text == "tcp://192.168.10.23  number 7     12 OK");
  CHECK(wide[1].width == 39);
  const auto narrow = screen_lines(columns, records, 20, Color::off);
  CHECK(narrow[0].text == "station3        9 OK");
  CHECK(narrow[1].text == "tcp://192....  12 OK");
  for (const ScreenLine& line : narrow) CHECK(line.width <= 20);
}
