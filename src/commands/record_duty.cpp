#include "record_duty.hpp"

#include <fmt/format.h>

#include <utility>

#include "spindle/base/text.hpp"

namespace spindle::commands {
namespace {

/// How often it is looked at what else is wanted of the program.
constexpr Duration turn_every = std::chrono::milliseconds(200);

/// "3,211"
std::string with_commas(std::uint64_t number) {
  std::string text = fmt::format("{}", number);
  for (std::size_t at = text.size(); at > 3; at -= 3) text.insert(at - 3, ",");
  return text;
}

std::string sentence_of(const Roster::Change& change) {
  std::string text = "the tools were looked up again: ";
  if (change.begun + change.left + change.changed == 0) return text + "all are as before";
  std::string_view separator;
  const auto add = [&](std::size_t count, std::string_view what) {
    if (count == 0) return;
    text += fmt::format("{}{} {}", std::exchange(separator, ", "), count, what);
  };
  add(change.begun, "added");
  add(change.left, "left");
  add(change.changed, "changed");
  add(change.kept, "as before");
  return text;
}

}  // namespace

RecordDuty::RecordDuty(Recorder& recorder, Roster& roster, ServiceNews& news, MetricsFile& metrics,
                       Load load)
    : recorder_(&recorder),
      roster_(&roster),
      news_(&news),
      metrics_(&metrics),
      load_(std::move(load)) {}

void RecordDuty::attend() {
  Clock& clock = recorder_->context().clock;
  do {
    turn();
    // Those that others hold may come back, but not behind the time that was given.
    const bool is_past = clock.now() >= recorder_->stream().until();
    const bool is_over = roster_->is_idle() && (is_past || roster_->standing().paused == 0);
    if (is_over) break;
  } while (clock.sleep_until(clock.now() + turn_every));
  news_->stopping();
  roster_->join();
}

void RecordDuty::turn() {
  const Supervision& supervision = recorder_->context().supervision;
  if (supervision.take_reload && supervision.take_reload()) reload();
  follow_leases();
  const Roster::Standing standing = roster_->standing();
  if (standing.untried == 0) news_->ready();
  news_->status(sentence(standing));
  metrics_->write_when_due();
}

void RecordDuty::follow_leases() {
  Leases* const leases = recorder_->leases();
  if (leases == nullptr) return;
  std::set<std::string> held = leases->held();
  if (held == allowed_) return;
  allowed_ = held;
  roster_->allow(std::move(held));
}

void RecordDuty::reload() {
  news_->reloading();
  auto wanted = load_();
  if (wanted) {
    for (const std::string& note : wanted->notes) recorder_->stream().note(note);
    const std::size_t tools = wanted->tools.size();
    if (recorder_->leases() != nullptr) recorder_->leases()->want(names_of(wanted->tools));
    const Roster::Change change = roster_->want(std::move(wanted->tools));
    recorder_->stream().expect(tools);
    recorder_->stream().note(sentence_of(change));
  } else {
    Error error = std::move(wanted.error());
    if (!error.hint.empty()) error.hint += "; ";
    error.hint += "the tools are recorded as before";
    recorder_->stream().fault(error);
  }
  news_->reloaded();
}

std::string RecordDuty::sentence(const Roster::Standing& standing) {
  RecordCounters& counters = recorder_->counters();
  std::string text = fmt::format("{} of {} connected, ", with_commas(counters.connected()),
                                 with_commas(standing.wanted - standing.paused));
  if (standing.paused > 0) {
    text += fmt::format("{} held elsewhere, ", with_commas(standing.paused));
  }
  const std::uint64_t results = counters.results();
  return text + fmt::format("{} {}, backlog {}", with_commas(results),
                            results == 1 ? "result" : "results",
                            with_commas(recorder_->journal().waiting()));
}

}  // namespace spindle::commands
