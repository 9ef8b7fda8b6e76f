#include <doctest/doctest.h>

#include "page/access.hpp"
#include "page/position.hpp"
#include "page/recorder.hpp"

using namespace spindle;
using namespace spindle::page;

TEST_CASE("page: a position is an id and comes back") {
  const Position position{.event = 12, .gap = 0, .happening = 345};
  CHECK(to_text(position) == "e12.g0.h345");
  CHECK(parse_position("e12.g0.h345") == position);
  for (const char* text : {"", "12", "e1.g2", "e1.g2.h3.", "e1.g2.x3", "e-1.g2.h3", "e1.g2.h",
                           "e1.g2.h99999999999999999999", "e1. g2.h3"}) {
    CAPTURE(text);
    CHECK_FALSE(parse_position(text));
  }
}

TEST_CASE("page: what was told at one position is within another") {
  CHECK(is_within({1, 2, 3}, {1, 2, 3}));
  CHECK(is_within({1, 2, 3}, {9, 2, 4}));
  CHECK_FALSE(is_within({2, 2, 3}, {1, 9, 9}));
  CHECK_FALSE(is_within({1, 3, 3}, {9, 2, 9}));
  CHECK_FALSE(is_within({1, 2, 4}, {9, 9, 3}));
}

TEST_CASE("page: secrets are the same in every character, and none is no secret") {
  const std::string secret = "0123456789abcdef";
  CHECK(is_same_secret(secret, secret));
  for (const char* given : {"", "0123456789abcdeF", "0123456789abcde", "0123456789abcdef0",
                            "0123456789abcdef0123456789abcdef"}) {
    CAPTURE(given);
    CHECK_FALSE(is_same_secret(given, secret));
  }
  CHECK_FALSE(is_same_secret("", ""));
}

TEST_CASE("page: a token in a header or a cookie") {
  CHECK(bearer_of("Bearer abc") == "abc");
  CHECK(bearer_of("bearer  abc ") == "abc");
  CHECK(bearer_of("Basic abc").empty());
  CHECK(bearer_of("Bear").empty());
  CHECK(cookie_of("a=1; spindle=x=y; b=2", "spindle") == "x=y");
  CHECK(cookie_of("notspindle=1", "spindle").empty());
  CHECK(cookie_of("spindle", "spindle").empty());
}

TEST_CASE("page: a value in a query") {
  CHECK(query_value("/?token=a+b/c=d", "token") == "a+b/c=d");
  CHECK(query_value("/?x=1&token=a%2Bb%3d&y", "token") == "a+b=");
  CHECK(query_value("/?token=%4", "token") == "%4");
  CHECK(query_value("/?token=%zz%", "token") == "%zz%");
  CHECK(query_value("/?xtoken=1", "token").empty());
  CHECK(query_value("/token=1", "token").empty());
  CHECK(query_value("/?token", "token").empty());
}

TEST_CASE("page: only names of this computer are its own") {
  for (const char* host : {"127.0.0.1", "127.0.0.1:8470", "localhost:1", "LocalHost", "[::1]:8470",
                           "[::1]", "127.0.0.5:80"}) {
    CAPTURE(host);
    CHECK(is_local_host(host, "127.0.0.5"));
  }
  for (const char* host : {"", "evil.example", "localhost.evil.example:8470", "127.0.0.1.evil",
                           "127.0.0.2", "[::2]", "[::1", ":8470"}) {
    CAPTURE(host);
    CHECK_FALSE(is_local_host(host, "127.0.0.5"));
  }
}

TEST_CASE("page: where to listen") {
  CHECK(url_of(*parse_listen("")) == "http://127.0.0.1:8470");
  CHECK(url_of(*parse_listen("localhost:0")) == "http://127.0.0.1:0");
  CHECK(url_of(*parse_listen("[::1]:80")) == "http://[::1]:80");
  CHECK(is_loopback(*parse_listen("127.3.2.1:80")));
  CHECK(is_loopback(*parse_listen("[::1]:80")));
  CHECK_FALSE(is_loopback(*parse_listen("0.0.0.0:80")));
  CHECK_FALSE(is_loopback(*parse_listen("[::]:80")));
  CHECK_FALSE(is_loopback(*parse_listen("192.0.2.1:80")));
  for (const char* text : {"8470", "127.0.0.1", ":8470", "example.org:80", "127.0.0.1:65536",
                           "::1:80", "[::1]80", "[127.0.0.1]:80", "127.0.0.1:-1"}) {
    CAPTURE(text);
    CHECK_FALSE(parse_listen(text));
  }
}

TEST_CASE("page: whose lock the system lists") {
  const std::string locks =
      "1: POSIX  ADVISORY  WRITE 712 08:01:131 0 EOF\n"
      "2: FLOCK  ADVISORY  WRITE 800 08:01:4711 0 EOF\n"
      "2: -> FLOCK  ADVISORY  WRITE 801 08:01:99 0 EOF\n";
  CHECK(is_listed(locks, {.inode = 4711, .device = "08:01"}));
  CHECK(is_listed(locks, {.inode = 4711, .device = "00:2a", .process = 800}));
  CHECK_FALSE(is_listed(locks, {.inode = 4711, .device = "00:2a", .process = 801}));
  CHECK_FALSE(is_listed(locks, {.inode = 4711, .device = "00:2a"}));
  CHECK_FALSE(is_listed(locks, {.inode = 131, .device = "08:01", .process = 712}));
  CHECK_FALSE(is_listed(locks, {.inode = 99, .device = "08:01", .process = 801}));
  CHECK_FALSE(is_listed("", {.inode = 0, .device = ""}));
}
