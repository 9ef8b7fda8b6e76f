// What a report says of results, on a terminal and as a page.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "commands/exact_numbers.hpp"
#include "commands/report_assessment.hpp"
#include "commands/report_curves.hpp"
#include "commands/report_page.hpp"
#include "commands/report_selection.hpp"
#include "commands/report_text.hpp"
#include "support/study_bench.hpp"

using namespace spindle;
using namespace spindle::commands;
using namespace spindle::test;

namespace {

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

/// A report on what is added to a bench.
struct Printed {
  Bench bench = {};
  ReportOptions options = {};
  StoredCurves curves = {};

  /// Values that go around a mean, two hundredths up and down.
  void add(std::size_t count, std::int64_t mean = 271, std::int64_t begin = 1) {
    constexpr std::array<std::int64_t, 8> pattern = {0, 2, -1, 1, -2, 0, 1, -1};
    for (std::size_t i = 0; i < count; ++i) {
      const auto at = begin + static_cast<std::int64_t>(i);
      auto& event = bench.result(at, mean + pattern[i % 8]);
      event.columns[Column::a3] = 6300 + 10 * pattern[(i * 3) % 8];
    }
  }

  template <typename Use>
  auto with_report(Use use) const {
    Study study(bench.facts, bench.options, bench.exclusions);
    for (const store::EventView& event : bench.events) study.add(event);
    return use(assess_study(study, options));
  }

  [[nodiscard]] std::string text() const {
    return with_report([](const Assessed& assessed) {
      std::string text;
      for (const std::string& line : report_lines(assessed, zone)) text += line + '\n';
      return text;
    });
  }
  [[nodiscard]] std::string page() const {
    return with_report([&](const Assessed& assessed) {
      return report_page(assessed, {.zone = zone,
                                    .made = bench_second(9000),
                                    .version = "9.9",
                                    .options = options,
                                    .curves = curves});
    });
  }
  /// Of the torque of the first stratum.
  [[nodiscard]] statistics::Assessment torque() const {
    return with_report([](const Assessed& assessed) {
      return assessed.strata.front().quantities[Quantity::torque].assessment;
    });
  }
  [[nodiscard]] std::vector<std::string> unmet() const {
    return with_report([](const Assessed& assessed) { return assessed.unmet; });
  }

  static constexpr ReportZone zone = {std::chrono::minutes(60)};
};

}  // namespace

TEST_CASE("one aborted rundown does not ruin Ppk") {
  Printed printed;
  printed.bench.facts.settings = {settings(0, 271, 10)};
  printed.add(100);
  const double before = printed.torque().performance.index->value;
  printed.bench.result(101, 135, 333);
  CHECK(printed.torque().performance.index->value == before);
  CHECK(contains(printed.text(), "not completed and left out of the statistics: 1 (E333 1)"));
  printed.bench.options.include_not_completed = true;
  CHECK(printed.torque().performance.index->value < 1);
  CHECK(contains(printed.text(), "not completed, yet in the statistics as you asked: 1 (E333 1)"));
}

TEST_CASE("what the limits rejected is in the index") {
  Printed printed;
  printed.bench.facts.settings = {settings(0, 271, 10)};
  printed.add(100);
  const double before = printed.torque().performance.index->value;
  printed.bench.result(101, 300, 335);
  CHECK(printed.torque().moments.count() == 101);
  CHECK(printed.torque().performance.index->value < before / 2);
}

TEST_CASE("a shift of today is seen against the baseline, not hidden in new limits") {
  Printed printed;
  printed.bench.facts.settings = {settings(0, 271, 10)};
  printed.add(200);
  const statistics::ControlLimits before = printed.torque().chart->limits;
  printed.add(40, 276, 201);
  const statistics::Assessment after = printed.torque();
  CHECK(after.chart->limits.baseline.count < 200);
  CHECK(after.chart->limits.upper == before.upper);
  CHECK(after.chart->limits.upper != doctest::Approx(2.981));
  CHECK(after.chart->stability.verdict == statistics::Verdict::unstable);
  CHECK_FALSE(after.capability);
  CHECK(contains(printed.page(), "baseline: "));
}

