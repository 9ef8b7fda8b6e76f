#include "spindle/report/renderer.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

using namespace spindle::report;
using nlohmann::json;
using spindle::Decimal;
using spindle::Errc;
using spindle::Error;
using spindle::Result;
using spindle::WallTime;

namespace {

const WallTime moment{std::chrono::milliseconds(1'795'342'530'123)};  // 2026-11-22T10:15:30.123Z

/// Streams that remember what was written, one entry a call.
struct Caught {
  std::vector<std::string> writes;
  std::string err;
  Streams streams{
      .out = [this](std::string_view text) -> Result<void> {
        writes.emplace_back(text);
        return {};
      },
      .err = [this](std::string_view text) { err += text; },
      .read_line = [] { return std::nullopt; },
  };

  Caught() = default;
  Caught(const Caught&) = delete;
  Caught& operator=(const Caught&) = delete;

  [[nodiscard]] std::string out() const {
    std::string all;
    for (const std::string& text : writes) all += text;
    return all;
  }
};

Record value_record(std::string name, Cell value, Cell unit = std::monostate{}) {
  return {.type = "value",
          .target = "sim:doga-bm",
          .time = moment,
          .fields = {
              {"name", std::move(name)}, {"value", std::move(value)}, {"unit", std::move(unit)}}};
}

Record one_field(Cell cell) {
  return {.type = "t", .target = "", .time = moment, .fields = {{"f", std::move(cell)}}};
}

const std::vector<Column> value_columns = {
    {"NAME", "name"}, {"VALUE", "value", Align::right}, {"UNIT", "unit"}};

/// What a format makes of some records between one begin() and end().
std::string rendered(Format format, const std::vector<Column>& columns,
                     const std::vector<Record>& records, Color color = Color::off) {
  Caught caught;
  caught.streams.color = color;
  const auto renderer = make_renderer(format, caught.streams, Verbosity::normal);
  REQUIRE(renderer->begin(columns));
  for (const Record& record : records) REQUIRE(renderer->record(record));
  REQUIRE(renderer->end());
  CHECK(caught.err.empty());
  return caught.out();
}

std::string table_cell(std::string text) {
  return rendered(Format::table, {{"F", "f"}}, {one_field(std::move(text))});
}

std::string csv_cell(std::string text) {
  return rendered(Format::csv, {{"F", "f"}}, {one_field(std::move(text))});
}

std::string json_line(const Record& record) { return rendered(Format::json, {}, {record}); }

}  // namespace

TEST_CASE("JSON: a line begins as the contract says and keeps numbers exact") {
  const Record record{.type = "value",
                      .target = "station3",
                      .time = moment,
                      .fields = {{"value", Decimal(271, -2)},
                                 {"limit", Decimal(1000, -2), "10 %"},
                                 {"raw", Words{271, 65535}},
                                 {"label", std::monostate{}},
                                 {"known", true},
                                 {"notes", Texts{"a", "b"}},
                                 {"labels", Pairs{{"0", "off"}}},
                                 {"none", Words{}}}};
  CHECK(json_line(record) ==
        R"({"schema":"spindle/1","type":"value","time":"2026-11-22T10:15:30.123Z",)"
        R"("target":"station3","value":2.71,"limit":10.00,"raw":[271,65535],"label":null,)"
        R"("known":true,"notes":["a","b"],"labels":{"0":"off"},"none":[]})"
        "\n");
}

TEST_CASE("lines for programs begin on a line of their own behind one that was cut off") {
  struct Case {
    Format format;
    std::string_view first;
  };
  for (const Case& row : {Case{Format::json, "\n{"}, Case{Format::csv, "\r\ntarget,f\r\n"}}) {
    Caught caught;
    caught.streams.out_ends_within_line = [] { return true; };
    const auto renderer = make_renderer(row.format, caught.streams, Verbosity::normal);
    REQUIRE(renderer->begin(std::vector<Column>{{"F", "f"}}));
    REQUIRE(renderer->record(one_field(Decimal(1))));
    REQUIRE(renderer->record(one_field(Decimal(2))));
    CHECK(caught.out().starts_with(row.first));
    // Only the first one, and in one piece with what it keeps apart.
    CHECK(caught.writes.at(1).front() != '\n');
    CHECK(caught.writes.front().size() > 2);
  }
}

