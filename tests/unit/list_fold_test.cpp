#include "commands/list_fold.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using namespace spindle;
using commands::fold;
using report::Record;

namespace {

Record parameter(std::string name, std::int64_t address, std::string title = "Speed",
                 std::string evidence = "manual") {
  return {.type = "parameter",
          .target = {},
          .time = {},
          .fields = {{"name", std::move(name)},
                     {"title", std::move(title)},
                     {"register", report::number(address)},
                     {"evidence", std::move(evidence)}}};
}

std::vector<std::string> shown(const commands::FoldedList& list, const char* key) {
  std::vector<std::string> texts;
  for (const Record& record : list.records) {
    const report::Field& field = *record.find(key);
    texts.push_back(field.shown.empty() ? report::to_text(field.cell) : field.shown);
  }
  return texts;
}

using Texts = std::vector<std::string>;

}  // namespace

TEST_CASE("what is there several times is told once, in the place of the first") {
  const auto list =
      fold({parameter("status", 1), parameter("preset.1.speed", 8),
            parameter("preset.1.angle", 9, "Angle"), parameter("preset.2.speed", 18),
            parameter("preset.2.angle", 19, "Angle", "inferred"), parameter("preset.3.speed", 28),
            parameter("preset.3.angle", 29, "Angle", "inferred")});
  CHECK(shown(list, "name") == Texts{"status", "preset.1-3.speed", "preset.1-3.angle"});
  CHECK(shown(list, "register") == Texts{"1", "8..28", "9..29"});
  CHECK(shown(list, "evidence") == Texts{"manual", "manual", "manual, inferred"});
  CHECK(list.folded == Texts{"preset.1-3"});
}

TEST_CASE("two are no family, and neither are those with a hole or another meaning") {
  const Texts two = {"alarm.1", "alarm.2"};
  CHECK(shown(fold({parameter("alarm.1", 1), parameter("alarm.2", 2)}), "name") == two);
  const auto hole = fold({parameter("a.1", 1), parameter("a.2", 2), parameter("a.4", 4)});
  CHECK(hole.records.size() == 3);
  CHECK(hole.folded.empty());
  const auto other = fold({parameter("a.1", 1), parameter("a.2", 2), parameter("a.3", 3, "Other")});
  CHECK(other.records.size() == 3);
}

TEST_CASE("a name with two numbers, or with none, stays alone") {
  const auto list = fold({parameter("a.1.b.1", 1), parameter("a.1.b.2", 2), parameter("a.1.b.3", 3),
                          parameter("p1", 1), parameter("p2", 2), parameter("p3", 3)});
  CHECK(list.records.size() == 6);
}
