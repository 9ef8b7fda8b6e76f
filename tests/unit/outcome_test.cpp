#include <doctest/doctest.h>

#include <vector>

#include "spindle/commands/context.hpp"

using namespace spindle;
using spindle::commands::Outcome;

namespace {

/// What happened, one thing after the other: an error, or a success.
using Story = std::vector<std::optional<Errc>>;

Outcome told(const Story& story) {
  Outcome outcome;
  for (const std::optional<Errc>& thing : story) {
    if (thing) {
      outcome.fail(Error{.code = *thing});
    } else {
      outcome.succeed();
    }
  }
  return outcome;
}

}  // namespace

TEST_CASE("the status of several things (contract, section 4)") {
  constexpr std::nullopt_t good = std::nullopt;
  struct Case {
    Story story;
    ExitStatus status;
  };
  const std::vector<Case> cases = {
      {{}, ExitStatus::ok},
      {{good}, ExitStatus::ok},
      {{Errc::no_answer}, ExitStatus::no_answer},
      {{Errc::no_answer, Errc::closed}, ExitStatus::no_answer},  // different causes, one status
      {{Errc::no_answer, Errc::connection_refused}, ExitStatus::partial},
      {{good, Errc::exception_response}, ExitStatus::partial},
      {{Errc::exception_response, good}, ExitStatus::partial},
      {{good, Errc::interrupted}, ExitStatus::interrupted},
      {{Errc::no_answer, Errc::interrupted}, ExitStatus::interrupted},
      {{Errc::terminated, good}, ExitStatus::terminated},
      {{Errc::no_answer, Errc::terminated, Errc::terminated}, ExitStatus::terminated},
  };
  for (std::size_t row = 0; row < cases.size(); ++row) {
    CAPTURE(row);
    CHECK(told(cases[row].story).status() == cases[row].status);
  }
}

TEST_CASE("a negative answer is a status of its own, unless something failed") {
  Outcome outcome = told({std::nullopt});
  outcome.negate();
  CHECK(outcome.status() == ExitStatus::negative);
  outcome.fail(Error{.code = Errc::no_answer});
  CHECK(outcome.status() == ExitStatus::partial);
}

TEST_CASE("successes and failures are counted") {
  const Outcome outcome = told({std::nullopt, Errc::no_answer, std::nullopt});
  CHECK(outcome.succeeded() == 2);
  CHECK(outcome.failed() == 1);
}

TEST_CASE("what happened to several tools adds up to one status") {
  constexpr std::nullopt_t good = std::nullopt;
  struct Case {
    std::vector<Story> tools;
    ExitStatus status;
    std::size_t succeeded;
    std::size_t failed;
  };
  const std::vector<Case> cases = {
      {{}, ExitStatus::ok, 0, 0},
      {{{good}, {good, good}}, ExitStatus::ok, 3, 0},
      {{{good}, {Errc::connection_refused}}, ExitStatus::partial, 1, 1},
      {{{Errc::connection_refused}, {Errc::connect_timeout}}, ExitStatus::unreachable, 0, 2},
      {{{Errc::connection_refused}, {}, {Errc::no_answer}}, ExitStatus::partial, 0, 2},
      {{{}, {Errc::no_answer, Errc::bad_checksum}}, ExitStatus::partial, 0, 2},
      {{{Errc::no_answer, good}, {Errc::interrupted}, {Errc::no_answer}},
       ExitStatus::interrupted,
       1,
       3},
      {{{Errc::interrupted, Errc::no_answer}, {good}}, ExitStatus::interrupted, 1, 2},
  };
  for (std::size_t row = 0; row < cases.size(); ++row) {
    CAPTURE(row);
    Outcome all;
    for (const Story& story : cases[row].tools) all.add(told(story));
    CHECK(all.status() == cases[row].status);
    CHECK(all.succeeded() == cases[row].succeeded);
    CHECK(all.failed() == cases[row].failed);
  }
  Outcome all;
  Outcome negative = told({good});
  negative.negate();
  all.add(negative);
  all.add(told({good}));
  CHECK(all.status() == ExitStatus::negative);
}
