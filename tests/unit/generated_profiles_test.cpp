// Profiles that no person wrote: whatever passes the checks can be simulated, and every verb ends
// in a result or an error of its own. A trial that fails names its seed; SPINDLE_TRIALS makes more.

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <stdlib.h>  // NOLINT: setenv() is no part of <cstdlib>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "spindle/cli/run.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/posix/disk.hpp"
#include "spindle/sim/simulated_tool.hpp"
#include "support/fake_clock.hpp"
#include "support/memory_disk.hpp"

namespace {

using namespace spindle;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

/// The same numbers on every machine; what the standard's distributions do not promise.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  std::uint64_t upto(std::uint64_t last) { return engine_() % (last + 1); }
  std::uint64_t between(std::uint64_t first, std::uint64_t last) {
    return first + upto(last - first);
  }
  bool one_in(std::uint64_t count) { return upto(count - 1) == 0; }
  template <typename Item>
  Item of(const std::vector<Item>& items) {
    return items[upto(items.size() - 1)];
  }
  /// Registers where things go wrong, and others.
  std::uint64_t address(std::uint64_t last = 65535) {
    const std::vector<std::uint64_t> edges = {0,    1,    123,  124,   125,   8189,  8190,
                                              8191, 8192, 8193, 65533, 65534, 65535, 32767};
    return std::min(one_in(2) ? of(edges) : upto(65535), last);
  }

 private:
  std::mt19937_64 engine_;
};

constexpr std::string_view proof = "evidence: manual, source: \"x\", title: \"x\"";

struct Shape {
  std::string encoding;
  std::int64_t lowest;
  std::int64_t highest;
  unsigned registers;
};

Shape shape(Dice& dice) {
  return dice.of(std::vector<Shape>{{"u16", 0, 65535, 1},
                                    {"i16", -32768, 32767, 1},
                                    {"u32", 0, 4294967295, 2},
                                    {"i32", -2147483648, 2147483647, 2}});
}

std::int64_t number_of(Dice& dice, const Shape& shape) {
  const std::vector<std::int64_t> edges = {shape.lowest, shape.highest, 0, 1};
  if (dice.one_in(2)) return dice.of(edges);
  const auto width = static_cast<std::uint64_t>(shape.highest - shape.lowest);
  return shape.lowest + static_cast<std::int64_t>(dice.upto(width));
}

/// Writes one profile: of a screwdriver, of a motor driver, of bare registers, or one that extends
/// ours.
class Author {
 public:
  explicit Author(std::uint64_t seed) : dice_(seed), id_(fmt::format("trial-{}", seed)) {}

  [[nodiscard]] const std::string& id() const { return id_; }

  std::string write() {
    head();
    const bool even = even_pairs_;
    for (std::uint64_t i = dice_.between(1, 6); i > 0; --i) parameter(even);
    if (dice_.one_in(2)) repetition(even);
    for (std::uint64_t i = dice_.upto(2); i > 0; --i) action(even);
    if (!actions_.empty()) text_ += "actions:\n" + actions_;
    text_ += "parameters:\n" + parameters_;
    simulation();
    return text_;
  }

 private:
  void head() {
    text_ = fmt::format("format: 1\nid: {}\ntitle: \"x\"\n", id_);
    switch (dice_.upto(4)) {
      case 0:
        text_ += "extends: doga-bm\n";
        if (dice_.one_in(2))
          text_ += fmt::format("link: {{max-read: {}}}\n", dice_.between(1, 125));
        if (dice_.one_in(3)) areas("limits", true);
        return;
      case 1:
        even_pairs_ = true;
        text_ += "extends: orientalmotor-blv\n";
        if (!dice_.one_in(3)) return;
        even_pairs_ = dice_.one_in(2);
        text_ += fmt::format("link: {{max-read: {}, max-write: {}, pairs: {}, framing: {}}}\n",
                             dice_.between(1, 125), dice_.between(1, 123),
                             even_pairs_ ? "even" : "any", dice_.one_in(4) ? "tcp" : "rtu");
        return;
      case 2:
        return screwdriver();
      case 3:
        text_ += link(dice_.one_in(2) ? "tcp" : "rtu");
        return;
      default:
        return motor();
    }
  }

