// Results of a store, sorted into what may be judged together.
#include "spindle/work/study.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "support/study_bench.hpp"

using namespace spindle;
using namespace spindle::work;
using namespace spindle::test;
using store::Column;
using store::Setting;

namespace {

Study study_of(const Bench& bench) { return {bench.facts, bench.options, bench.exclusions}; }

std::vector<const Stratum*> strata_of(Study& study, const Bench& bench) {
  for (const store::EventView& event : bench.events) study.add(event);
  return study.strata();
}

std::string text(const std::optional<Decimal>& limit) {
  return limit ? without_zeros(*limit).to_string() : "none";
}

using Texts = std::vector<std::string>;

Texts limits_text(const QuantityLimits& limits) { return {text(limits.lower), text(limits.upper)}; }

}  // namespace

TEST_CASE("NG results that came to their end are measurements, the others are counted") {
  Bench bench;
  bench.result(1, 271);
  bench.result(2, 299, 335);
  bench.result(3, 270, 332);
  bench.result(4, 135, 333);
  bench.result(5, 260, 338);
  bench.result(6, 272);
  Study study = study_of(bench);
  const auto strata = strata_of(study, bench);
  REQUIRE(strata.size() == 1);
  const Stratum& stratum = *strata.front();
  CHECK(stratum.ok == 2);
  CHECK(stratum.ng == 4);
  CHECK(stratum.not_completed == 1);
  CHECK(stratum.unclear == 1);
  const StudiedValues values = values_of(stratum, Quantity::torque, bench.options);
  CHECK(values.values == std::vector<double>{2.71, 2.99, 2.7, 2.72});
  CHECK(values.positions == std::vector<std::size_t>{0, 1, 2, 5});
  CHECK(values.breaks.empty());
  CHECK(stratum.codes.at(335).completeness == Completeness::ng);
  CHECK(stratum.codes.at(333).completeness == Completeness::not_completed);
  CHECK(stratum.codes.at(338).completeness == Completeness::unclear);

  bench.options.include_not_completed = true;
  CHECK(values_of(stratum, Quantity::torque, bench.options).values ==
        std::vector<double>{2.71, 2.99, 2.7, 1.35, 2.72});
}

TEST_CASE("without its profile no NG code means anything") {
  Bench bench;
  bench.facts.products.clear();
  bench.result(1, 271);
  bench.result(2, 299, 335);
  Study study = study_of(bench);
  const auto strata = strata_of(study, bench);
  CHECK(strata.front()->unclear == 1);
  CHECK(values_of(*strata.front(), Quantity::torque, bench.options).values.size() == 1);
}

TEST_CASE("loosenings and other events are no results") {
  Bench bench;
  bench.result(1, 271);
  bench.result(2, 90).columns[Column::direction] = 1;
  bench.result(3, 0).kind = "preset-change";
  Study study = study_of(bench);
  const auto strata = strata_of(study, bench);
  CHECK(strata.front()->results.size() == 1);
  CHECK(study.tool(1).loosenings == 1);
  CHECK(study.tool(1).others.at("preset-change") == 1);
}

TEST_CASE("neighbours end at a gap, a restart and a long pause") {
  Bench bench;
  bench.facts.gaps = {{.tool = 1, .epoch = 0, .after = 2, .before = 4, .missed = 1}};
  bench.facts.epochs.push_back({.tool = 1, .ordinal = 1, .reason = store::EpochReason::restart});
  bench.facts.epochs.push_back({.tool = 1, .ordinal = 2, .reason = store::EpochReason::wrap});
  for (const std::int64_t at : {1, 2, 4, 5}) bench.result(at, 271);
  bench.result(6, 271).epoch = 1;
  bench.result(7, 271).epoch = 1;
  bench.result(8, 271).epoch = 2;
  bench.result(8 + 1800, 271).epoch = 2;
  bench.result(8 + 1800 + 1801, 271).epoch = 2;
  Study study = study_of(bench);
  const auto strata = strata_of(study, bench);
  const auto breaks = [&] {
    return values_of(*strata.front(), Quantity::torque, bench.options).breaks;
  };
  CHECK(breaks() == std::vector<std::size_t>{2, 4, 8});
  bench.options.shift_break = std::chrono::hours(1);
  CHECK(breaks() == std::vector<std::size_t>{2, 4});
  CHECK(study.tool(1).missed == 1);
  CHECK_FALSE(study.tool(1).is_at_least);
}

