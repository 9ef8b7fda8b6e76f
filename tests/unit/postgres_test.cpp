// The PostgreSQL sink without a server: what it sends, what it asks for, and what errors mean. The
// server itself is in tests/end_to_end/test_forward_postgres.py.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "forward/postgres_address.hpp"
#include "forward/postgres_batch.hpp"
#include "forward/postgres_errors.hpp"
#include "forward/postgres_schema.hpp"
#include "support/store_entries.hpp"

using namespace spindle;
using namespace spindle::forward;
using spindle::test::new_event;
using spindle::test::second;

namespace {

std::string word_of(const PostgresAddress& address, const std::string& key) {
  for (const auto& [name, value] : address.words) {
    if (name == key) return value;
  }
  return {};
}

PostgresAddress address_of(const std::string& url, const files::Sink& settings = {}) {
  auto address = postgres_address(url, settings, std::nullopt);
  REQUIRE_MESSAGE(address, describe(address.error()));
  return *address;
}

Parcel event_parcel(std::uint16_t number) {
  Parcel parcel{.id = number, .tool = {.maker = "DOGA", .serial = "42"}, .target = "station3"};
  parcel.json = R"({"type":"event"})";
  parcel.row = new_event(1, 1, number).event;
  return parcel;
}

std::string value_of(const Parcel& parcel, std::size_t place) {
  const std::array one = {&parcel};
  return event_values(one, "line1").at(place).value_or("NULL");
}

}  // namespace

TEST_CASE("a server that is not this computer is checked, unless the URL says otherwise") {
  CHECK(word_of(address_of("postgresql://db.example/plant"), "sslmode") == "verify-full");
  CHECK(word_of(address_of("postgresql://line1@db.example:5433/plant"), "sslmode") ==
        "verify-full");
  CHECK(word_of(address_of("postgresql:///plant?service=plant"), "sslmode") == "verify-full");
  CHECK(word_of(address_of("postgresql://localhost,db.example/plant"), "sslmode") == "verify-full");
  CHECK(word_of(address_of("postgresql://localhost/plant?hostaddr=10.0.0.1"), "sslmode") ==
        "verify-full");
  for (const char* here : {"postgresql://localhost/plant", "postgresql://127.0.0.1:5433/plant",
                           "postgresql://[::1]/plant", "postgresql://%2Frun%2Fpostgresql/plant"}) {
    CAPTURE(here);
    CHECK(word_of(address_of(here), "sslmode").empty());
    CHECK(address_of(here).caution.empty());
  }
  const auto weak = address_of("postgresql://db.example/plant?sslmode=require");
  CHECK(word_of(weak, "sslmode") == "require");
  CHECK(weak.caution.find("sslmode=require") != std::string::npos);
  CHECK(address_of("postgresql://db.example/plant?sslmode=verify-full").caution.empty());
  // Who names a certificate wants it to be looked at.
  files::Sink settings;
  settings.ca_file = "ca.pem";
  const auto local = address_of("postgresql://localhost/plant", settings);
  CHECK(word_of(local, "sslmode") == "verify-full");
  CHECK(word_of(local, "sslrootcert") == "ca.pem");
}

TEST_CASE("a connection that falls silent ends, however long libpq would wait") {
  const auto address = address_of("postgresql://a.example,b.example:5433/plant");
  CHECK(address.hosts == 2);
  CHECK(word_of(address, "tcp_user_timeout") == "10000");
  CHECK(word_of(address, "keepalives_idle") == "5");
  CHECK(word_of(address, "connect_timeout") == "10");
  CHECK(word_of(address_of("postgresql://a/b?connect_timeout=3"), "connect_timeout") == "3");
  CHECK(address_of("postgresql://db.example:5433/plant").shown == "db.example:5433/plant");
  CHECK(address_of("postgresql:///plant").shown == "this computer/plant");
}

