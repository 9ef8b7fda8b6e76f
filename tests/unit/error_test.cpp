#include "spindle/base/error.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cctype>
#include <fstream>
#include <set>
#include <string>
#include <vector>

using namespace spindle;
using namespace std::chrono_literals;

TEST_CASE("every error finds its own row, from the first to the last") {
  const auto table = errc_table();
  CHECK(table.size() == static_cast<std::size_t>(Errc::closed_pipe) + 1);
  for (std::size_t i = 0; i < table.size(); ++i) {
    CAPTURE(i);
    CHECK(info(static_cast<Errc>(i)).code == static_cast<Errc>(i));
    CHECK(info(table[i].status).status == table[i].status);
  }
}

TEST_CASE("exit statuses and their names are those of the contract") {
  struct Case {
    int status;
    std::string_view name;
  };
  const Case contract[] = {{0, "ok"},
                           {1, "negative"},
                           {2, "usage"},
                           {3, "bad_file"},
                           {4, "unreachable"},
                           {5, "no_answer"},
                           {6, "refused"},
                           {7, "malformed"},
                           {8, "mismatch"},
                           {9, "partial"},
                           {70, "internal"},
                           {74, "storage"},
                           {130, "interrupted"},
                           {143, "interrupted"}};
  REQUIRE(status_table().size() == std::size(contract));
  for (const auto& row : contract) {
    const auto& [status, name] = row;
    CAPTURE(row.status);
    const StatusInfo& found = info(static_cast<ExitStatus>(status));
    CHECK(static_cast<int>(found.status) == status);
    CHECK(found.name == name);
    CHECK_FALSE(found.meaning.empty());
  }
}

TEST_CASE("the promised table of exit statuses is the table of the code") {
  std::ifstream promises(SPINDLE_SOURCE_DIR "/docs/promises.md");
  std::vector<std::string> rows;
  for (std::string line; std::getline(promises, line);) {
    const bool begins = line == "| status | name | meaning |";
    if (begins || (!rows.empty() && line.starts_with('|'))) rows.push_back(line);
    if (!rows.empty() && !line.starts_with('|')) break;
  }
  std::vector<std::string> expected = {"| status | name | meaning |", "|---|---|---|"};
  for (const StatusInfo& row : status_table()) {
    expected.push_back(
        fmt::format("| {} | {} | {} |", static_cast<int>(row.status), row.name, row.meaning));
  }
  CHECK(rows == expected);
}

TEST_CASE("each error belongs to one exit status") {
  struct Case {
    int status;
    std::vector<Errc> codes;
  };
  const Case cases[] = {
      {0, {Errc::closed_pipe}},
      {1, {Errc::negative}},
      {2,
       {Errc::usage, Errc::unknown_name, Errc::bad_value, Errc::out_of_range, Errc::read_only,
        Errc::not_confirmed, Errc::unverified, Errc::bad_target}},
      {3, {Errc::bad_file}},
      {4,
       {Errc::name_not_found, Errc::connection_refused, Errc::no_route, Errc::connect_timeout,
        Errc::port_missing, Errc::port_busy, Errc::port_unusable}},
      {5, {Errc::no_answer, Errc::incomplete_answer, Errc::closed, Errc::reset}},
      {6, {Errc::exception_response}},
      {7, {Errc::malformed_answer, Errc::bad_checksum, Errc::local_echo}},
      {8, {Errc::mismatch, Errc::wrong_generation, Errc::wrong_model}},
      {9, {Errc::partial}},
      {70, {Errc::internal}},
      {74, {Errc::storage}},
      {130, {Errc::interrupted}},
      {143, {Errc::terminated}},
  };
  std::size_t seen = 0;
  for (const auto& [status, codes] : cases) {
    for (const Errc code : codes) {
      CAPTURE(static_cast<int>(code));
      CHECK(static_cast<int>(Error{.code = code}.status()) == status);
      ++seen;
    }
  }
  CHECK(seen == errc_table().size());
}

TEST_CASE("every sentence of the table reads well, with and without particulars") {
  std::set<std::string> sentences;
  for (const ErrcInfo& row : errc_table()) {
    for (const Error& error :
         {Error{.code = row.code},
          Error{.code = row.code, .tried = "report server id", .waited = 1s, .exception = 2}}) {
      const std::string text = describe(error);
      CAPTURE(text);
      CHECK_FALSE(text.empty());
      CHECK(text.find_first_of("{}\n") == std::string::npos);
      CHECK(text.find("''") == std::string::npos);
      CHECK(std::isupper(static_cast<unsigned char>(text.front())) == 0);
      CHECK_FALSE(text.ends_with('.'));
      CHECK_FALSE(text.ends_with(' '));
    }
    sentences.insert(message_of(Error{.code = row.code}));
  }
  CHECK(sentences.size() == errc_table().size());
}

