#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "spindle/catalogue/event_layout.hpp"
#include "spindle/catalogue/fields.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/posix/disk.hpp"
#include "spindle/shipped/profiles.hpp"
#include "support/temporary_folder.hpp"

using namespace spindle;
using catalogue::List;
using catalogue::Profile;
using catalogue::Table;
using catalogue::Text;
using files::ProfileStore;

namespace {

const std::string folder = SPINDLE_SOURCE_DIR "/profiles";

/// Where two values of the same type differ: the places of members and items on the way to it.
class Comparison {
 public:
  template <typename T>
  void compare(const T& a, const T& b, const std::string& where) {
    if constexpr (catalogue::Structure<T>) {
      const auto left = catalogue::fields(a);
      const auto right = catalogue::fields(b);
      members(left, right, where, std::make_index_sequence<std::tuple_size_v<decltype(left)>>());
    } else {
      ++leaves;
      if (!(a == b)) differences.push_back(where);
    }
  }
  /// 10.00 and 10 are the same number, and not the same text.
  void compare(const Decimal& a, const Decimal& b, const std::string& where) {
    ++leaves;
    if (a.mantissa() != b.mantissa() || a.exponent() != b.exponent()) differences.push_back(where);
  }
  template <typename T>
  void compare(const std::optional<T>& a, const std::optional<T>& b, const std::string& where) {
    if (a.has_value() != b.has_value()) return differences.push_back(where);
    if (a) compare(*a, *b, where);
  }
  template <typename... T>
  void compare(const std::variant<T...>& a, const std::variant<T...>& b, const std::string& where) {
    if (a.index() != b.index()) return differences.push_back(where);
    std::visit(
        [&](const auto& left) { compare(left, std::get<std::decay_t<decltype(left)>>(b), where); },
        a);
  }
  template <typename T>
  void compare(const List<T>& a, const List<T>& b, const std::string& where) {
    items(a, b, where);
  }
  template <typename Key, typename Value>
  void compare(const Table<Key, Value>& a, const Table<Key, Value>& b, const std::string& where) {
    items(a, b, where);
  }

  std::vector<std::string> differences = {};
  std::size_t leaves = 0;  ///< values that were compared

 private:
  template <typename Fields, std::size_t... at>
  void members(const Fields& a, const Fields& b, const std::string& where,
               std::index_sequence<at...> /*all*/) {
    (compare(std::get<at>(a), std::get<at>(b), where + "." + std::to_string(at)), ...);
  }
  template <typename Items>
  void items(const Items& a, const Items& b, const std::string& where) {
    if (a.size() != b.size()) return differences.push_back(where);
    for (std::size_t i = 0; i < a.size(); ++i) {
      compare(*(a.begin() + i), *(b.begin() + i), where + "[" + std::to_string(i) + "]");
    }
  }
};

template <typename T>
Comparison comparison(const T& a, const T& b) {
  Comparison comparison;
  comparison.compare(a, b, "");
  return comparison;
}

Profile without_path(Profile profile) {
  profile.path = {};
  return profile;
}

/// Counts how often each file is read.
struct Reader {
  std::map<std::string, int> reads;
  Disk disk() {
    Disk disk = posix::source_disk();
    disk.read_trusted = [this, read = disk.read](const std::string& path) {
      ++reads[std::filesystem::path(path).filename().string()];
      return read(path);
    };
    return disk;
  }
};

}  // namespace

TEST_CASE("the tables of the program say what the YAML files say, entry by entry") {
  const ProfileStore store({folder}, posix::source_disk());
  const auto shipped = shipped::profiles();
  std::size_t files = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    ++files;
    const std::string id = file.path().stem().string();
    CAPTURE(id);
    const files::ShippedProfile* table = files::find(shipped, id);
    REQUIRE(table != nullptr);
    CHECK(table->yaml == posix::source_disk().read(file.path().string()).value());
    const auto loaded = store.load_any(file.path().string()).value();
    CHECK(loaded.is_abstract == table->is_abstract);
    const auto profiles = comparison(without_path(loaded.profile), *table->profile);
    CHECK(profiles.differences == std::vector<std::string>());
    CHECK(profiles.leaves > 100);
    const auto simulation =
        comparison(store.load_simulation(file.path().string()).value(), *table->simulation);
    CHECK(simulation.differences == std::vector<std::string>());
    const auto codes =
        comparison(store.load_code_tables(file.path().string()).value(), *table->codes);
    CHECK(codes.differences == std::vector<std::string>());
  }
  CHECK(files == shipped.size());
  CHECK(std::is_sorted(shipped.begin(), shipped.end(),
                       [](const auto& a, const auto& b) { return a.id < b.id; }));
}

TEST_CASE("a difference anywhere in a profile is found") {
  const Profile profile = *files::find(shipped::profiles(), "doga-bm")->profile;
  Profile other = profile;
  std::vector<catalogue::Parameter> parameters(other.parameters.begin(), other.parameters.end());
  parameters.back().encoding.scale = Decimal(10, -1);
  other.parameters = parameters;
  CHECK(comparison(profile, other).differences.size() == 1);
}

TEST_CASE("a profile of the program is not parsed, and each is made once") {
  Reader reader;
  const ProfileStore store({folder}, reader.disk(), shipped::profiles());
  const Profile first = store.load("doga-bm").value();
  const Profile second = store.load("doga-bm").value();
  const Profile& table = *files::find(shipped::profiles(), "doga-bm")->profile;
  CHECK(first.parameters.begin() == table.parameters.begin());
  CHECK(second.parameters.begin() == table.parameters.begin());
  CHECK(first.path == folder + "/doga-bm.yaml");
  CHECK(reader.reads == std::map<std::string, int>{{"doga-bm.yaml", 1}, {"doga-common.yaml", 1}});
}