TEST_CASE("a password in a URL is refused and never shown") {
  for (const char* url :
       {"postgresql://line1:hunter2@db.example/plant",
        "postgresql://db.example/plant?password=hunter2",
        "postgresql://db.example/plant?sslpassword=hunter2",
        "postgresql://line1:hunter2@db:x/plant", "postgresql://db.example/plant?hunter2",
        "postgresql://line1:hunter2@[db/plant"}) {
    CAPTURE(url);
    const auto address = postgres_address(url, {}, std::nullopt);
    REQUIRE_FALSE(address);
    CHECK(address.error().status() == ExitStatus::usage);
    CHECK(describe(address.error()).find("hunter2") == std::string::npos);
  }
  const auto with_file = postgres_address("postgresql://db.example/plant", {}, "hunter2");
  REQUIRE(with_file);
  CHECK(word_of(*with_file, "password") == "hunter2");
  CHECK(with_file->shown == "db.example/plant");
}

TEST_CASE("an array is read back as it was") {
  PostgresArray array;
  array.add(std::string_view("a,b"));
  array.add(std::string_view("NULL"));
  array.add(std::string_view(""));
  array.add(std::string_view(R"(say "\x")"));
  array.add_null();
  CHECK(std::move(array).take() == R"({"a,b","NULL","","say \"\\x\"",NULL})");
  PostgresArray numbers;
  numbers.add(std::int64_t{-3});
  numbers.add_torque(27'100);
  numbers.add_torque(-1);
  numbers.add_torque(std::nullopt);
  numbers.add_torque(std::numeric_limits<std::int64_t>::max());
  CHECK(std::move(numbers).take() == "{-3,2.7100,-0.0001,NULL,922337203685477.5807}");
}

TEST_CASE("an event goes to its columns exactly") {
  Parcel parcel = event_parcel(7);
  CHECK(value_of(parcel, 0) == R"({"DOGA"})");
  CHECK(value_of(parcel, 3) == "{7}");
  CHECK(value_of(parcel, 4) == R"({"2026-05-28T20:26:47.000Z"})");
  CHECK(value_of(parcel, 5) == "{NULL}");
  CHECK(value_of(parcel, 12) == "{2.7107}");
  CHECK(value_of(parcel, 20) == R"({"\\x)" + [] {
    std::string raw;
    for (int i = 0; i < 20; ++i) raw += "0007";
    return raw;
  }() + R"("})");
  CHECK(value_of(parcel, 21) == "{NULL}");
  CHECK(value_of(parcel, 23) == "{7}");
  CHECK(value_of(parcel, 24) == "line1");
  // As many parameters as the statement has.
  const std::array one = {&std::as_const(parcel)};
  CHECK(event_values(one, "line1").size() == 25);
  CHECK(std::string(insert_events).find("$25") != std::string::npos);
  CHECK(std::string(insert_events).find("$26") == std::string::npos);
}

TEST_CASE("what a database cannot keep is written so that it can, and remarked") {
  using namespace std::string_literals;
  CHECK(clean_text("M\xC3\xA4rz"s).text == "M\xC3\xA4rz");
  CHECK_FALSE(clean_text("M\xC3\xA4rz"s).is_changed);
  CHECK(clean_text("A\0B"s).text == "A\\x00B");
  CHECK(clean_text("\xFF\xC3"s).text == "\\xFF\\xC3");
  CHECK(clean_text("\xED\xA0\x80"s).is_changed);
  CHECK(clean_json(R"({"a":"x\u0000y"})").text == R"({"a":"x\ufffdy"})");
  CHECK(clean_json(R"({"a":"x\\u0000y"})").text == R"({"a":"x\\u0000y"})");
  CHECK_FALSE(clean_json(R"({"a":"x\\u0000y"})").is_changed);
  CHECK(clean_json(R"({"a":"x\\\u0000y"})").is_changed);
  Parcel parcel = event_parcel(1);
  CHECK(remark_on(parcel).empty());
  std::get<store::Event>(parcel.row).barcode = "A\0B"s;
  CHECK_FALSE(remark_on(parcel).empty());
  CHECK(value_of(parcel, 18) == R"({"A\\x00B"})");
}