TEST_CASE("lines for programs: after a failure the next one is as careful as the first") {
  std::vector<std::string> tried;
  bool is_full = true;
  Caught caught;
  caught.streams.out_ends_within_line = [] { return true; };
  caught.streams.out = [&](std::string_view text) -> Result<void> {
    tried.emplace_back(text);
    if (is_full) return tl::unexpected(Error{.code = Errc::storage});
    return {};
  };
  const auto renderer = make_renderer(Format::json, caught.streams, Verbosity::normal);
  CHECK_FALSE(renderer->record(one_field(Decimal(1))));
  is_full = false;
  CHECK(renderer->record(one_field(Decimal(2))));
  CHECK(renderer->record(one_field(Decimal(3))));
  CHECK(tried.at(0).front() == '\n');
  CHECK(tried.at(1).front() == '\n');
  CHECK(tried.at(2).front() == '{');
}

TEST_CASE("JSON: without a target it is null") {
  CHECK(json_line(one_field(Decimal(1))) ==
        R"({"schema":"spindle/1","type":"t","time":"2026-11-22T10:15:30.123Z","target":null,"f":1})"
        "\n");
}

TEST_CASE("JSON: strings mean the same to another parser, whatever is in them") {
  const std::string texts[] = {
      "",
      "plain",
      "quote \" backslash \\ slash /",
      "\b\f\n\r\t",
      std::string("nul \0 inside", 12),
      "\x1b[31mred\x7f",
      "21.5 °C, é, トルク, \U0001F529",
      "\u0085\u009b",
      "\u202ereversed\u2066\u2028\ufeff",
      "tag \U000E0041",
      // Ill-formed: The Unicode Standard 15.0, tables 3-8 to 3-11.
      "\xC0\xAF\xE0\x80\xBF\xF0\x81\x82\x41",
      "\xED\xA0\x80\xED\xBF\xBF\xED\xAF\x41",
      "\xF4\x91\x92\x93\xFF\x41\x80\xBF\x42",
      "\xE1\x80\xE2\xF0\x91\x92\xF1\xBF\x41",
      "cut \xF0\x9F\x94",
      "cut \xC3",
  };
  for (const std::string& text : texts) {
    CAPTURE(text);
    const std::string line = json_line(one_field(text));
    // nlohmann replaces the same maximal subparts of ill-formed sequences.
    const std::string theirs = json(text).dump(-1, ' ', false, json::error_handler_t::replace);
    CHECK(json::parse(line).at("f") == json::parse(theirs));
    CHECK(json::parse(json_line(one_field(Texts{text}))).at("f").at(0) == json::parse(theirs));
    CHECK(json::parse(json_line(one_field(Pairs{{text, "x"}}))).at("f").size() == 1);
  }
}

TEST_CASE("JSON: every byte, alone and between others, gives one valid line without controls") {
  for (int byte = 0; byte < 256; ++byte) {
    const std::string one(1, static_cast<char>(byte));
    for (const std::string& text : {one, "a" + one + "b", one + one + one}) {
      CAPTURE(byte);
      std::string line = json_line(one_field(text));
      REQUIRE(line.back() == '\n');
      line.pop_back();
      CHECK(json::accept(line));
      CHECK(std::none_of(line.begin(), line.end(),
                         [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; }));
    }
  }
}

TEST_CASE("JSON: each record is written at once, by one call") {
  Caught caught;
  const auto renderer = make_renderer(Format::json, caught.streams, Verbosity::quiet);
  REQUIRE(renderer->record(value_record("a", Decimal(1))));
  CHECK(caught.writes.size() == 1);
  REQUIRE(renderer->record(value_record("b", Decimal(2))));
  REQUIRE(caught.writes.size() == 2);
  CHECK(caught.writes[1].find("\"a\"") == std::string::npos);
}

TEST_CASE("table: the contract's example, byte for byte") {
  const std::string percent = "%";
  CHECK(rendered(Format::table, value_columns,
                 {value_record("preset.1.target-torque", Decimal(271, -2)),
                  value_record("preset.1.torque-limit", Decimal(1000, -2), percent),
                  value_record("preset.1.snug-torque", Decimal(0, -2)),
                  value_record("preset.1.torque-compensation", Decimal(100), percent)}) ==
        "NAME                          VALUE  UNIT\n"
        "preset.1.target-torque         2.71\n"
        "preset.1.torque-limit         10.00  %\n"
        "preset.1.snug-torque           0.00\n"
        "preset.1.torque-compensation    100  %\n");
}