  void areas(std::string_view section, bool) {
    const std::uint64_t from = dice_.upto(30000);
    text_ += fmt::format("{}: {{minimum-offset: {}, maximum-offset: {}, from: {}, to: {}}}\n",
                         section, dice_.upto(30000), dice_.upto(30000), from,
                         std::min<std::uint64_t>(from + dice_.upto(300), 35535));
  }

  std::string link(std::string_view framing) {
    even_pairs_ = dice_.one_in(2);
    const auto area = [this] {
      const std::uint64_t from = dice_.address();
      return fmt::format("{}..{}", from, std::min<std::uint64_t>(from + dice_.upto(400), 65535));
    };
    return fmt::format(
        "link: {{framing: {}, max-read: {}, max-write: {}, pairs: {}, answer: 100ms, loopback: {}, "
        "contiguous: {{holding: [{}, {}]}}, absent: {{holding: [{}], input: [{}]}}}}\n",
        framing, dice_.between(1, 125), dice_.between(1, 123), even_pairs_ ? "even" : "any",
        dice_.one_in(2) ? "true" : "false", area(), area(), area(), area());
  }

  void screwdriver() {
    text_ += link("tcp");
    const std::uint64_t count = dice_.between(4, 125);
    const std::uint64_t first = dice_.one_in(2) ? 65536 - count : dice_.address(65536 - count);
    const bool holding = dice_.one_in(2);
    text_ += fmt::format(
        "events: {{arm: {{register: {}, every: 1s, expires: 3s}}, function: {}, first: {}, count: "
        "{}, number: event.number, kind: event.kind, kinds: {{1: fastening-ok, 2: "
        "fastening-ng}}}}\n",
        dice_.address(), holding ? 3 : 4, first, count);
    for (const auto& [name, at] : {std::pair("event.number", first + count - 1),
                                   std::pair("event.kind", first + dice_.upto(count - 2))}) {
      add(fmt::format("name: {}, register: {}, encoding: u16, access: r, table: {}", name, at,
                      holding ? "holding" : "input"));
    }
    if (dice_.one_in(2)) {
      const std::uint64_t from = dice_.address();
      text_ += fmt::format("numbered: {{prefix: p, from: {}, to: {}, access: {}, source: \"x\"}}\n",
                           from, std::min<std::uint64_t>(from + dice_.upto(500), 65535),
                           dice_.one_in(2) ? "rw" : "r");
    }
    if (dice_.one_in(2)) areas("limits", true);
    if (dice_.one_in(2)) {
      text_ +=
          "identity: {minimum-bytes: 9, tool-model: 0..1, firmware: 2..4, serial: 5..8, models: "
          "{1: x}}\n";
    }
    for (const char* name : {"status.preset", "status.running", "preset.1.target-torque",
                             "preset.1.speed", "preset.1.soft-start"}) {
      if (dice_.one_in(2)) add(described(name, shape(dice_), even_pairs_, "rw"));
    }
    for (const char* name : {"start", "alarm-reset", "select-preset", "direction", "lock"}) {
      if (dice_.one_in(2)) action_named(name, even_pairs_);
    }
  }

