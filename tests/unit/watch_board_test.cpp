#include "commands/watch_board.hpp"

#include <doctest/doctest.h>

#include <set>
#include <sstream>
#include <string>
#include <vector>

using namespace spindle;
using commands::WatchBoard;
using report::Align;
using report::Color;
using report::Column;
using report::Field;
using report::Record;
using report::Tone;

namespace {

const std::vector<Column> columns = {{"TIME", "time", Align::left, 24},
                                     {"KIND", "kind", Align::left, 16},
                                     {"NUMBER", "number", Align::right, 6, report::left_out(2)},
                                     {"PRESET", "preset", Align::right, 6},
                                     {"TORQUE N.m", "torque", Align::right, 7},
                                     {"RESULT", "result", Align::left, 6},
                                     {"SOURCE", "source", Align::left, 8},
                                     {"TEXT", "text", Align::left, 1}};

Record link_of(std::string target, std::string state, std::int64_t attempt = 0) {
  return {.type = "link",
          .target = std::move(target),
          .time = {},
          .fields = {{"state", std::move(state)}, {"attempt", report::number(attempt)}}};
}

Record result(std::string target, std::string verdict, std::int64_t preset = 1) {
  const Tone tone = verdict == "NG" ? Tone::bad : Tone::good;
  return {.type = "event",
          .target = std::move(target),
          .time = {},
          .fields = {{"number", report::number(1962)},
                     {"preset", report::number(preset)},
                     {"torque", Decimal(272, -2)},
                     {.key = "result", .cell = report::text_or_null(verdict), .tone = tone}}};
}

std::vector<std::string> texts(const WatchBoard& board, std::size_t most, std::size_t room,
                               Color color = Color::off) {
  std::vector<std::string> all;
  for (const report::ScreenLine& line : board.lines(most, room, color)) all.push_back(line.text);
  return all;
}

using Texts = std::vector<std::string>;

}  // namespace

TEST_CASE("each tool has a line: its link, its last result, its counts") {
  WatchBoard board({"station3", "station4"}, columns);
  CHECK(texts(board, 9, 80) ==
        Texts{"station3  connecting  0 OK  0 NG", "station4  connecting  0 OK  0 NG"});
  board.note(link_of("station3", "connected"), "preset");
  board.note(link_of("station4", "reconnecting", 3), "preset");
  board.note(result("station3", "OK"), "preset");
  board.note(result("station3", "NG", 2), "preset");
  CHECK(texts(board, 9, 80) ==
        Texts{"station3  connected         number 1962  preset 2  2.72 N.m  NG  1 OK  1 NG",
              "station4  reconnecting (3)                                       0 OK  0 NG"});
  CHECK(texts(board, 9, 66)[0] == "station3  connected         preset 2  2.72 N.m  NG  1 OK  1 NG");
}

TEST_CASE("no number is cut, and NG stays to the last") {
  WatchBoard board({"press"}, columns);
  board.note(link_of("press", "connected"), "preset");
  for (int count = 0; count < 14; ++count) board.note(result("press", "OK"), "preset");
  board.note(result("press", "NG", 2), "preset");
  const std::set<std::string> whole = {"1962", "2", "2.72", "14", "1"};
  for (std::size_t room = 80; room >= 16; --room) {
    CAPTURE(room);
    const std::string line = texts(board, 1, room)[0];
    CAPTURE(line);
    CHECK(line.size() <= room);
    CHECK(line.find("NG") != std::string::npos);
    CHECK(line.find("1 NG") != std::string::npos);
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      if (word.find_first_of("0123456789") != std::string::npos) CHECK(whole.contains(word));
    }
  }
}

TEST_CASE("a torque whose unit each result says has it beside it") {
  std::vector<Column> with_unit = columns;
  with_unit[4].title = "TORQUE";
  with_unit.insert(with_unit.begin() + 5, {"UNIT", "torque_unit", Align::left, 4});
  WatchBoard board({"a"}, with_unit);
  board.note(link_of("a", "connected"), "preset");
  Record event = result("a", "OK");
  event.fields.push_back({"torque_unit", "kgf.cm"});
  board.note(event, "preset");
  CHECK(texts(board, 9, 99)[0].find("torque 2.72 kgf.cm") != std::string::npos);
  CHECK(texts(board, 9, 30)[0].find("kgf") == std::string::npos);
}

TEST_CASE("what is no result tells the preset, and counts nothing") {
  WatchBoard board({"a"}, columns);
  board.note(link_of("a", "connected"), "preset");
  board.note(result("a", "OK", 1), "preset");
  board.note(result("a", "", 5), "preset");
  Record remembered = result("a", "OK", 9);
  remembered.fields.push_back({"remembered", true});
  board.note(remembered, "preset");
  board.note(result("stranger", "NG"), "preset");
  CHECK(texts(board, 9, 99) ==
        Texts{"a  connected  number 1962  preset 5  2.72 N.m  OK  1 OK  0 NG"});
}

TEST_CASE("more tools than lines: the last line says how many, and how they are") {
  WatchBoard board({"a", "b", "c", "d"}, columns);
  for (const char* target : {"a", "b", "c"}) board.note(link_of(target, "connected"), "preset");
  board.note(result("c", "NG"), "preset");
  CHECK(texts(board, 2, 80) == Texts{"a  connected  0 OK  0 NG", "and 3 more: 2 connected, 1 NG"});
  CHECK(texts(board, 4, 80).size() == 4);
  CHECK(texts(board, 1, 80) == Texts{"and 4 more: 3 connected, 1 NG"});
  for (const auto& line : board.lines(2, 15, Color::off)) CHECK(line.width <= 15);
}

TEST_CASE("colour stands beside words, and takes no room") {
  WatchBoard board({"a"}, columns);
  board.note(link_of("a", "lost"), "");
  board.note(result("a", "NG"), "");
  const auto line = board.lines(1, 80, Color::on).front();
  CHECK(line.text.find("\x1b[31mlost\x1b[0m") != std::string::npos);
  CHECK(line.text.find("\x1b[31mNG\x1b[0m") != std::string::npos);
  CHECK(line.width == texts(board, 1, 80).front().size());
}

TEST_CASE("a motor has no results, but a state") {
  WatchBoard board({"m"}, {{"TIME", "time", Align::left, 24},
                           {"KIND", "kind", Align::left, 8},
                           {"SPEED", "speed", Align::right, 6},
                           {"TEXT", "text", Align::left, 1}});
  board.note(link_of("m", "connected"), "");
  board.note({.type = "event",
              .target = "m",
              .time = {},
              .fields = {{"kind", "started"}, {"speed", report::number(300)}}},
             "");
  CHECK(texts(board, 1, 80) == Texts{"m  connected  started  speed 300"});
}
