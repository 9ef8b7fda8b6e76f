#include "commands/tape.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using namespace spindle;
using commands::Tape;
using report::Column;
using report::Record;

namespace {

const std::vector<Column> values = {{"NAME", "name"}, {"VALUE", "value", report::Align::right}};
const std::vector<Column> actions = {{"ACTION", "action"}};

/// A renderer whose two streams end up in one text, as on a terminal; breaks after some writes.
struct Screen {
  explicit Screen(report::Format format = report::Format::table, int lasts = 1000) : left(lasts) {
    renderer = report::make_renderer(format, streams, report::Talk::normal);
  }
  std::string shown = {};
  int left;
  report::Streams streams{.out = [this](std::string_view text) -> Result<void> {
                            if (left-- <= 0)
                              return tl::unexpected(Error{.code = Errc::closed_pipe});
                            shown += text;
                            return {};
                          },
                          .err = [this](std::string_view text) { shown.append("! ").append(text); },
                          .read_line = [] { return std::nullopt; }};
  std::unique_ptr<report::Renderer> renderer;
};

Record value(std::string target, std::string name, int number) {
  return {.type = "value",
          .target = std::move(target),
          .time = {},
          .fields = {{"name", std::move(name)}, {"value", Decimal(number)}}};
}

Record action(std::string target, std::string name) {
  return {.type = "action", .target = std::move(target), .time = {}, .fields = {{"action", name}}};
}

Record summary(std::string target) {
  return {.type = "summary", .target = std::move(target), .time = {}, .fields = {}};
}

/// A tool that is set and then stores it.
void tell_all(Tape& tape, const std::string& tool) {
  REQUIRE(tape.begin(values));
  tape.note("takes effect later");
  REQUIRE(tape.record(value(tool, "torque", 2)));
  REQUIRE(tape.record(value(tool, "speed", 1000)));
  REQUIRE(tape.end());
  REQUIRE(tape.begin(actions));
  tape.note(tool + ": wears out");
  REQUIRE(tape.record(action(tool, "save")));
  REQUIRE(tape.end());
  REQUIRE(tape.summary(summary(tool), "2 written"));
}

}  // namespace

TEST_CASE("tape: tools are shown one after the other, list by list") {
  Tape one;
  Tape gone;
  Tape two;
  tell_all(one, "one");
  REQUIRE(gone.error({.code = Errc::connection_refused, .hint = "look", .target = "gone"}, {}));
  tell_all(two, "two");
  const std::vector<const Tape*> tapes = {&one, &gone, &two};
  Screen screen;
  REQUIRE(play(tapes, *screen.renderer));
  CHECK(screen.shown ==
        "! takes effect later\n"
        "! spindle: gone: connection refused; look\n"
        "TARGET  NAME    VALUE\n"
        "one     torque      2\n"
        "one     speed    1000\n"
        "two     torque      2\n"
        "two     speed    1000\n"
        "! one: wears out\n"
        "! two: wears out\n"
        "\n"
        "TARGET  ACTION\n"
        "one     save\n"
        "two     save\n"
        "! one: 2 written\n"
        "! two: 2 written\n");
}

TEST_CASE("tape: what was said before the first list belongs to it") {
  Tape tape;
  tape.note("first");
  REQUIRE(tape.begin(values));
  REQUIRE(tape.record(value("one", "torque", 2)));
  CHECK(tape.sections().size() == 1);
  const std::vector<const Tape*> tapes = {&tape};
  Screen screen;
  REQUIRE(play(tapes, *screen.renderer));
  CHECK(screen.shown == "! first\nTARGET  NAME    VALUE\none     torque      2\n");
}

TEST_CASE("tape: errors alone need no table") {
  Tape tape;
  REQUIRE(tape.error({.code = Errc::no_route, .hint = "look", .target = "gone"}, {}));
  const std::vector<const Tape*> tapes = {&tape};
  Screen table;
  REQUIRE(play(tapes, *table.renderer));
  CHECK(table.shown == "! spindle: gone: no route to the tool; look\n");
  Screen json(report::Format::json);
  REQUIRE(play(tapes, *json.renderer));
  CHECK(json.shown.find(R"("type":"error")") != std::string::npos);
  CHECK(json.shown.find(R"("target":"gone")") != std::string::npos);
}

TEST_CASE("tape: lines that stand for themselves stay what they are") {
  Tape tape;
  REQUIRE(tape.line(action("one", "save"), "saved"));
  const std::vector<const Tape*> tapes = {&tape};
  Screen screen;
  REQUIRE(play(tapes, *screen.renderer));
  CHECK(screen.shown == "saved\n");
}

TEST_CASE("tape: nothing is shown any more where nobody reads") {
  Tape one;
  Tape two;
  tell_all(one, "one");
  tell_all(two, "two");
  const std::vector<const Tape*> tapes = {&one, &two};
  for (int lasts = 0; lasts < 2; ++lasts) {
    Screen screen(report::Format::table, lasts);
    const auto played = play(tapes, *screen.renderer);
    REQUIRE_FALSE(played);
    CHECK(played.error().code == Errc::closed_pipe);
    CHECK(screen.shown.find("2 written") == std::string::npos);
  }
}