TEST_CASE("one limit has an index of its own, and none of two sides") {
  Printed printed;
  printed.bench.options.limits[Quantity::torque] =
      files::JointLimits{.lower = std::nullopt, .upper = Decimal(28, -1)};
  printed.add(60);
  const statistics::Indices indices = printed.torque().performance;
  CHECK(indices.index->name == statistics::IndexName::ppu);
  CHECK_FALSE(indices.centred);
  CHECK(contains(printed.text(), "limits up to 2.8 (given)"));
  CHECK(contains(printed.text(), "one limit"));
  CHECK(contains(printed.page(), "Ppu"));
}

TEST_CASE("few values, no limits and a coarse resolution are said") {
  Printed printed;
  printed.add(29);
  CHECK(contains(printed.text(), "no limits (the settings of the preset were not read)"));
  printed.bench.facts.settings = {settings(0, 271, 10)};
  CHECK(contains(printed.text(), "only 29 values, 30 are needed"));
  printed.bench.events.clear();
  for (std::int64_t at = 1; at <= 60; ++at) printed.bench.result(at, 271 + (at % 9 == 0 ? 1 : 0));
  CHECK(contains(printed.text(), "too coarse"));
  CHECK(contains(printed.page(), "too coarse"));
}

TEST_CASE("what was missed and what was taken out is printed everywhere") {
  Printed printed;
  printed.bench.facts.gaps = {{.tool = 1,
                               .after = 10,
                               .before = 15,
                               .missed = 4,
                               .at_least = true,
                               .began = bench_second(10),
                               .ended = bench_second(15),
                               .reason = "link lost"}};
  printed.bench.exclusions = {{.serial = "42", .epoch = 0, .number = 3, .reason = "test <screw>"}};
  printed.add(10);
  printed.add(20, 271, 15);
  CHECK(contains(printed.text(), "missed 4 or more"));
  CHECK(contains(printed.text(), "excluded: 42/0/3: test <screw> (torque 2.70, angle 6310)"));
  const std::string page = printed.page();
  CHECK(contains(page, "4 or more"));
  CHECK(contains(page, "link lost"));
  CHECK(contains(page, "Excluded by hand: 42/0/3"));
  CHECK(contains(page, "test &lt;screw&gt;"));
}

TEST_CASE("times have a zone") {
  Printed printed;
  printed.add(30);
  CHECK(contains(printed.text(), "UTC+01:00"));
  CHECK(contains(printed.page(), "UTC+01:00"));
}

TEST_CASE("Cmk is printed only when it was asked for, with its condition") {
  Printed printed;
  printed.bench.facts.settings = {settings(0, 271, 10)};
  printed.add(100);
  CHECK_FALSE(contains(printed.text(), "Cmk"));
  CHECK_FALSE(contains(printed.page(), "Cmk"));
  printed.options.machine = MachineStudy::yes;
  CHECK(contains(printed.text(), "Cmk"));
  CHECK(contains(printed.page(), "no test by VDI/VDE 2645-2"));
}

TEST_CASE("a page needs nothing else, and what comes from outside is text") {
  Printed printed;
  printed.bench.facts.places.front().name = "<script>alert(1)</script>\"'&";
  printed.bench.facts.tools.front().name.serial = "</style><img onerror=y>";
  printed.bench.facts.places.front().torque_unit = "<b>";
  printed.bench.facts.settings = {settings(0, 271, 10)};
  printed.add(60);
  printed.bench.result(100, 260, 335);
  const std::string page = printed.page();
  CHECK_FALSE(contains(page, "<script"));
  CHECK_FALSE(contains(page, "<img"));
  CHECK_FALSE(contains(page, "<b>"));
  CHECK_FALSE(contains(page, "href="));
  CHECK_FALSE(contains(page, "src="));
  CHECK_FALSE(contains(page, "url("));
  CHECK(contains(page, "&lt;script&gt;alert(1)&lt;/script&gt;"));
  CHECK(contains(page, "default-src 'none'; style-src 'unsafe-inline'"));
  CHECK(contains(page, "VDI/VDE 2645-2"));
}

TEST_CASE("a page that zooms has two scripts, whatever a unit is called") {
  Printed printed;
  printed.options.interactive = true;
  printed.bench.facts.places.front().torque_unit = "</script><script>alert(1)</script>";
  printed.add(60);
  const std::string page = printed.page();
  std::size_t scripts = 0;
  for (auto at = page.find("<script>"); at != std::string::npos;
       at = page.find("<script>", at + 1)) {
    ++scripts;
  }
  CHECK(scripts == 2);
  CHECK_FALSE(contains(page, "</script><script>alert"));
  CHECK(contains(page, "script-src 'sha256-"));
  CHECK_FALSE(contains(page, "script-src 'unsafe"));
}