TEST_CASE("a file overrides the profile of the program, also where only its base was changed") {
  test::TemporaryFolder own;
  const std::string base = posix::source_disk().read(folder + "/doga-common.yaml").value();
  own.write("doga-bm.yaml", posix::source_disk().read(folder + "/doga-bm.yaml").value());
  SUBCASE("the base beside it is the same") {
    own.write("doga-common.yaml", base);
    const ProfileStore store({own.path()}, posix::source_disk(), shipped::profiles());
    CHECK(store.load("doga-bm").value().parameters.begin() ==
          files::find(shipped::profiles(), "doga-bm")->profile->parameters.begin());
  }
  SUBCASE("the base beside it has another port") {
    std::string other = base;
    const std::size_t at = other.find("port: 5000");
    REQUIRE(at != std::string::npos);
    other.replace(at, 10, "port: 5001");
    own.write("doga-common.yaml", other);
    const ProfileStore store({own.path()}, posix::source_disk(), shipped::profiles());
    CHECK(store.load("doga-bm").value().link.port == 5001);
    CHECK(store.load("doga-bmt").value().link.port == 5000);
  }
}

TEST_CASE("without any file the program knows its profiles, and their bases are none") {
  const ProfileStore store({}, posix::source_disk(), shipped::profiles());
  std::vector<std::string> ids;
  for (const auto& entry : store.list()) {
    CHECK(entry.path == files::built_in);
    ids.push_back(entry.id);
  }
  CHECK(ids == std::vector<std::string>{"doga-bm", "doga-bmt", "doga-gen2", "eastron-sdm72d-m",
                                        "huanyang-fc01", "kolver-kducer", "orientalmotor-blh",
                                        "orientalmotor-blv", "orientalmotor-blvr"});
  CHECK(store.load("doga-bm").value().id == "doga-bm");
  CHECK(store.load_code_tables(store.load("doga-bm").value().path).value().error.size() > 10);
  CHECK(store.load("doga-common").error().code == Errc::bad_file);
  CHECK(store.load("doga-b").error().hint.find("doga-bm") != std::string::npos);
  CHECK(store.check("doga-bm").value().empty());
}

TEST_CASE("no register of an event has a key that its record has beside the registers") {
  const std::set<std::string> taken = {"schema", "type",        "time",      "target", "serial",
                                       "epoch",  "id",          "kind",      "source", "raw",
                                       "text",   "torque_unit", "error_text"};
  const ProfileStore store({}, posix::source_disk(), shipped::profiles());
  for (const auto& entry : store.list()) {
    CAPTURE(entry.id);
    const auto profile = store.load(entry.id).value();
    if (!profile.events) continue;
    const catalogue::EventLayout layout(profile);
    for (const auto& field : layout.fields()) {
      CAPTURE(field.key);
      CHECK(!taken.contains(field.key));
    }
  }
}

TEST_CASE("a user's profile extends one of the program as it extends its file") {
  const std::vector<std::string> bodies = {
      "format: 1\nextends: doga-bm\nid: mine\ntitle: Mine\nlink:\n  port: 4711\n",
      "format: 1\nextends: orientalmotor-blv\nid: mine\ntitle: Mine\nparameters:\n"
      "  - {name: extra, title: Extra, register: 8192, encoding: u16, access: rw, evidence: "
      "manual, source: me}\n"
      "  - {name: operation.0.speed, title: Other, register: 1152, encoding: u32, access: rw, "
      "evidence: manual, source: me}\n"};
  for (const std::string& body : bodies) {
    CAPTURE(body);
    test::TemporaryFolder own;
    own.write("mine.yaml", body);
    const ProfileStore parsed({own.path(), folder}, posix::source_disk());
    const ProfileStore tabled({own.path(), folder}, posix::source_disk(), shipped::profiles());
    const ProfileStore alone({own.path()}, posix::source_disk(), shipped::profiles());
    const Profile expected = parsed.load("mine").value();
    CHECK(comparison(expected, tabled.load("mine").value()).differences ==
          std::vector<std::string>());
    CHECK(comparison(expected, alone.load("mine").value()).differences ==
          std::vector<std::string>());
    CHECK(comparison(parsed.load_simulation("mine").value(), tabled.load_simulation("mine").value())
              .differences == std::vector<std::string>());
    CHECK(
        comparison(parsed.load_code_tables("mine").value(), tabled.load_code_tables("mine").value())
            .differences == std::vector<std::string>());
  }
}

TEST_CASE("what does not fit a base of the program is told where it is extended") {
  test::TemporaryFolder own;
  own.write("mine.yaml",
            "format: 1\nextends: orientalmotor-blv\nid: mine\ntitle: Mine\nparameters:\n"
            "  - {name: extra, title: Extra, register: 1152, encoding: u16, access: rw, evidence: "
            "manual, "
            "source: me}\n");
  const ProfileStore store({own.path()}, posix::source_disk(), shipped::profiles());
  const auto loaded = store.load("mine");
  REQUIRE_FALSE(loaded);
  CHECK(loaded.error().message.find("shares register 1152") != std::string::npos);
  const auto findings = store.check("mine").value();
  REQUIRE(findings.size() == 1);
  CHECK(findings.front().line == 6);
}