TEST_CASE("columns that would round or refuse values are not taken") {
  const auto fault = [](const WantedColumn& wanted, std::optional<std::string> type) {
    const auto found = fault_of(wanted, {.has_table = true, .type = std::move(type)});
    return found ? found->message : "";
  };
  const WantedColumn torque = {"spindle_event", "torque", "numeric(19,4)"};
  for (const char* good : {"numeric", "numeric(10,4)", "numeric(19,4)", "numeric(12,6)"}) {
    CAPTURE(good);
    CHECK(fault(torque, good).empty());
  }
  for (const char* bad : {"numeric(10,2)", "numeric(8,4)", "double precision", "numeric(10)"}) {
    CAPTURE(bad);
    CHECK_FALSE(fault(torque, bad).empty());
  }
  const WantedColumn at = {"spindle_event", "at", "timestamp with time zone"};
  CHECK(fault(at, "timestamp(3) with time zone").empty());
  CHECK_FALSE(fault(at, "timestamp(0) with time zone").empty());
  CHECK_FALSE(fault(at, "timestamp without time zone").empty());
  CHECK(fault(at, std::nullopt) == "table spindle_event has no column at");
  const auto missing = fault_of(at, {});
  REQUIRE(missing);
  CHECK(missing->message == "the database has no table spindle_event");
  CHECK(missing->status() == ExitStatus::mismatch);
  CHECK(hint_of(*missing).find("--print-schema") != std::string::npos);
}

TEST_CASE("every column that is checked stands in the schema that is printed") {
  const std::string_view schema = postgres_schema();
  for (const WantedColumn& column : wanted_columns()) {
    CAPTURE(column.table);
    CAPTURE(column.name);
    const std::size_t table = schema.find("CREATE TABLE " + std::string(column.table) + " (");
    REQUIRE(table != std::string_view::npos);
    const std::string_view body = schema.substr(table, schema.find("\n);", table) - table);
    CHECK(body.find("\n  " + std::string(column.name) + " ") != std::string_view::npos);
  }
}

TEST_CASE("errors of a connection are told apart") {
  const struct {
    std::string text;
    ExitStatus status;
  } rows[] = {
      {"connection to server at \"127.0.0.1\", port 1 failed: Connection refused\n"
       "\tIs the server running on that host and accepting TCP/IP connections?\n",
       ExitStatus::unreachable},
      {"could not translate host name \"db\" to address: Name or service not known\n",
       ExitStatus::unreachable},
      {"connection to server at \"10.0.0.1\", port 5432 failed: Connection timed out\n",
       ExitStatus::unreachable},
      {"connection to server at \"::1\", port 1 failed: FATAL:  57P03: the database system is "
       "starting up\nLOCATION:  ProcessStartupPacket, postmaster.c:2440\n",
       ExitStatus::unreachable},
      {"connection to server at \"127.0.0.1\", port 1 failed: FATAL:  28P01: password "
       "authentication failed for user \"line1\"\nLOCATION:  auth_failed, auth.c:337\n",
       ExitStatus::refused},
      {"connection to server at \"127.0.0.1\", port 1 failed: fe_sendauth: no password supplied\n",
       ExitStatus::refused},
      {"connection to server at \"127.0.0.1\", port 1 failed: FATAL:  3D000: database \"x\" does "
       "not exist\n",
       ExitStatus::refused},
      {"connection to server at \"127.0.0.1\", port 1 failed: SSL error: certificate verify "
       "failed\n",
       ExitStatus::mismatch},
      {"connection to server at \"127.0.0.1\", port 1 failed: server certificate for \"db\" does "
       "not match host name \"localhost\"\n",
       ExitStatus::mismatch},
      {"connection to server at \"127.0.0.1\", port 1 failed: root certificate file "
       "\"/root/.postgresql/root.crt\" does not exist\n",
       ExitStatus::bad_file},
      {"connection to server at \"127.0.0.1\", port 1 failed: server closed the connection "
       "unexpectedly\n",
       ExitStatus::no_answer},
  };
  for (const auto& row : rows) {
    CAPTURE(row.text);
    const Error error = connection_error(row.text);
    CHECK(error.status() == row.status);
    CHECK(error.message.find("LOCATION") == std::string::npos);
    CHECK(error.message.find("Is the server running") == std::string::npos);
    CHECK(error.message.find('\n') == std::string::npos);
  }
  CHECK(connection_error(rows[4].text).message.find("28P01") == std::string::npos);
}

TEST_CASE("what a server says against a statement is told apart") {
  CHECK(statement_error("42P01", "x").status() == ExitStatus::mismatch);
  CHECK(statement_error("42501", "x").status() == ExitStatus::refused);
  CHECK(statement_error("57P01", "x").status() == ExitStatus::unreachable);
  CHECK(statement_error("40P01", "x").status() == ExitStatus::no_answer);
  CHECK(statement_error("22021", "x").code == Errc::bad_value);
}