TEST_CASE("table: the contract's identity example takes the target and the shown text") {
  const std::vector<Column> columns = {{"TARGET", "target"},   {"MODEL", "tool_model_code"},
                                       {"SERIAL", "serial"},   {"FIRMWARE", "firmware"},
                                       {"PROFILE", "profile"}, {"ROUND TRIP", "round_trip_ms"}};
  const Record identity{.type = "identity",
                        .target = "sim:doga-bm",
                        .time = moment,
                        .fields = {{"profile", std::string("doga-bm")},
                                   {"tool_model_code", Decimal(3204)},
                                   {"serial", std::string("1021100042")},
                                   {"firmware", std::string("2103")},
                                   {"round_trip_ms", Decimal(1, -1), "0.1 ms"}}};
  CHECK(rendered(Format::table, columns, {identity}) ==
        "TARGET       MODEL  SERIAL      FIRMWARE  PROFILE  ROUND TRIP\n"
        "sim:doga-bm  3204   1021100042  2103      doga-bm  0.1 ms\n");
}

TEST_CASE("table: record facts can be columns") {
  CHECK(rendered(Format::table, {{"TIME", "time"}, {"TYPE", "type"}, {"X", "absent"}},
                 {value_record("a", Decimal(1))}) ==
        "TIME                      TYPE   X\n"
        "2026-11-22T10:15:30.123Z  value\n");
}

TEST_CASE("table: widths count terminal cells, not bytes") {
  const std::vector<Column> columns = {{"F", "f"}, {"G", "target"}};
  struct Row {
    std::string text;
    std::string padding;
  };
  const Row rows[] = {
      {"12345678", ""},
      {"21.5 °C", " "},                        // two bytes, one cell
      {"caf\u00e9", "    "},                   // precomposed
      {"cafe\u0301", "    "},                  // combining accent
      {"トルク", "  "},                        // wide
      {"\uff21\uff22", "    "},                // fullwidth
      {"\U0001F529", "      "},                // nut and bolt
      {"\u0e17\u0e35\u0e48", "       "},       // Thai vowel and tone above
      {"\u1112\u1161\u11ab", "      "},        // Hangul, in parts
      {"\u2699", "       "},                   // gear: as narrow as the standard says
      {"\u2705\u274c", "    "},                // marks that are wide
      {"\U0001F468\u200D\U0001F527", "    "},  // joined emoji
      {"\U0001F1E9\U0001F1EA", "      "},      // a flag of two letters
      {"\U0001FAA3", "      "},                // bucket, of Unicode 13
      {"\xff", "       "},                     // replaced by U+FFFD
  };
  for (const Row& row : rows) {
    CAPTURE(row.text);
    Record record = one_field(row.text);
    record.target = "|";
    Record ruler = one_field(std::string("12345678"));
    ruler.target = "|";
    const std::string shown = row.text == "\xff" ? "\uFFFD" : row.text;
    CHECK(rendered(Format::table, columns, {ruler, record}) ==
          "F         G\n12345678  |\n" + shown + row.padding + "  |\n");
  }
}

TEST_CASE("table: nothing in a cell can steer the terminal or break the line") {
  struct Row {
    std::string text;
    std::string shown;
  };
  const Row rows[] = {
      {"\x1b[2Jx", "\\x1b[2Jx"},
      {std::string("a\0b", 3), "a\\x00b"},
      {"del\x7f", "del\\x7f"},
      {"\u009b31m", "\\x9b31m"},
      {"one\ntwo\r\nthree\tfour", "one two three four"},
      {"end\n", "end"},
      {"\xC3(", "\uFFFD("},
      {"bell\a", "bell\\x07"},
      {"\u202eesrever\u202c", "\\u202eesrever\\u202c"},
      {"\u2066isolated\u2069", "\\u2066isolated\\u2069"},
      {"\u061c\u200e\u200f", "\\u061c\\u200e\\u200f"},
      {"line\u2028paragraph\u2029", "line\\u2028paragraph\\u2029"},
      {"stat\u200bion3\ufeff", "stat\\u200bion3\\ufeff"},
      {"soft\u00adhyphen", "soft\\xadhyphen"},
      {"tag\U000E0041", "tag\\U000e0041"},
  };
  for (const Row& row : rows) CHECK(table_cell(row.text) == "F\n" + row.shown + "\n");
}