TEST_CASE("a gap counts although the event that ended it is of another preset, or is none") {
  Bench bench;
  bench.facts.gaps = {{.tool = 1, .epoch = 0, .after = 2, .before = 4, .missed = 1},
                      {.tool = 1, .began = bench_second(7), .ended = bench_second(7)}};
  bench.result(1, 271);
  bench.result(2, 271);
  bench.result(4, 150).columns[Column::preset] = 2;
  bench.result(5, 271);
  bench.result(6, 271);
  bench.result(8, 271);
  Study study = study_of(bench);
  const auto strata = strata_of(study, bench);
  REQUIRE(strata.size() == 2);
  CHECK(values_of(*strata.front(), Quantity::torque, bench.options).breaks ==
        std::vector<std::size_t>{2, 4});
  CHECK(study.tool(1).is_at_least);
}

TEST_CASE("tools, presets, settings, firmware and units are never pooled") {
  Bench bench;
  bench.facts.tools.push_back({.id = 2, .name = {"DOGA", "43"}});
  bench.facts.places.push_back({.id = 2, .tool = 2, .name = "station4", .profile = "doga-bm"});
  bench.facts.places.push_back({.id = 3,
                                .tool = 1,
                                .name = "station3",
                                .profile = "doga-bm",
                                .firmware = 2104,
                                .torque_unit = "N.m"});
  bench.facts.settings = {settings(0, 271, 10), settings(4, 280, 10)};
  bench.result(1, 271);
  bench.result(2, 271).columns[Column::preset] = 2;
  bench.result(3, 271).tool = 2;
  bench.events.back().place = 2;
  bench.result(5, 280).columns[Column::target_torque] = 28'000;
  bench.result(6, 280).columns[Column::target_torque] = 28'000;
  bench.events.back().place = 3;
  Study study = study_of(bench);
  const auto strata = strata_of(study, bench);
  REQUIRE(strata.size() == 5);
  CHECK(strata[0]->change.empty());
  CHECK(strata[1]->change == "target 2.71 \u2192 2.80");
  CHECK(strata[2]->change == "firmware 2103 \u2192 2104");
  for (const Stratum* stratum : strata) CHECK(stratum->results.size() == 1);
}

TEST_CASE("a preset that is left and chosen again goes on") {
  Bench bench;
  for (const std::int64_t at : {1, 2, 3, 4}) bench.result(at, 271).columns[Column::preset] = at % 2;
  Study study = study_of(bench);
  CHECK(strata_of(study, bench).size() == 2);
}

TEST_CASE("limits are the tool's own as they were read, or those given") {
  Bench bench;
  bench.facts.settings = {settings(0, 271, 10, 5900, 0)};
  bench.result(1, 271);
  {
    Study study = study_of(bench);
    const Stratum& stratum = *strata_of(study, bench).front();
    CHECK(limits_text(stratum.limits[Quantity::torque]) == Texts{"2.439", "2.981"});
    CHECK(stratum.limits[Quantity::torque].origin == LimitsOrigin::tool);
    CHECK(limits_text(stratum.limits[Quantity::angle]) == Texts{"5900", "none"});
    CHECK(stratum.facts.settings->since == bench_second(0));
  }
  bench.options.joints[{"station3", 2}] = {.lower = Decimal(1), .upper = Decimal(2)};
  bench.options.joints[{"station3", 1}] = {.lower = Decimal(26, -1), .upper = Decimal(29, -1)};
  {
    Study study = study_of(bench);
    const Stratum& stratum = *strata_of(study, bench).front();
    CHECK(limits_text(stratum.limits[Quantity::torque]) == Texts{"2.6", "2.9"});
    CHECK(stratum.limits[Quantity::torque].origin == LimitsOrigin::file);
    CHECK(limits_text(stratum.limits[Quantity::angle]) == Texts{"5900", "none"});
  }
  bench.options.limits[Quantity::torque] =
      files::JointLimits{.lower = Decimal(25, -1), .upper = {}};
  Study study = study_of(bench);
  const Stratum& stratum = *strata_of(study, bench).front();
  CHECK(limits_text(stratum.limits[Quantity::torque]) == Texts{"2.5", "none"});
  CHECK(stratum.limits[Quantity::torque].origin == LimitsOrigin::given);
}

