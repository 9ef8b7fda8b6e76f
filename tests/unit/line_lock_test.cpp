#include "posix/line_lock.hpp"

#include <doctest/doctest.h>
#include <stdlib.h>

#include <filesystem>

using namespace std::chrono_literals;
using namespace spindle;

namespace {

/// A runtime folder of the user's own.
class Folder {
 public:
  Folder() {
    std::string pattern = std::filesystem::temp_directory_path() / "spindle-line-XXXXXX";
    path_ = ::mkdtemp(pattern.data());
    ::setenv("XDG_RUNTIME_DIR", path_.c_str(), 1);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    ::unsetenv("XDG_RUNTIME_DIR");
    std::filesystem::remove_all(path_);
  }
  [[nodiscard]] std::filesystem::path of(const std::string& name) const {
    return path_ / "spindle" / name;
  }

 private:
  std::filesystem::path path_;
};

const posix::LineName port = {.text = "/dev/ttyUSB0", .since = 7};
constexpr TimePoint now = TimePoint(1000s);

}  // namespace

TEST_CASE("late answers: the next program learns until when they may come") {
  const Folder folder;
  CHECK(posix::late_answers_until(port, now) <= now);
  posix::leave_late_answers(port, now + 3s);
  CHECK(posix::late_answers_until(port, now) == now + 3s);
  CHECK(posix::late_answers_until(port, now + 1s) == now + 3s);
  CHECK(posix::late_answers_until({"/dev/ttyUSB1", 7}, now) <= now);
  posix::leave_late_answers(port, now + 5s);
  CHECK(posix::late_answers_until(port, now) == now + 5s);
}

TEST_CASE("late answers: what is over, or of another run of the system, is forgotten") {
  const Folder folder;
  const auto file = folder.of("_dev_ttyUSB0.late");
  SUBCASE("of a port that was plugged in anew") {
    posix::leave_late_answers({port.text, 6}, now + 3s);
  }
  SUBCASE("over") { posix::leave_late_answers(port, now - 1s); }
  SUBCASE("of another run") { posix::leave_late_answers(port, now + 24h); }
  SUBCASE("cut off") {
    posix::leave_late_answers(port, now + 3s);
    std::filesystem::resize_file(file, 3);
  }
  REQUIRE(std::filesystem::exists(file));
  CHECK(posix::late_answers_until(port, now) <= now);
  CHECK_FALSE(std::filesystem::exists(file));
}