TEST_CASE("table: a cell is never cut") {
  const std::string long_text(5000, 'x');
  CHECK(table_cell(long_text) == "F\n" + long_text + "\n");
}

TEST_CASE("table: no rows, no output; a blank line stands between tables that have rows") {
  CHECK(rendered(Format::table, value_columns, {}).empty());

  Caught caught;
  const auto renderer = make_renderer(Format::table, caught.streams, Verbosity::normal);
  const std::vector<Column> columns = {{"F", "f"}};
  const auto round = [&](const std::vector<std::string>& cells) {
    REQUIRE(renderer->begin(columns));
    for (const std::string& cell : cells) REQUIRE(renderer->record(one_field(cell)));
    REQUIRE(renderer->end());
  };
  round({});
  round({"one"});
  round({});
  round({"two", "three"});
  CHECK(caught.out() == "F\none\n\nF\ntwo\nthree\n");
}

TEST_CASE("table: rows wait for end(), or for the next begin()") {
  Caught caught;
  const auto renderer = make_renderer(Format::table, caught.streams, Verbosity::normal);
  const std::vector<Column> columns = {{"F", "f"}};
  REQUIRE(renderer->begin(columns));
  REQUIRE(renderer->record(one_field(std::string("one"))));
  CHECK(caught.writes.empty());
  REQUIRE(renderer->begin(columns));
  CHECK(caught.out() == "F\none\n");
  REQUIRE(renderer->end());
  CHECK(caught.out() == "F\none\n");
}

TEST_CASE("table: with all widths given, rows are drawn as they come") {
  Caught caught;
  const auto renderer = make_renderer(Format::table, caught.streams, Verbosity::normal);
  const std::vector<Column> columns = {
      {.title = "NAME", .key = "name", .width = 6},
      {.title = "VALUE", .key = "value", .align = Align::right, .width = 7}};
  REQUIRE(renderer->begin(columns));
  CHECK(caught.writes.empty());
  REQUIRE(renderer->record(value_record("a", Decimal(271, -2))));
  CHECK(caught.out() == "NAME      VALUE\na          2.71\n");
  REQUIRE(renderer->record(value_record("far-too-long", Decimal(1))));
  CHECK(caught.writes.at(1) == "far-too-long        1\n");
  REQUIRE(renderer->end());
  CHECK(caught.writes.size() == 2);
}

TEST_CASE("table: the header is bold where colour is wanted, the cells never are") {
  CHECK(rendered(Format::table, value_columns, {value_record("a", Decimal(1))}, Color::on) ==
        "\x1b[1mNAME  VALUE  UNIT\x1b[0m\na         1\n");
}

TEST_CASE("CSV: RFC 4180 with the columns' keys as header") {
  CHECK(rendered(Format::csv, value_columns,
                 {value_record("a", Decimal(271, -2)),
                  value_record("b", Decimal(100), std::string("%"))}) ==
        "target,name,value,unit\r\nsim:doga-bm,a,2.71,\r\nsim:doga-bm,b,100,%\r\n");
  CHECK(rendered(Format::csv, value_columns, {}) == "target,name,value,unit\r\n");
}

TEST_CASE("CSV: what must be quoted is quoted, what could steer a terminal is shown") {
  struct Row {
    std::string text;
    std::string field;
  };
  const Row rows[] = {
      {"plain text", "plain text"},
      {"a,b", "\"a,b\""},
      {"say \"x\"", "\"say \"\"x\"\"\""},
      {"two\nlines", "\"two\nlines\""},
      {"two\r\nlines", "\"two\r\nlines\""},
      {"tab\tstays", "tab\tstays"},
      {"\x1b]0;title\a", "\\x1b]0;title\\x07"},
      {"21.5 °C \xff", "21.5 °C \uFFFD"},
      {"", ""},
  };
  for (const Row& row : rows) CHECK(csv_cell(row.text) == "target,f\r\n," + row.field + "\r\n");
}

TEST_CASE("CSV: cells as they are, the target, and a header only when the columns change") {
  Caught caught;
  const auto renderer = make_renderer(Format::csv, caught.streams, Verbosity::normal);
  const std::vector<Column> columns = {{"TARGET", "target"}, {"F", "f"}};
  Record record = one_field(Decimal(1, -1));
  record.target = "station3";
  record.fields.front().shown = "0.1 ms";
  for (int round = 0; round < 2; ++round) {
    REQUIRE(renderer->begin(columns));
    REQUIRE(renderer->record(record));
    REQUIRE(renderer->end());
  }
  REQUIRE(renderer->begin(std::vector<Column>{{"G", "g"}}));
  CHECK(caught.out() == "target,f\r\nstation3,0.1\r\nstation3,0.1\r\ntarget,g\r\n");
}