TEST_CASE("there are no limits where the settings are of another target, mode or were not read") {
  Bench bench;
  bench.result(1, 271);
  const auto why = [&] {
    Study study = study_of(bench);
    const QuantityLimits limits = strata_of(study, bench).front()->limits[Quantity::torque];
    CHECK_FALSE(limits.is_any());
    return limits.why_none;
  };
  CHECK(why() == "the settings of the preset were not read");
  bench.facts.settings = {settings(0, 300, 10)};
  CHECK(why() == "the settings of the preset were not read");
  bench.facts.settings = {settings(0, 271, 10)};
  bench.facts.settings.front()[Setting::mode] = 1;
  CHECK(why() == "what a torque limit means in this mode of the preset is not known");
  bench.facts.settings = {settings(0, 271, 0)};
  CHECK(why() == "the preset's torque limit is 0");
}

TEST_CASE("settings that were read just behind a result are those that it was made with") {
  Bench bench;
  bench.facts.settings = {settings(0, 271, 10), settings(5, 280, 8)};
  bench.result(4, 280).columns[Column::target_torque] = 28'000;
  bench.result(6, 280).columns[Column::target_torque] = 28'000;
  Study study = study_of(bench);
  const auto strata = strata_of(study, bench);
  REQUIRE(strata.size() == 1);
  CHECK(limits_text(strata.front()->limits[Quantity::torque]) == Texts{"2.576", "3.024"});
}

TEST_CASE("a target torque of 0 is none") {
  Bench bench;
  bench.facts.settings = {settings(0, 271, 10)};
  bench.result(1, 271);
  bench.result(2, 90, 333).columns[Column::target_torque] = 0;
  bench.result(3, 271);
  Study study = study_of(bench);
  CHECK(strata_of(study, bench).size() == 1);
}

TEST_CASE("a result is taken out by its name only, and stays in the yield") {
  Bench bench;
  bench.exclusions = {{.serial = "42", .epoch = 0, .number = 2, .reason = "test screw"},
                      {.serial = "43", .epoch = 0, .number = 1, .reason = "of another tool"}};
  for (const std::int64_t at : {1, 2, 3}) bench.result(at, 270 + at);
  Study study = study_of(bench);
  const Stratum& stratum = *strata_of(study, bench).front();
  CHECK(stratum.ok == 3);
  CHECK(stratum.excluded == 1);
  CHECK(values_of(stratum, Quantity::torque, bench.options).values ==
        std::vector<double>{2.71, 2.73});
  CHECK(study.exclusions().at(0).is_found);
  CHECK(study.exclusions().at(0).value == "torque 2.72, angle 6300");
  CHECK_FALSE(study.exclusions().at(1).is_found);
}

TEST_CASE("the resolution is that of the tool") {
  const ProductFacts facts = doga_facts();
  CHECK(facts.steps[Quantity::torque] == Decimal(1, -2));
  CHECK(facts.steps[Quantity::angle] == Decimal(1));
  CHECK(facts.loosening == 1);
}

TEST_CASE("results of unknown age are counted") {
  Bench bench;
  bench.result(1, 271).remembered = true;
  bench.result(2, 271).source = "catch-up";
  bench.result(3, 271).source = "catch-up";
  bench.events.back().tool_time = bench_second(3);
  bench.result(4, 271).source = "push";
  Study study = study_of(bench);
  CHECK(strata_of(study, bench).front()->of_unknown_age == 2);
}
