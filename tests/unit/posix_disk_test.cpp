#include <doctest/doctest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "spindle/posix/disk.hpp"

using namespace spindle;
namespace fs = std::filesystem;

namespace {

/// A folder of its own, removed at the end.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "spindle-disk-XXXXXX").string();
    REQUIRE(::mkdtemp(name.data()) != nullptr);
    path_ = name;
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  [[nodiscard]] std::string operator/(const std::string& name) const { return path_ / name; }
  [[nodiscard]] std::size_t count() const {
    std::size_t files = 0;
    for (const auto& entry : fs::directory_iterator(path_)) files += entry.exists() ? 1U : 0U;
    return files;
  }

 private:
  fs::path path_;
};

std::string text_of(const std::string& path) { return posix::local_disk().read(path).value(); }

unsigned rights_of(const std::string& path) {
  return static_cast<unsigned>(fs::status(path).permissions()) & 0777U;
}

}  // namespace

TEST_CASE("a text is written whole, and read again") {
  const Folder folder;
  const Disk disk = posix::local_disk();
  const std::string path = folder / "a.yaml";
  CHECK_FALSE(disk.exists(path));
  REQUIRE(disk.write(path, "one\n", Overwrite::refuse, Privacy::usual));
  CHECK(disk.exists(path));
  CHECK(text_of(path) == "one\n");
  CHECK(folder.count() == 1);
}

TEST_CASE("a file is replaced only when that is allowed, and keeps its rights") {
  const Folder folder;
  const Disk disk = posix::local_disk();
  const std::string path = folder / "a.yaml";
  REQUIRE(disk.write(path, "one\n", Overwrite::refuse, Privacy::usual));
  ::chmod(path.c_str(), 0640);
  const auto refused = disk.write(path, "two\n", Overwrite::refuse, Privacy::usual);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::usage);
  CHECK(text_of(path) == "one\n");
  REQUIRE(disk.write(path, "two\n", Overwrite::allow, Privacy::usual));
  CHECK(text_of(path) == "two\n");
  CHECK(rights_of(path) == 0640U);
  CHECK(folder.count() == 1);
}

TEST_CASE("what is private cannot be read by others, also in place of what they could") {
  const Folder folder;
  const Disk disk = posix::local_disk();
  const std::string path = folder / "a.yaml";
  REQUIRE(disk.write(path, "one\n", Overwrite::refuse, Privacy::own));
  CHECK(rights_of(path) == 0600U);
  ::chmod(path.c_str(), 0644);
  REQUIRE(disk.write(path, "two\n", Overwrite::allow, Privacy::own));
  CHECK(rights_of(path) == 0600U);
}

TEST_CASE("of several writers of one name exactly one wins") {
  const Folder folder;
  const std::string path = folder / "a.yaml";
  std::vector<int> won(8, 0);
  {
    std::vector<std::jthread> writers;
    for (std::size_t i = 0; i < won.size(); ++i) {
      writers.emplace_back([&, i] {
        const auto written =
            posix::local_disk().write(path, std::to_string(i), Overwrite::refuse, Privacy::usual);
        won[i] = written ? 1 : 0;
      });
    }
  }
  std::size_t winners = 0;
  for (std::size_t i = 0; i < won.size(); ++i) {
    if (won[i] == 0) continue;
    ++winners;
    CHECK(text_of(path) == std::to_string(i));
  }
  CHECK(winners == 1);
  CHECK(folder.count() == 1);
}

TEST_CASE("what is no ordinary file is left alone") {
  const Folder folder;
  const Disk disk = posix::local_disk();
  REQUIRE(disk.make_folders(folder / "sub", Privacy::usual));
  for (const std::string& path : {std::string("/dev/null"), folder / "sub"}) {
    const auto written = disk.write(path, "text", Overwrite::allow, Privacy::usual);
    REQUIRE_FALSE(written);
    CHECK(written.error().status() == ExitStatus::storage);
  }
  CHECK(fs::is_character_file("/dev/null"));
  CHECK_FALSE(disk.write(folder / "none/a.yaml", "text", Overwrite::allow, Privacy::usual));
  CHECK(folder.count() == 1);
}