TEST_CASE("what a product does not measure is not printed") {
  Printed printed;
  printed.add(40);
  for (auto& event : printed.bench.events) event.columns[Column::a3] = std::nullopt;
  CHECK_FALSE(contains(printed.text(), "angle a3"));
  CHECK_FALSE(contains(printed.page(), "angle a3"));
}

TEST_CASE("many strata are small charts, and the page says which stand in full") {
  Printed printed;
  for (std::int64_t preset = 1; preset <= 20; ++preset) {
    for (std::int64_t i = 0; i < 30; ++i) {
      printed.bench.result(preset * 100 + i, 271 + i % 3).columns[Column::preset] = preset;
    }
  }
  const std::string page = printed.page();
  CHECK(contains(page, "Drawn in full: the 6 of 20 tools and presets with most results"));
  CHECK(contains(page, "Other tools and presets"));
  CHECK(page.size() < 600'000);
}

TEST_CASE("requirements are met by the index, or by its lower bound") {
  Printed printed;
  printed.bench.facts.settings = {settings(0, 271, 3)};
  printed.add(100);
  const statistics::Index index = *printed.torque().performance.index;
  REQUIRE(index.low < index.value);
  printed.options.required = {fmt::format("ppk={:.3f}", index.value - 0.01), "yield=100%"};
  CHECK(printed.unmet().empty());
  printed.options.required_of = RequiredOf::lower_bound;
  CHECK(printed.unmet().size() == 2);
  printed.options.required = {"ppk=1.0", "angle.ppk=0.1", "pp=0.1"};
  printed.options.required_of = RequiredOf::index;
  const auto unmet = printed.unmet();
  REQUIRE(unmet.size() == 1);
  CHECK(unmet.front() == "station3 preset 1: angle.ppk=0.1 is not met: it cannot be judged");
}

TEST_CASE("requirements that cannot be read are refused") {
  for (const char* text : {"ppk", "ppk=", "ppk=x", "ppm=3", "depth.ppk=1", "ppk=-1", "ppk=50%",
                           "yield=1.2", "yield=101%"}) {
    CAPTURE(text);
    const auto read = read_requirements({text});
    REQUIRE_FALSE(read);
    CHECK(read.error().code == Errc::usage);
  }
  const auto read = read_requirements({"yield=99.5%", "angle.cpk=1.67"});
  REQUIRE(read);
  CHECK(read->at(0).least == Decimal(995, -3));
  CHECK(read->at(1).quantity == Quantity::angle);
}

TEST_CASE("limits and exclusions that cannot be read are refused") {
  for (const char* text : {"2.44", ":", "2.98:2.44", "a:b", "1:2:3"}) {
    CAPTURE(text);
    CHECK_FALSE(study_options_of({.limits = text}, {}));
  }
  CHECK(study_options_of({.limits = "2.44:"}, {})->limits[Quantity::torque]->lower ==
        Decimal(244, -2));
  CHECK_FALSE(exclusions_of({.excluded = {"42/0/1"}}));
  CHECK_FALSE(exclusions_of({.excluded = {"42/0"}, .reasons = {"x"}}));
  CHECK_FALSE(exclusions_of({.excluded = {"/0/1"}, .reasons = {"x"}}));
  CHECK_FALSE(exclusions_of({.excluded = {"42/0/70000"}, .reasons = {"x"}}));
  const auto exclusions = exclusions_of({.excluded = {"a/b/3/17"}, .reasons = {"x"}});
  REQUIRE(exclusions);
  CHECK(exclusions->front().serial == "a/b");
  CHECK(exclusions->front().epoch == 3);
  CHECK(exclusions->front().number == 17);
}

TEST_CASE("numbers of records are exact decimals") {
  CHECK(to_double(Decimal(2439, -3)) == 2.439);
  CHECK(to_decimal(2.439)->to_string() == "2.439");
  CHECK(to_decimal(1.0 / 3)->to_string() == "0.333333333");
  CHECK(to_decimal(6300)->to_string() == "6300");
  CHECK_FALSE(to_decimal(1e300));
  CHECK_FALSE(to_decimal(std::nan("")));
}
