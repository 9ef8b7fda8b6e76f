#include "spindle/commands/metrics.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "commands/record_counters.hpp"
#include "spindle/posix/disk.hpp"
#include "support/sample_store.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;
using namespace std::chrono_literals;
using commands::Histogram;
using commands::Metrics;
using commands::to_prometheus;

namespace {

const WallTime noon{std::chrono::milliseconds(1'795'342'530'123)};

store::Gap gap_of(std::optional<std::uint32_t> missed, std::string reason) {
  return {.missed = missed, .reason = std::move(reason)};
}

bool has_line(const std::string& text, const std::string& line) {
  return ("\n" + text).find("\n" + line + "\n") != std::string::npos;
}

}  // namespace

TEST_CASE("metrics: only what is known is there, each metric with its head") {
  CHECK(to_prometheus({.version = "1.2"}) ==
        "# HELP spindle_build_info The version of spindle, as a label.\n"
        "# TYPE spindle_build_info gauge\n"
        "spindle_build_info{version=\"1.2\"} 1\n");
}

TEST_CASE("metrics: results, gaps and links by tool") {
  Metrics metrics;
  metrics.count_event("a", "fastening-ok", 3, noon);
  metrics.count_event("a", "fastening-ok", 3, noon - 5s);
  metrics.count_event("a", "fastening-ng", std::nullopt, noon);
  metrics.count_event("a", "preset-change", 4, noon + 5s);
  metrics.count_gap("a", gap_of(2, "late"));
  metrics.count_gap("a", gap_of(std::nullopt, "late"));
  metrics.links = {{"a", true}, {"b", false}};
  const std::string text = to_prometheus(metrics);
  CHECK(has_line(text, "spindle_results_total{tool=\"a\",preset=\"3\",result=\"ok\"} 2"));
  CHECK(has_line(text, "spindle_results_total{tool=\"a\",preset=\"unknown\",result=\"ng\"} 1"));
  CHECK(has_line(text, "spindle_missed_results_total{tool=\"a\"} 2"));
  CHECK(has_line(text, "spindle_gaps_total{tool=\"a\",reason=\"late\"} 2"));
  CHECK(has_line(text, "spindle_link_up{tool=\"a\"} 1"));
  CHECK(has_line(text, "spindle_link_up{tool=\"b\"} 0"));
  CHECK(has_line(text, "spindle_last_result_timestamp_seconds{tool=\"a\"} 1795342530.123000000"));
}

TEST_CASE("metrics: what stands in a label cannot end it") {
  Metrics metrics;
  metrics.links = {{"a\"} 1\nb\\\xFF", true}};
  CHECK(
      has_line(to_prometheus(metrics), "spindle_link_up{tool=\"a\\\"} 1\\nb\\\\\xEF\xBF\xBD\"} 1"));
}

TEST_CASE("metrics: reasons of gaps are bounded for each tool") {
  Metrics metrics;
  for (int number = 0; number < 40; ++number) {
    metrics.count_gap("a", gap_of(1, fmt::format("reason {}", number)));
  }
  metrics.count_gap("b", gap_of(1, "reason 39"));
  metrics.count_gap("a", gap_of(1, "reason 0"));
  CHECK(metrics.gaps.size() == 18);
  CHECK(metrics.gaps.at({"a", "other"}) == 24);
  CHECK(metrics.gaps.at({"a", "reason 0"}) == 2);
  CHECK(metrics.gaps.at({"b", "reason 39"}) == 1);
  CHECK(metrics.missed.at("a") == 41);
}

TEST_CASE("metrics: a histogram counts each limit and all below it") {
  Histogram histogram;
  for (const Duration took : {Duration(500us), Duration(1ms), Duration(4ms), Duration(1min)}) {
    histogram.add(took);
  }
  Metrics metrics;
  metrics.commits = histogram;
  const std::string text = to_prometheus(metrics);
  CHECK(has_line(text, "# TYPE spindle_store_commit_seconds histogram"));
  CHECK(has_line(text, "spindle_store_commit_seconds_bucket{le=\"0.001\"} 2"));
  CHECK(has_line(text, "spindle_store_commit_seconds_bucket{le=\"0.0025\"} 2"));
  CHECK(has_line(text, "spindle_store_commit_seconds_bucket{le=\"0.005\"} 3"));
  CHECK(has_line(text, "spindle_store_commit_seconds_bucket{le=\"10\"} 3"));
  CHECK(has_line(text, "spindle_store_commit_seconds_bucket{le=\"+Inf\"} 4"));
  CHECK(has_line(text, "spindle_store_commit_seconds_sum 60.005500000"));
  CHECK(has_line(text, "spindle_store_commit_seconds_count 4"));
}

TEST_CASE("metrics: of a sink its backlog and age, and of its forwarder what that counted") {
  Metrics metrics;
  metrics.sinks = {{.name = "plant", .backlog = 3, .oldest = 1500ms},
                   {.name = "live", .delivered = 7, .errors = {{"refused", 2}}}};
  const std::string text = to_prometheus(metrics);
  CHECK(has_line(text, "spindle_sink_backlog{sink=\"plant\"} 3"));
  CHECK(has_line(text, "spindle_sink_backlog{sink=\"live\"} 0"));
  CHECK(has_line(text, "spindle_sink_oldest_seconds{sink=\"plant\"} 1.500000000"));
  CHECK(has_line(text, "spindle_sink_oldest_seconds{sink=\"live\"} 0.000000000"));
  CHECK(has_line(text, "spindle_sink_delivered_total{sink=\"live\"} 7"));
  CHECK(has_line(text, "spindle_sink_errors_total{sink=\"live\",reason=\"refused\"} 2"));
  CHECK(text.find("spindle_sink_delivered_total{sink=\"plant\"}") == std::string::npos);
}

TEST_CASE("metrics: a store says what it holds, and what is new is added") {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/events.db";
  const files::ProfileStore profiles({SPINDLE_SOURCE_DIR "/profiles"}, posix::source_disk());
  test::make_sample_store(path, profiles);
  auto reader = store::Reader::open(path).value();
  std::uint64_t stored = 0;
  REQUIRE(reader->events({.kinds = {"fastening-ok", "fastening-ng"}}, [&](const auto&) {
    ++stored;
    return true;
  }));
  REQUIRE(stored > 0);
  const std::size_t gaps = reader->gaps({}).value().size();
  commands::StoredMetrics source("1");
  for (int time = 0; time < 2; ++time) {
    const auto metrics = source.read(*reader, noon);
    REQUIRE(metrics);
    std::uint64_t results = 0;
    for (const auto& [labels, count] : metrics->results) results += count;
    CHECK(results == stored);
    std::uint64_t told = 0;
    for (const auto& [labels, count] : metrics->gaps) told += count;
    CHECK(told == gaps);
    CHECK(metrics->store_bytes.value_or(0) > 4096);
    CHECK(metrics->sinks.empty());
    CHECK_FALSE(metrics->commits);
    CHECK_FALSE(metrics->pending);
  }
}

TEST_CASE("metrics: a recorder counts what it stored, and forgets a tool that it left") {
  commands::RecordCounters counters;
  counters.begin("a");
  counters.begin("b");
  CHECK(counters.connected() == 0);
  counters.note_link("a", true);
  counters.note_link("b", true);
  CHECK(counters.connected() == 2);
  store::Event event = {.at = noon, .kind = "fastening-ok"};
  counters.note_stored("a", event);
  CHECK(counters.results() == 1);
  counters.leave("a");
  CHECK(counters.connected() == 1);
  CHECK(counters.metrics().links.count("a") == 0);
  CHECK(counters.results() == 1);
}