TEST_CASE("a link leads to the file that is replaced") {
  const Folder folder;
  const Disk disk = posix::local_disk();
  REQUIRE(disk.write(folder / "real", "one", Overwrite::refuse, Privacy::usual));
  fs::create_symlink("real", folder / "link");
  REQUIRE(disk.write(folder / "link", "two", Overwrite::allow, Privacy::usual));
  CHECK(fs::is_symlink(folder / "link"));
  CHECK(text_of(folder / "real") == "two");
}

TEST_CASE("what cannot be read says why") {
  const Folder folder;
  const Disk disk = posix::local_disk();
  CHECK(disk.read(folder / "none").error().message == "no such file");
  CHECK_FALSE(disk.read("/tmp"));
  std::ofstream(folder / "large") << std::string(2U << 20U, 'x');
  const auto large = disk.read(folder / "large");
  REQUIRE_FALSE(large);
  CHECK(large.error().message.find("large:1:1: larger than") != std::string::npos);
  REQUIRE_FALSE(disk.read("/dev/zero"));
}

TEST_CASE("lines of several threads never mix") {
  const Folder folder;
  const std::string path = folder / "log";
  const std::string line(500, 'x');
  {
    std::vector<std::jthread> writers;
    for (int i = 0; i < 4; ++i) {
      writers.emplace_back([&] {
        for (int n = 0; n < 50; ++n) {
          static_cast<void>(posix::local_disk().append_line(path, line + "\n"));
        }
      });
    }
  }
  std::ifstream log(path);
  std::size_t lines = 0;
  for (std::string read; std::getline(log, read); ++lines) CHECK(read == line);
  CHECK(lines == 200);
}

TEST_CASE("bytes that are no text are added as they are") {
  const Folder folder;
  const std::string path = folder / "frames.pcapng";
  REQUIRE(posix::local_disk().append(path, "\x0A\x0D"));
  REQUIRE(posix::local_disk().append(path, "\x01\x02"));
  CHECK(posix::local_disk().read(path) == std::string("\x0A\x0D\x01\x02"));
}

TEST_CASE("behind a line that a crash cut off the next one stands on its own") {
  const Folder folder;
  const std::string path = folder / "log";
  const Disk disk = posix::local_disk();
  REQUIRE(disk.append_line(path, "one\n"));
  std::ofstream(path, std::ios::app) << "tw";
  REQUIRE(disk.append_line(path, "three\n"));
  REQUIRE(disk.append_line(path, "four\n"));
  CHECK(text_of(path) == "one\ntw\nthree\nfour\n");
}

TEST_CASE("a full disk is an error of the append") {
  const auto appended = posix::local_disk().append_line("/dev/full", "line\n");
  REQUIRE_FALSE(appended);
  CHECK(appended.error().message.find("No space left") != std::string::npos);
  CHECK(appended.error().status() == ExitStatus::storage);
}

TEST_CASE("a line is added whole or not at all") {
  const Folder folder;
  const std::string path = folder / "log";
  REQUIRE(posix::local_disk().append_line(path, "one\n"));
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    // As on a full disk: only the beginning of the line fits.
    const rlimit limit = {10, 10};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    ::signal(SIGXFSZ, SIG_IGN);
    const bool added = posix::local_disk().append_line(path, "a longer line\n").has_value();
    ::_exit(added ? 1 : 0);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  CHECK(status == 0);
  CHECK(text_of(path) == "one\n");
}

TEST_CASE("what may not be looked at is not taken for absent") {
  const Folder folder;
  const Disk disk = posix::local_disk();
  CHECK(disk.absent(folder / "none"));
  CHECK(disk.absent(folder / "none/below"));
  REQUIRE(disk.write(folder / "there", "text", Overwrite::refuse, Privacy::usual));
  CHECK_FALSE(disk.absent(folder / "there"));
  CHECK(disk.absent(folder / "there/below"));
  CHECK(disk.absent(folder / std::string(300, 'x')));
  // A name that the system refuses to look up; the user who runs the tests may look into every
  // folder.
  fs::create_symlink("circle", folder / "circle");
  CHECK_FALSE(disk.absent(folder / "circle"));
}