  void motor() {
    text_ += link(dice_.one_in(4) ? "tcp" : "rtu");
    const std::uint64_t last = dice_.upto(3);
    text_ += fmt::format(
        "run:\n  evidence: manual\n  source: \"x\"\n"
        "  command: {{parameter: word, mode: mode, modes: {{0: {{forward: 0x10, reverse: 0x20, "
        "decelerate: 0x40, instant: 0}}}}, starting: 0x30, select: {}, always: {{decelerate: 0x40, "
        "instant: 0}}}}\n"
        "  status: {{parameter: state, running: {}, at-speed: {}, busy: {}, command-speed: wanted, "
        "feedback-speed: turned, alarm: alarm}}\n"
        "  operation: {{speed: \"data.{{n}}.speed\", acceleration: \"data.{{n}}.up\", "
        "deceleration: "
        "\"data.{{n}}.down\", numbers: 0..{}, preferred: {}}}\n",
        last == 0 && dice_.one_in(2) ? 0 : 3, dice_.upto(15), dice_.upto(15), dice_.upto(15), last,
        dice_.upto(last));
    if (dice_.one_in(2)) text_ += "  watchdog: watchdog\n";
    for (const char* name : {"mode", "state", "wanted", "turned", "alarm", "watchdog"}) {
      add(described(name, shape(dice_), even_pairs_, dice_.one_in(2) ? "rw" : "r"));
    }
    add(described("word", shape(dice_), even_pairs_, "rw"));
    for (std::uint64_t n = 0; n <= last; ++n) {
      for (const char* field : {"speed", "up", "down"}) {
        add(described(fmt::format("data.{}.{}", n, field), shape(dice_), even_pairs_, "rw"));
      }
    }
    actions_ += fmt::format("  - {{name: start, register: {}, motion: start, hazard: moves, {}}}\n",
                            dice_.address(), proof);
  }

  std::string described(std::string_view name, const Shape& shape, bool even,
                        std::string_view access) {
    std::uint64_t at = dice_.address(65536 - shape.registers);
    if (even && shape.registers == 2) at &= ~std::uint64_t{1};
    std::string entry = fmt::format(
        "name: {}, register: {}, encoding: {}, overlaps: true, access: "
        "{}",
        name, at, shape.encoding, access);
    if (access == "r" && dice_.one_in(3)) entry += ", table: input";
    const bool labelled = dice_.one_in(4);
    if (labelled) {
      entry += fmt::format(", labels: {{{}: low, {}: high}}", number_of(dice_, shape),
                           number_of(dice_, shape));
    } else if (dice_.one_in(3)) {
      const std::int64_t a = number_of(dice_, shape);
      const std::int64_t b = number_of(dice_, shape);
      entry += fmt::format(", range: {}..{}", std::min(a, b), std::max(a, b));
    } else if (dice_.one_in(3)) {
      entry += fmt::format(", scale: {}", dice_.of(std::vector<std::string>{
                                              "0.1", "0.001", "100", "0.000000001", "1000000"}));
    } else if (dice_.one_in(3)) {
      entry += fmt::format(", bits: {{0: A, {}: B}}", 16 * shape.registers - 1);
    }
    return entry;
  }

  void add(std::string_view entry) { parameters_ += fmt::format("  - {{{}, {}}}\n", entry, proof); }

  void parameter(bool even) {
    const std::string name = fmt::format("own.{}", parameters_.size());
    add(described(name, shape(dice_), even, dice_.one_in(2) ? "rw" : "r"));
  }

  void repetition(bool even) {
    const Shape one = shape(dice_);
    const std::uint64_t stride = dice_.between(1, 600) * (even ? 2 : one.registers);
    const std::uint64_t last = std::min<std::uint64_t>(dice_.upto(120), 65000 / stride);
    const std::uint64_t at = 65536 - one.registers - last * stride;
    add(fmt::format(
        "name: \"far.{{n}}\", n: 0..{}, stride: {}, register: {}, encoding: {}, access: "
        "rw, overlaps: true",
        last, stride, even ? at & ~std::uint64_t{1} : at, one.encoding));
  }

  void action(bool even) { action_named(fmt::format("own-{}", actions_.size()), even); }

  void action_named(std::string_view name, bool even) {
    const Shape one = shape(dice_);
    std::uint64_t at = dice_.address(65536 - one.registers);
    if (even && one.registers == 2) at &= ~std::uint64_t{1};
    std::string entry =
        fmt::format("name: {}, register: {}, encoding: {}, hazard: none", name, at, one.encoding);
    switch (dice_.upto(2)) {
      case 0:
        entry += fmt::format(", value: {}", dice_.upto(255));
        if (dice_.one_in(2)) entry += fmt::format(", stop: {}", dice_.upto(255));
        break;
      case 1:
        entry += fmt::format(", value: {}, rest: {}", dice_.between(1, 255), 0);
        break;
      default:
        entry += fmt::format(", range: {}..{}", dice_.upto(9), dice_.between(9, 65535));
        break;
    }
    actions_ += fmt::format("  - {{{}, {}}}\n", entry, proof);
  }

