#include "commands/patient_out.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <string>

using namespace spindle;
using commands::PatientOut;

namespace {

/// A reader who takes nothing until it is told to, and then so many bytes at a time.
class Reader {
 public:
  void wake() {
    const std::lock_guard lock(mutex_);
    awake_ = true;
    woken_.notify_all();
  }
  void leave() {
    const std::lock_guard lock(mutex_);
    gone_ = true;
    woken_.notify_all();
  }
  [[nodiscard]] std::string read() {
    const std::lock_guard lock(mutex_);
    return text_;
  }

  Result<std::size_t> take(std::string_view text, Duration patience) {
    std::unique_lock lock(mutex_);
    woken_.wait_for(lock, patience, [this] { return awake_ || gone_; });
    if (gone_) return tl::unexpected(Error{.code = Errc::closed_pipe});
    if (!awake_) return 0;
    const std::string_view piece = text.substr(0, bite);
    text_ += piece;
    return piece.size();
  }

  report::Streams streams{
      .out = [](std::string_view) -> Result<void> { return {}; },
      .err =
          [this](std::string_view text) {
            const std::lock_guard lock(mutex_);
            text_ += text;
          },
      .read_line = {},
      .out_for = [this](std::string_view text, Duration patience) { return take(text, patience); }};
  Interrupt interrupt = Interrupt();
  std::size_t bite = 3;

 private:
  std::mutex mutex_ = {};
  std::condition_variable woken_ = {};
  std::string text_ = {};
  bool awake_ = false;
  bool gone_ = false;
};

}  // namespace

TEST_CASE("what is not taken waits, whole and in order, and the writer does not") {
  Reader reader;
  PatientOut out(reader.streams, reader.interrupt);
  for (const char* text : {"first\n", "second\n", "", "third\n"}) CHECK(reader.streams.out(text));
  CHECK(reader.read().empty());
  reader.wake();
  const auto left = out.drain();
  REQUIRE(left);
  CHECK(*left == 0);
  CHECK(reader.read() == "first\nsecond\nthird\n");
}

TEST_CASE("a full queue is full until a quarter of it is free, and takes last words all the same") {
  Reader reader;
  PatientOut out(reader.streams, reader.interrupt, 8);
  for (int piece = 0; piece < 8; ++piece) {
    CHECK_FALSE(out.is_full());
    CHECK(reader.streams.out("x\n"));
  }
  CHECK(out.is_full());
  CHECK(reader.streams.out("last\n"));
  reader.wake();
  REQUIRE(out.drain());
  CHECK_FALSE(out.is_full());
  CHECK(reader.read().ends_with("last\n"));
}

TEST_CASE("a signal ends the wait for who takes nothing, and says how much is left") {
  Reader reader;
  PatientOut out(reader.streams, reader.interrupt);
  CHECK(reader.streams.out("one\n"));
  CHECK(reader.streams.out("two\n"));
  reader.interrupt.raise(2);
  SUBCASE("no reader") {
    const auto left = out.drain();
    REQUIRE(left);
    CHECK(*left == 2);
  }
  SUBCASE("a reader") {
    reader.bite = 1;
    reader.wake();
    const auto left = out.drain();
    REQUIRE(left);
    CHECK(*left == 0);
  }
}

TEST_CASE(
    "errors come behind what was written before them, and do not wait for a reader who takes "
    "nothing") {
  Reader reader;
  PatientOut out(reader.streams, reader.interrupt);
  SUBCASE("a reader takes them") {
    reader.wake();
    CHECK(reader.streams.out("row\n"));
    reader.streams.err("sentence\n");
    CHECK(reader.read() == "row\nsentence\n");
  }
  SUBCASE("no reader takes them") {
    CHECK(reader.streams.out("row\n"));
    reader.streams.err("sentence\n");
    CHECK(reader.read() == "sentence\n");
  }
}

TEST_CASE("a reader who has gone is told to the next writer, and to the one that waits") {
  Reader reader;
  PatientOut out(reader.streams, reader.interrupt);
  reader.leave();
  CHECK(reader.streams.out("row\n"));
  const auto left = out.drain();
  REQUIRE_FALSE(left);
  CHECK(left.error().code == Errc::closed_pipe);
  const auto next = reader.streams.out("row\n");
  REQUIRE_FALSE(next);
  CHECK(next.error().code == Errc::closed_pipe);
  CHECK_FALSE(out.is_full());
}

TEST_CASE("streams that cannot write in part write at once, and get back what was theirs") {
  std::string text;
  report::Streams streams{.out = [&](std::string_view piece) -> Result<void> {
                            text += piece;
                            return {};
                          },
                          .err = [](std::string_view) {},
                          .read_line = {}};
  const Interrupt never;
  {
    PatientOut out(streams, never);
    CHECK(streams.out("now"));
    CHECK(text == "now");
    REQUIRE(out.drain());
  }
  CHECK(streams.out(" and then"));
  CHECK(text == "now and then");
}
