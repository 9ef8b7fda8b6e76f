#include "spindle/work/tool_memory.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "support/memory_disk.hpp"

using namespace spindle;
using work::SeenTool;
using work::ToolMemory;

namespace {

link::Endpoint endpoint(const std::string& url) { return link::parse_endpoint(url).value(); }

const SeenTool station3 = {
    .host = "192.168.10.23", .port = 5000, .profile = "doga-bm", .serial = "1021100042"};

}  // namespace

TEST_CASE("what was seen behind a host is remembered, the last one counts") {
  test::MemoryDisk files;
  const Disk disk = files.functions();
  const ToolMemory memory(disk, "/cache/spindle");
  CHECK_FALSE(memory.recall(endpoint("tcp://192.168.10.23")).value());
  REQUIRE(memory.remember(station3));
  CHECK(memory.recall(endpoint("tcp://192.168.10.23")).value() == station3);
  CHECK(memory.recall(endpoint("tcp://192.168.10.23:5000")).value() == station3);
  CHECK_FALSE(memory.recall(endpoint("tcp://192.168.10.23:502")).value());
  CHECK_FALSE(memory.recall(endpoint("tcp://192.168.10.23?unit=2")).value());
  CHECK_FALSE(memory.recall(endpoint("tcp://192.168.10.24")).value());

  SeenTool exchanged = station3;
  exchanged.serial = "1021100043";
  REQUIRE(memory.remember(exchanged));
  CHECK(memory.recall(endpoint("tcp://192.168.10.23")).value() == exchanged);
  SeenTool moved = exchanged;
  moved.port = 5001;
  REQUIRE(memory.remember(moved));
  CHECK(memory.recall(endpoint("tcp://192.168.10.23")).value() == moved);
  REQUIRE(memory.forget(moved));
  CHECK(memory.recall(endpoint("tcp://192.168.10.23")).value() == exchanged);
  CHECK(files.text("/cache/spindle/tools-seen") ==
        "spindle tools seen 1\n192.168.10.23\t\t5000\tdoga-bm\t1021100043\n");
}

TEST_CASE("the tool that was seen last is the last one, also of those that are known") {
  test::MemoryDisk files;
  const Disk disk = files.functions();
  const ToolMemory memory(disk, "/cache/spindle");
  SeenTool other = station3;
  other.port = 5001;
  other.serial = "1021100043";
  SeenTool elsewhere = station3;
  elsewhere.host = "192.168.10.24";
  const auto host = endpoint("tcp://192.168.10.23");
  CHECK(memory.seen_behind(host).value().empty());
  REQUIRE(memory.remember(station3));
  REQUIRE(memory.remember(other));
  REQUIRE(memory.remember(elsewhere));
  CHECK(memory.recall(host).value() == other);
  CHECK(memory.seen_behind(host).value() == std::vector{station3, other});
  REQUIRE(memory.remember(station3));
  CHECK(memory.recall(host).value() == station3);
  CHECK(memory.seen_behind(host).value() == std::vector{other, station3});
  CHECK_FALSE(has_one_port(memory.seen_behind(host).value()));
  REQUIRE(memory.forget(other));
  CHECK(has_one_port(memory.seen_behind(host).value()));
}

TEST_CASE("a file that is broken is none, and is made anew") {
  const std::string good = "spindle tools seen 1\n192.168.10.23\t\t5000\tdoga-bm\t1021100042\n";
  for (const std::string& text :
       {std::string(), std::string("spindle tools seen 2\n"), std::string("\0\xff\n", 3),
        good.substr(0, good.size() - 1), good + "192.168.10.24\t\t0\tdoga-bm\t1\n",
        good + "192.168.10.24\t\t70000\tdoga-bm\t1\n", good + "192.168.10.24\t300\t5\tdoga-bm\t1\n",
        good + "192.168.10.24\t\t5000\t\t1\n", good + "192.168.10.24\t\t5000\tdoga-bm\t\n",
        good + "192.168.10.24\t\t5000\tdoga-bm\t1\tx\n", good + "a b\t\t5000\tdoga-bm\t1\n",
        good + "\x1b[2J\t\t5000\tdoga-bm\t1\n"}) {
    CAPTURE(text);
    test::MemoryDisk files;
    const Disk disk = files.functions();
    const ToolMemory memory(disk, "/cache/spindle");
    files.put("/cache/spindle/tools-seen", text);
    const auto seen = memory.recall(endpoint("tcp://192.168.10.23"));
    REQUIRE_FALSE(seen);
    CHECK(seen.error().code == Errc::bad_file);
    REQUIRE(memory.remember(station3));
    CHECK(files.text("/cache/spindle/tools-seen") == good);
  }
}

TEST_CASE("it stays small, writes nothing that it holds already, and needs no folder") {
  test::MemoryDisk files;
  const Disk disk = files.functions();
  const ToolMemory memory(disk, "/cache/spindle");
  constexpr int more_than_fit = 510;
  for (int number = 0; number < more_than_fit; ++number) {
    SeenTool tool = station3;
    tool.host = "10.0.0." + std::to_string(number);
    REQUIRE(memory.remember(tool));
  }
  CHECK_FALSE(memory.recall(endpoint("tcp://tool:1")).value());
  CHECK_FALSE(memory.recall({.host = "10.0.0.9"}).value());
  CHECK(memory.recall({.host = "10.0.0.10"}).value());
  CHECK(memory.recall({.host = "10.0.0.509"}).value());
  files.fill();
  SeenTool last = station3;
  last.host = "10.0.0.509";
  CHECK(memory.remember(last));
  CHECK_FALSE(memory.remember(station3));

  const ToolMemory nowhere(disk, "");
  CHECK(nowhere.path().empty());
  CHECK(nowhere.remember(station3));
  CHECK_FALSE(nowhere.recall(endpoint("tcp://192.168.10.23")).value());
}

TEST_CASE("what does not fit into a line is not kept") {
  test::MemoryDisk files;
  const Disk disk = files.functions();
  const ToolMemory memory(disk, "/cache/spindle");
  for (const char* serial : {"", "1\t2", "1\n2", "1 2"}) {
    SeenTool tool = station3;
    tool.serial = serial;
    CHECK(memory.remember(tool));
  }
  CHECK(files.files().empty());
}