  void simulation() {
    text_ += "---\npart: simulation\nvalues:\n  \"*\": 1\n";
    if (dice_.one_in(2)) text_ += "  \"own.*\": 0\n";
    if (dice_.one_in(2)) {
      text_ += fmt::format("limits: {{\"own.*\": 0..{}}}\n", dice_.upto(65535));
    }
    if (dice_.one_in(2)) {
      const std::uint64_t from = dice_.address();
      text_ += fmt::format("absent: {{holding: [{}..{}]}}\n", from,
                           std::min<std::uint64_t>(from + dice_.upto(40), 65535));
    }
    if (dice_.one_in(2)) {
      std::string bytes;
      for (std::uint64_t i = dice_.between(1, 255); i > 0; --i) {
        bytes += fmt::format("{}{:02X}", bytes.empty() ? "" : " ", dice_.upto(255));
      }
      text_ += fmt::format("identity: {{bytes: \"{}\"}}\n", bytes);
    }
  }

  Dice dice_;
  std::string id_;
  std::string text_ = {};
  std::string parameters_ = {};
  std::string actions_ = {};
  bool even_pairs_ = false;
};

/// A folder of profiles that goes when the test does.
class Shelf {
 public:
  Shelf() {
    std::string pattern = (fs::temp_directory_path() / "spindle-profiles-XXXXXX").string();
    REQUIRE(::mkdtemp(pattern.data()) != nullptr);
    folder_ = pattern;
  }
  Shelf(const Shelf&) = delete;
  Shelf& operator=(const Shelf&) = delete;
  ~Shelf() { fs::remove_all(folder_); }

  void put(const std::string& id, const std::string& text) const {
    std::ofstream(folder_ / (id + ".yaml")) << text;
  }
  [[nodiscard]] std::string path() const { return folder_.string(); }
  [[nodiscard]] files::ProfileStore store() const {
    return files::ProfileStore({folder_.string(), SPINDLE_SOURCE_DIR "/profiles"},
                               posix::source_disk());
  }

 private:
  fs::path folder_;
};

/// The whole program in this process, on a clock that is moved by hand.
class Program {
 public:
  explicit Program(std::string profiles) : profiles_(std::move(profiles)) {}

  int run(const std::vector<std::string>& words) {
    errors_.clear();
    cli::World world{
        .io = {.out = [](std::string_view) { return Result<void>(); },
               .err = [this](std::string_view text) { errors_ += text; },
               .read_line = [] { return std::optional<std::string>(); }},
        .clock = clock_,
        .interrupt = interrupt_.emplace(),
        .open = unreachable,
        .uninterruptible = {clock_, never_, unreachable},
        .serve = [](sim::Server&,
                    const sim::ServeOptions& options) { return options.listening(5000); },
        .end_waits = [this] { interrupt_->end_waits(); },
        .environment =
            [this](std::string_view name) {
              if (name == "SPINDLE_PROFILE_PATH") return std::optional(profiles_);
              return name == "XDG_STATE_HOME" ? std::optional<std::string>("/state") : std::nullopt;
            },
        .disk = disk_.functions(),
        .installation = {SPINDLE_SOURCE_DIR, "3.1.6"}};
    return cli::run(words, world);
  }
  [[nodiscard]] const std::string& errors() const { return errors_; }

 private:
  static Result<std::unique_ptr<link::Transport>> unreachable(const link::Endpoint&,
                                                              const catalogue::LinkSpec&,
                                                              Duration) {
    return tl::unexpected(Error{.code = Errc::connection_refused});
  }