TEST_CASE("the table's sentence is filled with what was tried") {
  Error error{.code = Errc::no_answer,
              .target = "tcp://192.168.10.23:5000",
              .tried = "report server id",
              .waited = 1s};
  CHECK(describe(error) ==
        "tcp://192.168.10.23:5000: connected, but no answer to 'report server id' within 1s; the "
        "tool may be asleep, or another client holds its session");

  error.tried.clear();
  error.waited.reset();
  CHECK(message_of(error) == "connected, but no answer to the request within the time allowed");

  error.waited = 1003'456'789ns;
  CHECK(message_of(error) == "connected, but no answer to the request within 1003ms");

  error = {.code = Errc::exception_response, .tried = "write register 4002", .exception = 0x0E};
  CHECK(message_of(error) == "the tool refused 'write register 4002' with exception 0x0E");
  error.exception.reset();
  CHECK(message_of(error) == "the tool refused 'write register 4002' with an exception");
}

TEST_CASE("an error's own words go before the table's, and are not filled") {
  const Error error{.code = Errc::no_answer, .message = "no {tried} of '{waited}'", .hint = "wait"};
  CHECK(message_of(error) == "no {tried} of '{waited}'");
  CHECK(hint_of(error) == "wait");
  CHECK(describe(error) == "no {tried} of '{waited}'; wait");
}

TEST_CASE("a description leaves out what is empty") {
  CHECK(describe({.code = Errc::bad_file, .message = "bad"}) == "bad");
  CHECK(describe({.code = Errc::bad_file, .message = "bad", .target = "t"}) == "t: bad");
  CHECK(describe({.code = Errc::bad_file, .message = "bad", .name = "n"}) == "n: bad");
  CHECK(describe(
            {.code = Errc::bad_file, .message = "bad", .hint = "h", .target = "t", .name = "n"}) ==
        "t: n: bad; h");
}

TEST_CASE("a named tool is told with its address, a URL only once") {
  Error error{.code = Errc::bad_file,
              .message = "bad",
              .target = "station3",
              .endpoint = "tcp://192.168.10.23:5000"};
  CHECK(describe(error) == "station3 (tcp://192.168.10.23:5000): bad");
  error.target = "tcp://192.168.10.23";
  CHECK(describe(error) == "tcp://192.168.10.23:5000: bad");
}

TEST_CASE("a refused value brings no hint beside its own words") {
  for (const Errc code : {Errc::bad_value, Errc::out_of_range, Errc::usage}) {
    CHECK(describe({.code = code, .message = "9.99 is above 6.00", .name = "p2"}) ==
          "p2: 9.99 is above 6.00");
  }
}

TEST_CASE("foreign text can break neither the line nor the terminal") {
  CHECK(describe({.code = Errc::bad_file, .message = "a\nb\x1b[31mc\x7f\xC3\xA9"}) ==
        "a b [31mc \xC3\xA9");
}

TEST_CASE("a remedy is what was typed with the right word, as a shell takes it") {
  struct Case {
    std::string name;
    Remedy remedy;
    std::vector<std::string> typed;
    std::string command;
  };
  const Case cases[] = {
      {"none", {}, {"get"}, ""},
      {"a word", {"gte", "get"}, {"gte", "station 3"}, "spindle get 'station 3'"},
      {"the first one only", {"a", "b"}, {"a", "a"}, "spindle b a"},
      {"in front of a value", {"sped", "speed"}, {"set", "sped=900"}, "spindle set speed=900"},
      {"a value", {"TC/AN", "TC/AM"}, {"set", "mode=TC/AN"}, "spindle set mode=TC/AM"},
      {"of a simulated tool",
       {"doga-mb", "doga-bm"},
       {"get", "sim:doga-mb"},
       "spindle get sim:doga-bm"},
      {"a word that was not typed", {"x", "y"}, {"get", "xx"}, ""},
      {"a pattern", {"'", "*"}, {"get", "'"}, "spindle get '*'"},
      {"another command", {.right = "spindle log"}, {"undo"}, "spindle log"},
  };
  for (const Case& row : cases) {
    CAPTURE(row.name);
    CHECK(command_to_try({.code = Errc::usage, .hint = "h", .remedy = row.remedy}, row.typed) ==
          row.command);
  }
}

TEST_CASE("a remedy about a tool needs to know which one") {
  Error error{.code = Errc::unknown_name, .remedy = {.right = "spindle list TARGET"}};
  CHECK(command_to_try(error, {}).empty());
  error.asked_of = "station 3";
  CHECK(command_to_try(error, {}) == "spindle list 'station 3'");
  error.target = "station4";
  CHECK(command_to_try(error, {}) == "spindle list station4");
}

TEST_CASE("the table's command goes with the table's hint") {
  CHECK(command_to_try({.code = Errc::port_missing}, {}) == "ls /dev/serial/by-id");
  CHECK(command_to_try({.code = Errc::port_missing, .hint = "another"}, {}).empty());
}

TEST_CASE("the nearest word is the remedy, or else a command") {
  CHECK(remedy_for("sped", {"mode", "speed"}).right == "speed");
  CHECK(remedy_for("sped", {"mode", "speed"}).wrong == "sped");
  CHECK(remedy_for("zzz", {"mode"}, "spindle list").right == "spindle list");
  CHECK(remedy_for("zzz", {"mode"}, "spindle list").wrong.empty());
}