TEST_CASE("a line stands for itself at once, a note is for people only") {
  const Record record = one_field(Decimal(1));
  for (const Format format : {Format::table, Format::csv, Format::json}) {
    Caught caught;
    const auto renderer = make_renderer(format, caught.streams, Verbosity::normal);
    REQUIRE(renderer->line(record, "tcp://127.0.0.1:5000"));
    const bool is_json = format == Format::json;
    CHECK(caught.out().starts_with(is_json ? "{\"schema\"" : "tcp://127.0.0.1:5000\n"));
    renderer->note("mind the gap");
    CHECK(caught.err == "mind the gap\n");

    Caught hushed;
    make_renderer(format, hushed.streams, Verbosity::quiet)->note("mind the gap");
    CHECK(hushed.err.empty());
  }
}

TEST_CASE("a summary is a line on stdout for JSON, and a sentence on stderr for people") {
  const Record counts{.type = "summary",
                      .target = "",
                      .time = moment,
                      .fields = {{"written", Decimal(2)}, {"exit_status", Decimal(0)}}};
  const std::string line =
      R"({"schema":"spindle/1","type":"summary","time":"2026-11-22T10:15:30.123Z","target":null,)"
      R"("written":2,"exit_status":0})"
      "\n";
  struct Row {
    Format format;
    Verbosity verbosity;
    std::string sentence;
    std::string out;
    std::string err;
  };
  const Row rows[] = {
      {Format::json, Verbosity::normal, "2 written", line, ""},
      {Format::json, Verbosity::quiet, "2 written", line, ""},
      {Format::table, Verbosity::normal, "2 written", "", "2 written\n"},
      {Format::table, Verbosity::quiet, "2 written", "", ""},
      {Format::table, Verbosity::normal, "", "", ""},
      {Format::csv, Verbosity::normal, "2 \x1bwritten", "", "2 \\x1bwritten\n"},
      {Format::csv, Verbosity::quiet, "2 written", "", ""},
  };
  for (const Row& row : rows) {
    Caught caught;
    REQUIRE(
        make_renderer(row.format, caught.streams, row.verbosity)->summary(counts, row.sentence));
    CHECK(caught.out() == row.out);
    CHECK(caught.err == row.err);
  }
}

TEST_CASE("an error is always a sentence on stderr, and for JSON also a line on stdout") {
  const Error error{.code = Errc::out_of_range,
                    .message = "9.99 is above 6.00",
                    .hint = "choose a lower one",
                    .target = "station3",
                    .name = "preset.1.target-torque"};
  for (const Format format : {Format::table, Format::json, Format::csv}) {
    Caught caught;
    REQUIRE(make_renderer(format, caught.streams, Verbosity::quiet)->error(error, moment));
    CHECK(caught.err == "spindle: " + describe(error) + "\n");
    const std::string line =
        R"({"schema":"spindle/1","type":"error","time":"2026-11-22T10:15:30.123Z",)"
        R"("target":"station3","code":"usage","exit_status":2,"message":"9.99 is above 6.00",)"
        R"("hint":"choose a lower one","name":"preset.1.target-torque"})"
        "\n";
    CHECK(caught.out() == (format == Format::json ? line : ""));
  }
}

TEST_CASE("an error sentence is one harmless line even when a device words it") {
  Caught caught;
  const Error error{.code = Errc::mismatch, .message = "read \x1b[2J\nback"};
  REQUIRE(make_renderer(Format::table, caught.streams, Verbosity::normal)->error(error, moment));
  CHECK(caught.err.find('\x1b') == std::string::npos);
  CHECK(caught.err.find('\n') == caught.err.size() - 1);
}