  std::string profiles_;
  std::string errors_ = {};
  test::FakeClock clock_;
  const Interrupt never_;
  std::optional<Interrupt> interrupt_;
  test::MemoryDisk disk_;
};

std::vector<std::uint64_t> trials() {
  const char* wanted = std::getenv("SPINDLE_TRIALS");  // NOLINT(concurrency-mt-unsafe)
  std::vector<std::uint64_t> seeds(wanted == nullptr ? 60U : std::stoul(wanted));
  for (std::size_t i = 0; i < seeds.size(); ++i) seeds[i] = i + 1;
  return seeds;
}

bool passes(const files::ProfileStore& store, const std::string& id) {
  const auto findings = store.check(id);
  return findings && findings->empty();
}

modbus::Pdu any_request(Dice& dice) {
  const auto table = dice.one_in(3) ? modbus::RegisterTable::input : modbus::RegisterTable::holding;
  const modbus::RegisterAddress at{static_cast<std::uint16_t>(dice.address())};
  const auto word = [&] { return static_cast<std::uint16_t>(dice.upto(65535)); };
  switch (dice.upto(5)) {
    case 0:
      return modbus::report_server_id_request();
    case 1:
      return modbus::write_request(at, dice.one_in(2) ? std::uint16_t{1} : word());
    case 2: {
      Registers values(dice.between(1, 123), 0);
      for (std::uint16_t& value : values) value = word();
      return modbus::write_request(at, RegisterView(values));
    }
    default:
      return modbus::read_request(table, at, static_cast<std::uint16_t>(dice.between(1, 125)));
  }
}