TEST_CASE("a folder is listed, and two names of one file are known") {
  const Folder folder;
  const Disk disk = posix::local_disk();
  REQUIRE(disk.write(folder / "one", "text", Overwrite::refuse, Privacy::usual));
  REQUIRE(disk.write(folder / "two", "text", Overwrite::refuse, Privacy::usual));
  fs::create_symlink("one", folder / "link");
  std::vector<std::string> names = disk.list(folder / "");
  std::sort(names.begin(), names.end());
  CHECK(names == std::vector<std::string>{"link", "one", "two"});
  CHECK(disk.list(folder / "none").empty());
  CHECK(disk.list(folder / "one").empty());
  CHECK(disk.same_file(folder / "one", folder / "link"));
  CHECK_FALSE(disk.same_file(folder / "one", folder / "two"));
  CHECK_FALSE(disk.same_file(folder / "one", folder / "none"));
}

TEST_CASE("a source tree is read whichever user can change it") {
  const Folder folder;
  const Disk disk = posix::source_disk();
  REQUIRE(disk.write(folder / "open", "text", Overwrite::refuse, Privacy::usual));
  REQUIRE(::chmod((folder / "open").c_str(), 0666) == 0);
  CHECK(disk.read_trusted(folder / "open") == std::string("text"));
  CHECK_FALSE(posix::local_disk().read_trusted(folder / "open").has_value());
}

TEST_CASE("folders are made with those above them, for whom it may concern") {
  const Folder folder;
  const Disk disk = posix::local_disk();
  REQUIRE(disk.make_folders(folder / "a/b/c", Privacy::own));
  CHECK(rights_of(folder / "a/b/c") == 0700U);
  REQUIRE(disk.make_folders(folder / "a/b/c", Privacy::own));
  REQUIRE(disk.write(folder / "file", "text", Overwrite::refuse, Privacy::usual));
  CHECK_FALSE(disk.make_folders(folder / "file", Privacy::own));
  CHECK_FALSE(disk.make_folders(folder / "file/below", Privacy::own));
}

TEST_CASE("the user who runs the program has a name") {
  CHECK_FALSE(posix::local_disk().user().empty());
}

TEST_CASE("a text is replaced only where the file still holds what was read") {
  const Folder folder;
  const Disk disk = posix::local_disk();
  const std::string path = folder / "a.yaml";
  CHECK_FALSE(disk.replace(path, "", "one\n"));
  REQUIRE(disk.write(path, "one\n", Overwrite::refuse, Privacy::usual));
  fs::permissions(path, fs::perms(0640));
  fs::create_symlink("a.yaml", folder / "link.yaml");
  CHECK(disk.replace(folder / "link.yaml", "one\n", "two\n").value());
  CHECK(text_of(path) == "two\n");
  CHECK(rights_of(path) == 0640);
  CHECK(fs::is_symlink(folder / "link.yaml"));
  CHECK_FALSE(disk.replace(path, "one\n", "three\n").value());
  CHECK(text_of(path) == "two\n");
  CHECK(folder.count() == 2);
}

TEST_CASE("of several that replace a file at once none loses what another wrote") {
  const Folder folder;
  const Disk disk = posix::local_disk();
  const std::string path = folder / "a.yaml";
  REQUIRE(disk.write(path, "", Overwrite::refuse, Privacy::usual));
  constexpr int writers = 4;
  constexpr int lines_each = 25;
  std::vector<std::thread> threads;
  for (int writer = 0; writer < writers; ++writer) {
    threads.emplace_back([&] {
      for (int line = 0; line < lines_each;) {
        const std::string before = text_of(path);
        const auto replaced = disk.replace(path, before, before + "x\n");
        if (replaced && *replaced) ++line;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(text_of(path).size() == 2U * writers * lines_each);
  CHECK(folder.count() == 1);
}