TEST_CASE("an error record names what is known and nothing else") {
  const Record bare = error_record({.code = Errc::partial}, moment);
  CHECK(bare.target.empty());
  CHECK(std::get<std::string>(bare.find("message")->cell) ==
        message_of(Error{.code = Errc::partial}));
  CHECK(bare.find("name") == nullptr);
  CHECK(bare.find("register") == nullptr);
  CHECK(bare.find("exception") == nullptr);

  Error refused{.code = Errc::exception_response, .message = "no"};
  refused.register_address = 2;
  refused.exception = 0x0E;
  const Record record = error_record(refused, moment);
  CHECK(std::get<std::string>(record.find("code")->cell) == "refused");
  CHECK(std::get<Decimal>(record.find("exit_status")->cell) == Decimal(6));
  CHECK(std::get<Decimal>(record.find("register")->cell) == Decimal(2));
  CHECK(std::get<Decimal>(record.find("exception")->cell) == Decimal(14));
}

TEST_CASE("an error without a hint says null") {
  for (const spindle::ErrcInfo& row : spindle::errc_table()) {
    const Record record = error_record({.code = row.code}, moment);
    const bool is_null = std::holds_alternative<std::monostate>(record.find("hint")->cell);
    CHECK(is_null == hint_of(Error{.code = row.code}).empty());
  }
}

TEST_CASE("a closed pipe is handed on by every function that writes") {
  for (const Format format : {Format::table, Format::json, Format::csv}) {
    Caught caught;
    caught.streams.out = [](std::string_view) -> Result<void> {
      return tl::unexpected(Error{.code = Errc::closed_pipe});
    };
    const auto renderer = make_renderer(format, caught.streams, Verbosity::normal);
    const auto wrote =
        renderer->begin(value_columns)
            .and_then([&] { return renderer->record(value_record("a", Decimal(1))); })
            .and_then([&] { return renderer->end(); });
    REQUIRE_FALSE(wrote);
    CHECK(wrote.error().code == Errc::closed_pipe);
  }
}

namespace {

std::size_t widest_line(const std::string& text) {
  std::size_t widest = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    widest = std::max(widest, end - begin);
    begin = end + 1;
  }
  return widest;
}

}  // namespace

TEST_CASE("an error is the cause, what can be pasted, and the rest, on lines of 100 columns") {
  Caught caught;
  caught.streams.typed = {"get", "staton3"};
  const auto renderer = make_renderer(Format::table, caught.streams, Verbosity::normal);
  Error error{.code = Errc::unknown_name,
              .message = "unknown target 'staton3'",
              .hint = "did you mean 'station3'?",
              .remedy = {"staton3", "station3"}};
  REQUIRE(renderer->error(error, moment));
  CHECK(caught.err ==
        "spindle: unknown target 'staton3'; did you mean 'station3'?\n"
        "  try: spindle get station3\n");
  caught.err.clear();
  error.hint.clear();
  for (int word = 0; word < 40; ++word) error.hint += "hint ";
  error.hint += "end";
  error.details = {"one", "two"};
  REQUIRE(renderer->error(error, moment));
  CHECK(caught.err.starts_with(
      "spindle: unknown target 'staton3'\n  try: spindle get station3\n  hint hint"));
  CHECK(caught.err.ends_with("end\n  one\n  two\n"));
  CHECK(widest_line(caught.err) <= 100);
}

TEST_CASE("the journal gets an error as one line, and JSON what can be pasted as a key") {
  Caught caught;
  caught.streams.typed = {"get", "staton3"};
  caught.streams.err_is_journal = true;
  const Error error{.code = Errc::unknown_name,
                    .message = "unknown target 'staton3'",
                    .hint = "did you mean 'station3'?",
                    .remedy = {"staton3", "station3"},
                    .details = {"one"}};
  REQUIRE(make_renderer(Format::json, caught.streams, Verbosity::normal)->error(error, moment));
  CHECK(caught.err == "<3>spindle: unknown target 'staton3'; did you mean 'station3'?\n");
  const json told = json::parse(caught.out());
  CHECK(told["try"] == "spindle get station3");
  CHECK(told["details"] == json::array({"one"}));
  CHECK(told["hint"] == "did you mean 'station3'?");
}

TEST_CASE("a sentence is broken at blanks, and a word that is too wide stays whole") {
  std::string words;
  for (int word = 0; word < 60; ++word) words += "word ";
  CHECK(widest_line(wrapped(words)) <= 100);
  CHECK(wrapped("short") == "short");
  const std::string path(150, 'x');
  CHECK(wrapped("in " + path + " it is") == "in\n  " + path + "\n  it is");
  CHECK(wrapped("  begins") == "  begins");
}
