#include "commands/recording.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using namespace spindle;
using commands::RecordingRenderer;
using report::Column;
using report::Record;

namespace {

const std::vector<Column> values = {{"NAME", "name"}, {"VALUE", "value", report::Align::right}};
const std::vector<Column> actions = {{"ACTION", "action"}};

/// A renderer whose two streams end up in one text, as on a terminal; breaks after some writes.
struct Screen {
  explicit Screen(report::Format format = report::Format::table, int lasts = 1000) : left(lasts) {
    renderer = report::make_renderer(format, streams, report::Verbosity::normal);
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
void tell_all(RecordingRenderer& recording, const std::string& tool) {
  REQUIRE(recording.begin(values));
  recording.note("takes effect later");
  REQUIRE(recording.record(value(tool, "torque", 2)));
  REQUIRE(recording.record(value(tool, "speed", 1000)));
  REQUIRE(recording.end());
  REQUIRE(recording.begin(actions));
  recording.note(tool + ": wears out");
  REQUIRE(recording.record(action(tool, "save")));
  REQUIRE(recording.end());
  REQUIRE(recording.summary(summary(tool), "2 written"));
}

}  // namespace

TEST_CASE("recording: tools are shown one after the other, list by list") {
  RecordingRenderer one;
  RecordingRenderer gone;
  RecordingRenderer two;
  tell_all(one, "one");
  REQUIRE(gone.error({.code = Errc::connection_refused, .hint = "look", .target = "gone"}, {}));
  tell_all(two, "two");
  const std::vector<const RecordingRenderer*> recordings = {&one, &gone, &two};
  Screen screen;
  REQUIRE(replay(recordings, *screen.renderer));
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

TEST_CASE("recording: what was said before the first list belongs to it") {
  RecordingRenderer recording;
  recording.note("first");
  REQUIRE(recording.begin(values));
  REQUIRE(recording.record(value("one", "torque", 2)));
  CHECK(recording.sections().size() == 1);
  const std::vector<const RecordingRenderer*> recordings = {&recording};
  Screen screen;
  REQUIRE(replay(recordings, *screen.renderer));
  CHECK(screen.shown == "! first\nTARGET  NAME    VALUE\none     torque      2\n");
}

TEST_CASE("recording: errors alone need no table") {
  RecordingRenderer recording;
  REQUIRE(recording.error({.code = Errc::no_route, .hint = "look", .target = "gone"}, {}));
  const std::vector<const RecordingRenderer*> recordings = {&recording};
  Screen table;
  REQUIRE(replay(recordings, *table.renderer));
  CHECK(table.shown == "! spindle: gone: no route to the tool; look\n");
  Screen json(report::Format::json);
  REQUIRE(replay(recordings, *json.renderer));
  CHECK(json.shown.find(R"("type":"error")") != std::string::npos);
  CHECK(json.shown.find(R"("target":"gone")") != std::string::npos);
}

TEST_CASE("recording: lines that stand for themselves stay what they are") {
  RecordingRenderer recording;
  REQUIRE(recording.line(action("one", "save"), "saved"));
  const std::vector<const RecordingRenderer*> recordings = {&recording};
  Screen screen;
  REQUIRE(replay(recordings, *screen.renderer));
  CHECK(screen.shown == "saved\n");
}

TEST_CASE("recording: nothing is shown any more where the reader is gone") {
  RecordingRenderer one;
  RecordingRenderer two;
  tell_all(one, "one");
  tell_all(two, "two");
  const std::vector<const RecordingRenderer*> recordings = {&one, &two};
  for (int lasts = 0; lasts < 2; ++lasts) {
    Screen screen(report::Format::table, lasts);
    const auto drawn = replay(recordings, *screen.renderer);
    REQUIRE_FALSE(drawn);
    CHECK(drawn.error().code == Errc::closed_pipe);
    CHECK(screen.shown.find("2 written") == std::string::npos);
  }
}