/// Questions of all kinds, and time that passes, for one tool.
void besiege(sim::Server& server, std::uint64_t seed) {
  Dice dice(seed);
  TimePoint now = TimePoint(1h);
  server.connected({1});
  for (int i = 0; i < 400; ++i) {
    now += std::chrono::milliseconds(dice.one_in(10) ? dice.upto(20'000) : dice.upto(20));
    const auto answer = server.answer({1}, {1}, any_request(dice), now);
    if (answer) {
      CHECK(answer->data.size() < modbus::max_pdu_size);
      CHECK_FALSE(modbus::frame(modbus::Framing::tcp, {{}, {1}, *answer}).empty());
    }
    if (dice.one_in(20)) server.bad_frame(now);
    if (dice.one_in(50)) server.reboot(now);
    const auto next = server.next_change();
    if (next && *next > now && *next < now + 1min) server.advance(now = *next);
    server.take_pushes();
  }
}

}  // namespace

TEST_CASE("generated profiles: what passes the checks can be simulated and asked for anything") {
  const Shelf shelf;
  std::size_t valid = 0;
  for (const std::uint64_t seed : trials()) {
    CAPTURE(seed);
    Author author(seed);
    const std::string text = author.write();
    CAPTURE(text);
    shelf.put(author.id(), text);
    const files::ProfileStore store = shelf.store();
    if (!passes(store, author.id())) continue;
    const auto profile = store.load(author.id());
    const auto start = store.load_simulation(author.id());
    REQUIRE(profile);
    REQUIRE(start);
    ++valid;
    const sim::DeviceOptions options{
        .faults = {{.kind = sim::FaultKind::reset_neighbour, .number = 5000, .every = 2},
                   {.kind = sim::FaultKind::store_other, .every = 3}},
        .rundown_every = 3s,
        .ng_every = 2,
        .burst = 2,
        .alarms = {{.code = 110, .after = 5s}, {.code = 0x30, .after = 1s}},
        .warnings = {{.code = 0x21}}};
    besiege(*sim::make_simulated_bus(*profile, *start, options), seed);
  }
  // Else the author has forgotten how to write. Some of what it writes is unguarded by accident.
  CHECK(valid * 5 >= trials().size() * 3);
}

TEST_CASE("generated profiles: every verb ends in a result or in an error of its own") {
  const Shelf shelf;
  Program program(shelf.path());
  std::size_t tried = 0;
  for (const std::uint64_t seed : trials()) {
    if (seed % 3 != 0) continue;
    CAPTURE(seed);
    Author author(seed);
    const std::string text = author.write();
    shelf.put(author.id(), text);
    if (!passes(shelf.store(), author.id())) continue;
    const auto profile = shelf.store().load(author.id());
    REQUIRE(profile);
    ++tried;
    const std::string tool = "sim:" + author.id();
    std::vector<std::vector<std::string>> lines = {
        {"list", tool},
        {"get", tool, "--limits", "--json"},
        {"get", tool, "@holding:65535", "@holding:65534/u32", "@input:8191", "@holding:8190/i32"},
        {"backup", tool, "-f", "./" + author.id() + ".backup"},
        {"diff", tool, "./" + author.id() + ".backup"},
        {"restore", tool, "./" + author.id() + ".backup", "--yes", "--force"},
        {"alarms", tool},
        {"identify", tool},
        {"ping", tool},
        {"scan", tool, "--units", "1-2"},
        {"watch", tool, "--all", "--duration", "3s"},
        {"remote-stop", tool},
        {"remote-start", tool, "--yes", "--accept-unverified", "--for", "1s"},
        {"remote-start", tool, "--yes", "--accept-unverified", "--for", "1s", "--speed", "100"},
    };
    for (const catalogue::Parameter& parameter : profile->parameters) {
      if (parameter.access != catalogue::Access::read_write || !parameter.name.starts_with("own")) {
        continue;
      }
      for (const char* value : {"0", "1", "65535"}) {
        lines.push_back({"set", tool, parameter.name + "=" + value, "--yes"});
      }
    }
    // What is inherited does the same for each heir.
    const bool inherits = text.find("\nextends:") != std::string::npos;
    for (const catalogue::Action& action : profile->actions) {
      if (inherits && !action.name.starts_with("own")) continue;
      const std::string value = action.value ? "" : fmt::format("={}", action.minimum);
      lines.push_back({"do", tool, action.name + value, "--yes", "--accept-unverified"});
    }
    for (const auto& line : lines) {
      const int status = program.run(line);
      CAPTURE(text);
      CHECK_MESSAGE(status != static_cast<int>(ExitStatus::internal),
                    fmt::format("{}: {}", fmt::join(line, " "), program.errors()));
    }
  }
  CHECK(tried > 0);
}

TEST_CASE("generated profiles: registers behind the map of the base") {
  const Shelf shelf;
  shelf.put("beyond", R"(format: 1
id: beyond
title: "Registers behind 1FFFh"
extends: orientalmotor-blv
parameters:
  - {name: "far.{n}", n: 0..300, stride: 64, register: 9000, encoding: u32, access: rw, evidence: manual, source: "x", title: "x"}
  - {name: last, register: 65534, encoding: u32, access: rw, evidence: manual, source: "x", title: "x"}
---
part: simulation
values: {"far.*": 1234567890}
)");
  Program program(shelf.path());
  CHECK(program.run({"get", "sim:beyond", "operation.3.speed", "far.0", "far.300", "last"}) == 0);
  CHECK(program.run({"set", "sim:beyond", "last=4294967295", "far.7=5", "--yes"}) == 0);
  const auto profile = shelf.store().load("beyond");
  const auto start = shelf.store().load_simulation("beyond");
  REQUIRE(profile);
  REQUIRE(start);
  const auto bus = sim::make_simulated_bus(*profile, *start, {});
  const auto read = [&](std::uint16_t first, std::uint16_t count) {
    return bus->answer({1}, {1},
                       modbus::read_request(modbus::RegisterTable::holding, {first}, count),
                       TimePoint(1h));
  };
  CHECK(modbus::registers_of(read(9000, 2).value()) == Registers{18838, 722});
  CHECK_FALSE(modbus::exception_of(read(65534, 2).value()));
  CHECK_FALSE(modbus::exception_of(read(65535, 1).value()));
  CHECK(modbus::exception_of(read(65535, 2).value()) == 2);
}
