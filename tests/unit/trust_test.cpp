#include "spindle/base/trust.hpp"

#include <doctest/doctest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "spindle/posix/disk.hpp"

using namespace spindle;
namespace fs = std::filesystem;

namespace {

constexpr unsigned me = 1000;

Ownership owned_by(unsigned number, std::string name = {}) {
  return {.owner = {.number = number, .name = std::move(name)}};
}

Ownership group_writable(std::string owner, std::string group, std::vector<std::string> members) {
  return {.owner = {.number = me, .name = std::move(owner)},
          .group = {.number = me, .name = std::move(group)},
          .members = std::move(members),
          .group_writes = true};
}

std::string verdict(const Ownership& ownership, const Trust& trust) {
  const auto trusted = check_trust("f.yaml", ownership, trust);
  return trusted ? "read" : describe(trusted.error());
}

/// A file of its own, removed at the end.
class File {
 public:
  File() {
    std::string name = (fs::temp_directory_path() / "spindle-trust-XXXXXX").string();
    REQUIRE(::mkdtemp(name.data()) != nullptr);
    folder_ = name;
    std::ofstream(path()) << "text\n";
    REQUIRE(::chmod(path().c_str(), 0644) == 0);
  }
  ~File() { fs::remove_all(folder_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] std::string path() const { return folder_ / "a.yaml"; }
  [[nodiscard]] std::string link() const { return folder_ / "link.yaml"; }

 private:
  fs::path folder_;
};

}  // namespace

TEST_CASE("a file is believed by its owner, and by who else can write it") {
  const Trust alone{.self = me};
  const Trust with_anna{.self = me, .others = {"anna", "1002"}};
  CHECK(verdict(owned_by(me), alone) == "read");
  CHECK(verdict(owned_by(0), alone) == "read");
  CHECK(verdict(owned_by(1001, "anna"), alone) ==
        "f.yaml: it is not read, because it belongs to anna, neither to you nor to root; set "
        "SPINDLE_TRUST=anna if this user may decide what your tools do");
  CHECK(verdict(owned_by(1002), alone).find("SPINDLE_TRUST=1002") != std::string::npos);
  CHECK(verdict(owned_by(1001, "anna"), with_anna) == "read");
  CHECK(verdict(owned_by(1002), with_anna) == "read");
  CHECK(verdict(owned_by(1003, "otto"), with_anna) != "read");
  // Root believes no other user because it could.
  CHECK(verdict(owned_by(me, "anna"), {.self = 0}) != "read");
  CHECK(verdict(owned_by(me, ""), {.self = 0, .others = {""}}) != "read");

  Ownership open_to_all = owned_by(me);
  open_to_all.others_write = true;
  CHECK(verdict(open_to_all, alone) ==
        "f.yaml: it is not read, because every user can change it; 'chmod o-w f.yaml' ends that");
  CHECK(verdict(group_writable("max", "max", {}), alone) == "read");
  CHECK(verdict(group_writable("max", "max", {"max"}), alone) == "read");
  CHECK(verdict(group_writable("max", "max", {"anna"}), alone) ==
        "f.yaml: it is not read, because every member of the group max can change it; 'chmod g-w "
        "f.yaml' ends that");
  CHECK(verdict(group_writable("max", "users", {}), alone) != "read");
  CHECK(verdict(group_writable("", "", {}), alone) != "read");
}

TEST_CASE("the list of trusted users") {
  CHECK(trusted_users("").empty());
  CHECK(trusted_users(",anna,,1001,") == std::vector<std::string>{"anna", "1001"});
}

TEST_CASE("a real file is read when it is mine alone") {
  const File file;
  const Disk disk = posix::local_disk();
  CHECK(disk.read_trusted(file.path()).value() == "text\n");
  REQUIRE(::chmod(file.path().c_str(), 0646) == 0);
  CHECK_FALSE(disk.read_trusted(file.path()).has_value());
  REQUIRE(::chmod(file.path().c_str(), 0644) == 0);
  fs::create_symlink("a.yaml", file.link());
  CHECK(disk.read_trusted(file.link()).value() == "text\n");
  CHECK(disk.read_trusted(file.path() + "x").error().message == "no such file");
  CHECK(disk.read_trusted("/tmp").error().message == "is a folder, not a file");
  if (::geteuid() != 0) return;  // only root can give a file away
  REQUIRE(::lchown(file.link().c_str(), 12345, 12345) == 0);
  CHECK_FALSE(disk.read_trusted(file.link()).has_value());
  CHECK(posix::local_disk("12345").read_trusted(file.link()).has_value());
  REQUIRE(::chown(file.path().c_str(), 12345, 12345) == 0);
  CHECK(disk.read_trusted(file.path()).error().code == Errc::bad_file);
  CHECK(posix::local_disk("12345").read_trusted(file.path()).value() == "text\n");
  CHECK_FALSE(posix::local_disk("1234").read_trusted(file.path()).has_value());
}
