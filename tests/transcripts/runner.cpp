// Runs transcripts: what a user types and what the program prints, in one readable file. The whole
// program runs in this process, against simulated tools on a clock that is moved by hand.
//
//   %tool URL PROFILE [FIRMWARE=N] [SERIAL=N] [MODEL=N] [BYTES=N] [RUNDOWNS=DURATION] [NG=N]
//   [FAULT=SPEC]...
//                         a tool that lives as long as the transcript; with an operator who drives
//                         a screw now and then, every Nth of them NG
//   %profiles FOLDER      profiles of that folder of the sources are known, too
//   %bank URL [UNITS=N] [FAULT=SPEC]...
//                         a serial line (rtu:// or rtu+tcp://) with units 1 to N that have nothing
//                         but registers, and are strict about their gaps
//   %bus URL PROFILE UNITS=1,2,3
//                         motor drivers on one serial line, alive as long as the transcript
//   %alarm URL UNIT CODE  an alarm occurs on one of them; %warning the same; %power URL UNIT
//                         switches one off and on; %setter URL UNIT DURATION keeps it busy
//   %fails URL WHY        opening it fails: name-not-found, no-route, connect-timeout, reset,
//                         port-busy or port-unusable
//   %interface NAME ADDRESS   this computer has such a network interface, which can send to groups
//   %datagram HEX         what comes back for each question to a group, with the question's number
//                         in its first two bytes
//   %wait DURATION        time passes
//   %later DURATION URL UNIT REGISTER VALUE
//                         so long from now another master writes a register
//   %later DURATION alarm URL UNIT CODE
//                         the same of an alarm
//   %file NAME … %end     a file in the transcript's own folder, and on the disk in memory that
//                         backups are kept on
//   %store FILE [damaged] a store of tests/support/sample_store.hpp, in the transcript's folder
//   %report-store FILE    the store of tests/support/report_store.hpp: a shift of three tools
//   %profile NAME         a file of tests/profiles/good, in the transcript's own folder
//   %edit FILE OLD NEW    replaces a text in a file on that disk
//   %set NAME VALUE       a variable of the program's environment from here on
//   %disk full|empty      whether it takes any more
//   %hide progress        from here on the line that a terminal shows for a moment is left out
//   %answer TEXT          what the user types at the next question
//   %env NAME [VALUE]     a variable of the environment; without a value it is not set
//   $ spindle ARGUMENTS   followed by what it prints
//   $ cat FILE, $ grep TEXT FILE, $ ls    what is on that disk
//
// Lines on stderr begin with "! ", and those on stdout that look as if they were typed with "\";
// a status other than 0 follows as "[2]". Behind a command on several tools time goes on to the
// next full second, as such a command takes longer or shorter, as its threads happen to take turns.
// In a Markdown file the
// fenced blocks marked "console" are run, stderr is not marked, and "$ echo $?" shows the status; a
// directive stands in a comment, and the file that it names is the fenced block behind it.
// The source folder is shown as $SOURCE. With SPINDLE_UPDATE=1 the file is rewritten with what was
// really printed.

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"
#include "spindle/cli/run.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/posix/disk.hpp"
#include "spindle/posix/world.hpp"
#include "spindle/shipped/profiles.hpp"
#include "spindle/sim/peer.hpp"
#include "spindle/sim/sim_transport.hpp"
#include "spindle/sim/simulated_tool.hpp"
#include "spindle/work/connect.hpp"
#include "support/fake_clock.hpp"
#include "support/memory_disk.hpp"
#include "support/report_store.hpp"
#include "support/rig.hpp"
#include "support/sample_store.hpp"
#include "support/serial_bank.hpp"

namespace {

using namespace spindle;
namespace fs = std::filesystem;

using Lines = std::vector<std::string>;

Lines read_lines(const fs::path& path) {
  std::ifstream file(path);
  Lines lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

/// Words as a shell would split them: single and double quotes, backslash outside of them.
std::vector<std::string> shell_words(const std::string& line) {
  std::vector<std::string> words;
  std::optional<std::string> word;
  char quote = 0;
  for (std::size_t index = 0; index < line.size(); ++index) {
    const char c = line[index];
    if (quote != 0) {
      if (c == quote) {
        quote = 0;
      } else {
        *word += c;
      }
    } else if (c == ' ') {
      if (word) words.push_back(*word);
      word.reset();
    } else if (c == '\'' || c == '"') {
      quote = c;
      word = word.value_or("");
    } else {
      word = word.value_or("") + (c == '\\' && index + 1 < line.size() ? line[++index] : c);
    }
  }
  if (word) words.push_back(*word);
  return words;
}

/// Where the sources are differs from machine to machine.
std::string without_source_folder(std::string text) {
  const std::string folder = SPINDLE_SOURCE_DIR;
  for (std::size_t at = text.find(folder); at != std::string::npos; at = text.find(folder, at)) {
    text.replace(at, folder.size(), "$SOURCE");
  }
  return text;
}

/// Nor has the folder of a transcript a name that stays.
std::string without_own_folder(std::string text) {
  const std::string folder = fs::current_path().string();
  for (std::size_t at = text.find(folder); at != std::string::npos; at = text.find(folder, at)) {
    text.replace(at, folder.size(), "$FOLDER");
  }
  return text;
}

enum class Marking { mark_stderr, plain };

/// A simulated tool behind an address, alive from one command to the next.
struct Tool {
  catalogue::Profile profile;
  sim::FaultPlan faults;
  std::unique_ptr<sim::Server> server;
  sim::SimulatedBus* bus = nullptr;  ///< the server, where it is one
  sim::AnswerCounter answers;
  std::uint32_t connections = 0;
};

/// A group in which every question has the same answers, at once.
class FakeGroup final : public link::Datagrams {
 public:
  FakeGroup(std::vector<Bytes> answers, std::string interface, Clock& clock)
      : answers_(std::move(answers)), interface_(std::move(interface)), clock_(&clock) {}

  std::vector<Error> send(ByteView question) override {
    for (Bytes answer : answers_) {
      std::copy_n(question.begin(), std::min<std::size_t>(2, answer.size()), answer.begin());
      waiting_.push_back({std::move(answer), "192.168.10.100", interface_});
    }
    return {};
  }
  Result<std::optional<link::Datagram>> receive(TimePoint deadline) override {
    if (waiting_.empty()) {
      return clock_->sleep_until(deadline).map([] { return std::optional<link::Datagram>(); });
    }
    link::Datagram next = std::move(waiting_.front());
    waiting_.erase(waiting_.begin());
    return next;
  }

 private:
  std::vector<Bytes> answers_;
  std::string interface_;
  Clock* clock_;
  std::vector<link::Datagram> waiting_ = {};
};
/// Whether a sentence on stderr goes on behind column 100. A word that alone is too wide, frames,
/// and what can be pasted are not broken.
bool is_too_wide(const std::string& line) {
  constexpr std::string_view mark = "! ";
  constexpr std::size_t widest = 100;
  const auto characters = std::count_if(line.begin(), line.end(), [](char byte) {
    return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U;  // not one that goes on with UTF-8
  });
  if (!line.starts_with(mark) || static_cast<std::size_t>(characters) <= mark.size() + widest)
    return false;
  const std::string_view text = std::string_view(line).substr(mark.size());
  // A frame of --verbose begins with its time, and progress is no line that stays.
  const bool is_frame = glob_match("[0-9]*T*Z *", text.substr(0, 30));
  const bool is_whole =
      is_frame || text.starts_with("  try: ") || text.find('\x1b') != std::string_view::npos;
  const std::size_t begin = text.find_first_not_of(' ');
  return !is_whole && text.substr(0, widest).find(' ', begin) != std::string_view::npos;
}

class Stage {
 public:
  Stage() : profiles_({std::string(SPINDLE_SOURCE_DIR) + "/profiles"}, posix::source_disk()) {}

  void add_tool(const std::vector<std::string>& words) {
    auto profile = profiles_.load(words.at(1));
    auto start = profiles_.load_simulation(words.at(1));
    if (!profile || !start) throw std::runtime_error("no such profile: " + words.at(1));
    auto tool = std::make_unique<Tool>();
    sim::DeviceOptions options;
    for (std::size_t index = 2; index < words.size(); ++index) {
      const auto equals = words[index].find('=');
      const std::string key = words[index].substr(0, equals);
      const std::string value = words[index].substr(equals + 1);
      if (key == "FIRMWARE") options.firmware = static_cast<std::uint16_t>(std::stoul(value));
      if (key == "SERIAL") options.serial = static_cast<std::uint32_t>(std::stoul(value));
      if (key == "MODEL") options.tool_model = static_cast<std::uint16_t>(std::stoul(value));
      if (key == "BYTES") options.identity_bytes = std::stoul(value);
      if (key == "RUNDOWNS") options.rundown_every = parse_duration(value).value();
      if (key == "NG") options.ng_every = static_cast<unsigned>(std::stoul(value));
      if (key == "FAULT") tool->faults.push_back(sim::parse_fault(value).value());
    }
    options.faults = tool->faults;
    tool->server = sim::make_simulated_bus(*profile, *start, options);
    tool->profile = std::move(*profile);
    const auto endpoint = link::parse_endpoint(words.at(0)).value();
    tools_[address(endpoint.host, endpoint.port.value_or(tool->profile.link.port))] =
        std::move(tool);
  }

  void add_profiles(const std::string& folder) {
    own_profiles_ = std::string(SPINDLE_SOURCE_DIR) + "/" + folder;
    profiles_ = files::ProfileStore({own_profiles_, std::string(SPINDLE_SOURCE_DIR) + "/profiles"},
                                    posix::source_disk());
  }

  void add_bank(const std::vector<std::string>& words) {
    auto tool = std::make_unique<Tool>();
    test::SerialBank::Options options;
    for (std::size_t index = 1; index < words.size(); ++index) {
      const auto equals = words[index].find('=');
      const std::string key = words[index].substr(0, equals);
      const std::string value = words[index].substr(equals + 1);
      if (key == "FAULT") tool->faults.push_back(sim::parse_fault(value).value());
      if (key != "UNITS") continue;
      options.units.clear();
      for (unsigned unit = 1; unit <= std::stoul(value); ++unit)
        options.units.push_back({static_cast<std::uint8_t>(unit)});
    }
    tool->server = std::make_unique<test::SerialBank>(options);
    tool->profile.link.framing = modbus::Framing::rtu;
    const auto endpoint = link::parse_endpoint(words.at(0)).value();
    tools_[commands::shared_line(endpoint)] = std::move(tool);
  }
  void make_store(const std::vector<std::string>& words) const {
    words.size() > 2 ? test::make_damaged_store(words.at(1), profiles_)
                     : test::make_sample_store(words.at(1), profiles_);
  }
  void set_variable(const std::string& name, const std::string& value) { variables_[name] = value; }
  void hide_progress() { hides_progress_ = true; }
  void go_to_full_second() {
    constexpr Duration second = std::chrono::seconds(1);
    const Duration over = clock_.now().time_since_epoch() % second;
    if (over > Duration::zero()) clock_.advance(second - over);
  }

  void add_interface(const std::vector<std::string>& words) {
    interfaces_.push_back(
        {.name = words.at(1), .address = words.at(2), .is_up = true, .is_multicast = true});
  }
  void add_failure(const std::string& url, const std::string& why) {
    static const std::map<std::string, Errc> words = {{"name-not-found", Errc::name_not_found},
                                                      {"no-route", Errc::no_route},
                                                      {"connect-timeout", Errc::connect_timeout},
                                                      {"reset", Errc::reset},
                                                      {"port-busy", Errc::port_busy},
                                                      {"port-unusable", Errc::port_unusable}};
    failures_[key_of(link::parse_endpoint(url).value(), 502)] = words.at(why);
  }

  void add_datagram(const std::string& hex) {
    Bytes bytes;
    for (std::size_t at = 0; at + 1 < hex.size(); at += 2) {
      bytes.push_back(static_cast<std::uint8_t>(std::stoul(hex.substr(at, 2), nullptr, 16)));
    }
    datagrams_.push_back(std::move(bytes));
  }

  /// Motor drivers on one line; what happens to them is told by happen().
  void add_bus(const std::vector<std::string>& words) {
    auto tool = std::make_unique<Tool>();
    tool->profile = profiles_.load(words.at(1)).value();
    sim::DeviceOptions options;
    for (std::size_t index = 2; index < words.size(); ++index) {
      const auto equals = words[index].find('=');
      const std::string value = words[index].substr(equals + 1);
      if (words[index].starts_with("FAULT=")) {
        tool->faults.push_back(sim::parse_fault(value).value());
      } else {
        options.units.clear();
        for (const std::string_view unit : split(value, ',')) {
          options.units.push_back(static_cast<std::uint8_t>(parse_unsigned(unit, 31).value()));
        }
      }
    }
    const auto start = profiles_.load_simulation(words.at(1)).value();
    auto bus = test::simulated({tool->profile, start}, options);
    tool->bus = bus.get();
    tool->server = std::move(bus);
    tools_[commands::shared_line(link::parse_endpoint(words.at(0)).value())] = std::move(tool);
  }

  void happen(const std::string& what, const std::vector<std::string>& words) {
    if (what == "wait") return clock_.advance(parse_duration(words.at(0)).value());
    if (what == "later") return write_later(words);
    sim::SimulatedBus& bus =
        *tools_.at(commands::shared_line(link::parse_endpoint(words.at(0)).value()))->bus;
    const auto unit = static_cast<std::uint8_t>(std::stoul(words.at(1)));
    if (what == "power") return bus.power_cycle(unit, clock_.now());
    if (what == "setter") {
      return bus.use_setter(unit, clock_.now() + parse_duration(words.at(2)).value());
    }
    const auto code = static_cast<std::uint8_t>(parse_unsigned(words.at(2), 255).value());
    if (what == "alarm") bus.raise_alarm(unit, code, clock_.now());
    if (what == "warning") bus.raise_warning(unit, code, clock_.now());
  }

  void write_later(const std::vector<std::string>& words) {
    if (words.at(1) == "alarm") {
      clock_.at(clock_.now() + parse_duration(words.at(0)).value(), [=, this] {
        happen("alarm", {words.begin() + 2, words.end()});
      });
      return;
    }
    sim::SimulatedBus* bus =
        tools_.at(commands::shared_line(link::parse_endpoint(words.at(1)).value()))->bus;
    const modbus::UnitId unit{static_cast<std::uint8_t>(std::stoul(words.at(2)))};
    const auto write = modbus::write_request({static_cast<std::uint16_t>(std::stoul(words.at(3)))},
                                             static_cast<std::uint16_t>(std::stoul(words.at(4))));
    clock_.at(clock_.now() + parse_duration(words.at(0)).value(),
              [=, this] { bus->answer({99}, unit, write, clock_.now()); });
  }

  void set_variable(const std::vector<std::string>& words) {
    variables_[words.at(1)] = words.size() > 2 ? words.at(2) : std::string();
  }

  void answer(std::string text) { answers_.push_back(std::move(text)); }

  /// Runs one command line (without "spindle") and returns what a terminal would show.
  Lines run(const std::vector<std::string>& arguments, Marking marking) {
    std::string shown;
    bool fresh_line = true;
    const auto show = [&](std::string_view text, bool is_error) {
      for (const char c : text) {
        if (c == '\r') continue;
        if (fresh_line && is_error && marking == Marking::mark_stderr) shown += "! ";
        shown += c;
        fresh_line = c == '\n';
      }
    };
    cli::World world{
        .io = {.out =
                   [&](std::string_view text) {
                     show(text, false);
                     return Result<void>();
                   },
               .err =
                   [&](std::string_view text) {
                     const bool is_progress = text.starts_with("\r\x1b[K");
                     if (!is_progress || !hides_progress_) show(text, true);
                   },
               .read_line = [&] { return next_answer(show); },
               .in_is_terminal = !answers_.empty(),
               .err_is_terminal = !answers_.empty()},
        .clock = clock_,
        .interrupt = interrupt_.emplace(),
        .open = [this](const auto& endpoint, const auto& facts,
                       Duration) { return open(endpoint, facts); },
        // Enough of a server: it is listening, and no client comes.
        .uninterruptible = {clock_, calm_,
                            [this](const auto& endpoint, const auto& facts, Duration) {
                              return open(endpoint, facts);
                            }},
        .serve = [](sim::Server&,
                    const sim::ServeOptions& options) { return options.listening(5000); },
        .end_waits = [this] { interrupt_->end_waits(); },
        .environment = [this](std::string_view name) -> std::optional<std::string> {
          if (name == "XDG_STATE_HOME") return "/state";
          if (name == "SPINDLE_PROFILE_PATH" && !own_profiles_.empty()) return own_profiles_;
          const auto found = variables_.find(name);
          return found == variables_.end() ? std::nullopt : std::optional(found->second);
        },
        .disk = disk_.functions(),
        .installation = {SPINDLE_SOURCE_DIR, "3.1.6"},
        .shipped = shipped::profiles(),
        .network = network()};
    opened_.clear();
    status_ = cli::run(arguments, world);
    if (opened_.size() > 1) go_to_full_second();
    Lines lines;
    std::istringstream stream(without_own_folder(without_source_folder(std::move(shown))));
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    for (const std::string& line : lines) {
      if (marking == Marking::mark_stderr && is_too_wide(line)) too_wide_.push_back(line);
    }
    if (status_ != 0 && marking == Marking::mark_stderr)
      lines.push_back(fmt::format("[{}]", status_));
    return lines;
  }

  [[nodiscard]] int status() const { return status_; }
  [[nodiscard]] const Lines& too_wide() const { return too_wide_; }
  [[nodiscard]] test::MemoryDisk& disk() { return disk_; }

 private:
  static std::string address(const std::string& host, std::uint16_t port) {
    return fmt::format("{}:{}", host, port);
  }

  link::Network network() {
    return {.interfaces = [this]() -> Result<std::vector<link::NetworkInterface>> {
              return interfaces_;
            },
            .open = [this](const auto& interfaces, const auto&, auto,
                           auto&) -> Result<std::unique_ptr<link::Datagrams>> {
              return std::make_unique<FakeGroup>(datagrams_, interfaces.front().name, clock_);
            }};
  }

  template <typename Show>
  std::optional<std::string> next_answer(const Show& show) {
    if (answers_.empty()) return std::nullopt;
    std::string answer = answers_.front();
    answers_.erase(answers_.begin());
    show(answer + "\n", true);
    return answer;
  }

  static std::string key_of(const link::Endpoint& endpoint, std::uint16_t usual_port) {
    return endpoint.medium == link::Medium::tcp
               ? address(endpoint.host, endpoint.port.value_or(usual_port))
               : commands::shared_line(endpoint);
  }

  Result<std::unique_ptr<link::Transport>> open(const link::Endpoint& endpoint,
                                                const catalogue::LinkSpec& facts) {
    const bool serial = endpoint.medium != link::Medium::tcp;
    const std::string key = key_of(endpoint, facts.port);
    {
      const std::lock_guard turn(mutex_);
      opened_.insert(fmt::format("{} {}", key, endpoint.unit ? endpoint.unit->value : 0));
    }
    if (const auto failure = failures_.find(key); failure != failures_.end()) {
      return tl::unexpected(Error{
          .code = failure->second, .tried = "report server id", .waited = std::chrono::seconds(3)});
    }
    const auto found = tools_.find(key);
    if (found == tools_.end() && serial) {
      return posix::line_opener(clock_, *interrupt_)(endpoint, facts, Duration::zero());
    }
    if (found == tools_.end()) return tl::unexpected(Error{.code = Errc::connection_refused});
    const sim::LineModel model{
        .character_time = character_time(link::serial_settings(endpoint, facts.serial.line))};
    Tool& tool = *found->second;
    return sim::make_sim_transport(*tool.server, {++tool.connections}, tool.profile.link.framing,
                                   tool.faults, tool.answers, clock_, *interrupt_, model);
  }

  files::ProfileStore profiles_;
  std::string own_profiles_ = {};  ///< a folder beside that of the shipped ones; may be empty
  test::FakeClock clock_;
  const Interrupt calm_;
  std::optional<Interrupt> interrupt_;  // a new one for every command, as for every process
  std::map<std::string, std::unique_ptr<Tool>> tools_;
  std::mutex mutex_ = {};
  std::set<std::string> opened_ = {};          ///< by the present command
  std::map<std::string, Errc> failures_ = {};  ///< of opening a URL
  std::vector<std::string> answers_;
  Lines too_wide_;
  test::MemoryDisk disk_;
  std::vector<link::NetworkInterface> interfaces_;
  std::vector<Bytes> datagrams_;
  bool hides_progress_ = false;
  std::map<std::string, std::string, std::less<>> variables_ = {};
  int status_ = 0;
};

/// The lines that cat, grep and ls print of a disk.
Lines look_at(const std::vector<std::string>& words, const test::MemoryDisk& disk) {
  Lines shown;
  if (words.at(0) == "ls") {
    for (const auto& [path, text] : disk.files()) shown.push_back(path);
    return shown;
  }
  std::istringstream stream(disk.text(words.back()));
  for (std::string line; std::getline(stream, line);) {
    const bool wanted = words.at(0) != "grep" || line.find(words.at(1)) != std::string::npos;
    if (wanted) shown.push_back(line);
  }
  return shown;
}

constexpr std::string_view file_comment = "<!-- %file ";

/// Plays one file and returns it as it should read.
class Player {
 public:
  explicit Player(bool markdown) : markdown_(markdown) {}

  Lines play(const Lines& lines) {
    for (std::size_t index = 0; index < lines.size(); ++index) index = play_line(lines, index);
    return played_;
  }
  [[nodiscard]] int commands() const { return commands_; }
  [[nodiscard]] const Lines& too_wide() const { return stage_.too_wide(); }

 private:
  std::size_t play_line(const Lines& lines, std::size_t index) {
    const std::string& line = lines[index];
    played_.push_back(line);
    if (markdown_ && line.starts_with("```")) in_block_ = line.starts_with("```console");
    if (markdown_ && line.starts_with(file_comment)) return write_block(lines, index);
    if (markdown_ && line.starts_with("<!-- %")) directive(line.substr(5, line.rfind(" -->") - 5));
    if (markdown_ && !in_block_) return index;
    if (line.starts_with("%file ")) return write_file(line.substr(6), "%end", lines, index);
    if (line.starts_with("%")) directive(line);
    if (line.starts_with("$ spindle")) return run(lines, index);
    if (line.starts_with("$ echo $?")) {
      return show({std::to_string(stage_.status())}, lines, index);
    }
    if (line.starts_with("$ ")) {
      return show(look_at(shell_words(line.substr(2)), stage_.disk()), lines, index);
    }
    return index;
  }

  void directive(const std::string& line) {
    const auto words = shell_words(line.substr(1));
    const std::string& what = words.at(0);
    if (what == "bus") stage_.add_bus({words.begin() + 1, words.end()});
    for (const std::string_view event : {"alarm", "warning", "power", "setter", "wait", "later"}) {
      if (what == event) stage_.happen(what, {words.begin() + 1, words.end()});
    }
    if (words.at(0) == "profiles") stage_.add_profiles(words.at(1));
    if (words.at(0) == "store") stage_.make_store(words);
    if (words.at(0) == "report-store") test::make_shift(words.at(1));
    if (words.at(0) == "tool") stage_.add_tool({words.begin() + 1, words.end()});
    if (words.at(0) == "bank") stage_.add_bank({words.begin() + 1, words.end()});
    if (words.at(0) == "answer") stage_.answer(words.at(1));
    if (words.at(0) == "env") stage_.set_variable(words);
    if (words.at(0) == "disk" && words.at(1) == "full") stage_.disk().fill();
    if (words.at(0) == "disk" && words.at(1) == "empty") stage_.disk().make_room();
    if (words.at(0) == "profile") copy_profile(words.at(1));
    if (words.at(0) == "set") stage_.set_variable(words.at(1), words.at(2));
    if (words.at(0) == "hide") stage_.hide_progress();
    if (words.at(0) == "interface") stage_.add_interface(words);
    if (words.at(0) == "datagram") stage_.add_datagram(words.at(1));
    if (words.at(0) == "fails") stage_.add_failure(words.at(1), words.at(2));
    if (words.at(0) == "edit") edit(words.at(1), words.at(2), words.at(3));
  }

  static void copy_profile(const std::string& name) {
    fs::copy_file(fs::path(SPINDLE_SOURCE_DIR) / "tests/profiles/good" / (name + ".yaml"),
                  name + ".yaml");
  }

  void edit(const std::string& name, const std::string& old_text, const std::string& new_text) {
    std::string text = stage_.disk().text(name);
    const std::size_t at = text.find(old_text);
    if (at == std::string::npos) throw std::runtime_error("not in " + name + ": " + old_text);
    stage_.disk().put(name, text.replace(at, old_text.size(), new_text));
  }

  /// Writes what stands between `index` and the line `end`; returns where that is.
  std::size_t write_file(const std::string& name, std::string_view end, const Lines& lines,
                         std::size_t index) {
    std::ostringstream text;
    while (++index < lines.size()) {
      played_.push_back(lines[index]);
      if (lines[index] == end) break;
      text << lines[index] << '\n';
    }
    std::ofstream(name) << text.str();
    stage_.disk().put(name, text.str());
    return index;
  }

  /// The fenced block behind a comment that names a file.
  std::size_t write_block(const Lines& lines, std::size_t index) {
    const std::string& comment = lines[index];
    const std::size_t until = comment.rfind(" -->");
    const std::string name = comment.substr(file_comment.size(), until - file_comment.size());
    played_.push_back(lines.at(++index));
    return write_file(name, "```", lines, index);
  }

  std::size_t run(const Lines& lines, std::size_t index) {
    ++commands_;
    const auto words = shell_words(lines[index].substr(2));
    return show(stage_.run({words.begin() + 1, words.end()},
                           markdown_ ? Marking::plain : Marking::mark_stderr),
                lines, index);
  }

  /// What is printed is told from what is typed.
  [[nodiscard]] std::string shown(const std::string& line) const {
    const bool looks_typed =
        line.starts_with("#") || line.starts_with("%") || line.starts_with("$ ");
    return looks_typed && !markdown_ ? "\\" + line : line;
  }

  std::size_t show(const Lines& printed, const Lines& lines, std::size_t index) {
    for (const std::string& line : printed) played_.push_back(shown(line));
    // The old output ends where the next thing begins.
    std::size_t next = index + 1;
    const auto ends = [&](const std::string& line) {
      return line.starts_with("$ ") || line.starts_with("%") || line.starts_with("```") ||
             (!markdown_ && line.starts_with("#"));
    };
    std::size_t last = next;
    while (last < lines.size() && !ends(lines[last])) ++last;
    // An empty line before the next command is layout, not output.
    while (last > next && lines[last - 1].empty()) --last;
    return last - 1;
  }

  bool markdown_;
  bool in_block_ = false;
  int commands_ = 0;
  Stage stage_;
  Lines played_;
};

int report_difference(const Lines& expected, const Lines& played) {
  const std::size_t count = std::max(expected.size(), played.size());
  for (std::size_t index = 0; index < count; ++index) {
    const std::string want = index < expected.size() ? expected[index] : "(end of file)";
    const std::string have = index < played.size() ? played[index] : "(end of output)";
    if (want == have) continue;
    std::cerr << fmt::format("line {}:\n  expected: {}\n  printed:  {}\n", index + 1, want, have);
    for (std::size_t more = index + 1; more < std::min(index + 6, played.size()); ++more) {
      std::cerr << "            " << played[more] << '\n';
    }
    return 1;
  }
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::cerr << "usage: spindle_transcripts FILE\n";
    return 2;
  }
  const fs::path path = fs::absolute(arguments[1]);
  const Lines expected = read_lines(path);
  std::string folder = (fs::temp_directory_path() / "spindle-transcript-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) return 2;
  fs::current_path(folder);
  Player player(path.extension() == ".md");
  const Lines played = player.play(expected);
  fs::current_path("/");
  fs::remove_all(folder);
  if (player.commands() == 0) {
    std::cerr << path << ": no command in it\n";
    return 1;
  }
  for (const std::string& line : player.too_wide()) std::cerr << "too wide: " << line << '\n';
  if (!player.too_wide().empty() && std::getenv("SPINDLE_UPDATE") == nullptr) return 1;
  if (std::getenv("SPINDLE_UPDATE") != nullptr) {
    std::ofstream file(path);
    for (const std::string& line : played) file << line << '\n';
    return 0;
  }
  return report_difference(expected, played);
}
