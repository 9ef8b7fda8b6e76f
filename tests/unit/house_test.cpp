// The rules of the house: which layer may see which, where a library is at home, and what no source
// uses. The tables below are the law; the rest enforces it.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace {

using Names = std::set<std::string, std::less<>>;
using Diagnostics = std::vector<std::string>;

/// A file by its path from the root of the repository.
struct Source {
  std::string path;
  std::string text;
};

// ---- the law ----

/// What each layer may include; it also sees what those see.
const std::map<std::string, Names, std::less<>> arrows = {
    {"base", {}},
    {"modbus", {"base"}},
    {"catalogue", {"modbus"}},
    {"link", {"modbus"}},
    {"sim", {"catalogue", "link"}},
    {"report", {"base"}},
    {"store", {"base"}},
    {"statistics", {}},
    {"chart", {"base"}},
    {"files", {"catalogue"}},
    {"shipped", {"files", "posix"}},
    {"device", {"link", "catalogue"}},
    {"posix", {"link", "sim"}},
    {"work", {"device", "files", "sim", "store"}},
    {"commands", {"report", "work", "sim", "statistics", "chart"}},
    {"cli", {"commands"}},
    {"forward", {"commands"}},
    {"page", {"commands"}},
    {"main", {"cli", "posix", "shipped", "forward", "page"}},
};

/// The programs themselves, in no folder.
const Names programs = {"src/main.cpp", "src/forward_main.cpp", "src/page_main.cpp",
                        "src/program.cpp", "src/program.hpp"};

/// Headers that begin so are included in these areas only.
struct HomeOfHeader {
  std::string_view prefix;
  Names areas;
};

const std::vector<HomeOfHeader> homes = {
    {"CLI/", {"cli"}},
    {"yaml.h", {"files"}},
    {"sqlite3.h", {"store"}},
    {"mosquitto.h", {"forward"}},
    {"libpq-fe.h", {"forward"}},
    {"httplib.h", {"page"}},
    {"nlohmann/", {}},
    {"modbus.h", {"posix"}},
    {"modbus/", {"posix"}},
    {"iostream", {"posix", "main"}},
    {"cstdio", {"posix", "main", "shipped"}},
    {"stdio.h", {"posix", "main"}},
};

enum class Counts { anywhere, when_called };

/// Words of code that appear in these files only. A call through an object (`app.exit(…)`) is
/// a function of the same name elsewhere.
struct BannedWord {
  std::string_view word;
  Counts counts;
  Names files;
};

const std::vector<BannedWord> banned_words = {
    {"exit", Counts::when_called, {}},
    {"quick_exit", Counts::when_called, {}},
    {"rand", Counts::when_called, {}},
    {"srand", Counts::when_called, {}},
    {"sleep", Counts::when_called, {}},
    {"usleep", Counts::when_called, {}},
    {"nanosleep", Counts::when_called, {}},
    {"sleep_for", Counts::anywhere, {}},
    {"this_thread", Counts::anywhere, {}},
    // The one place that waits: it is what `Clock::sleep_until` is made of.
    {"clock_nanosleep", Counts::anywhere, {"src/posix/clock.cpp"}},
    {"new", Counts::anywhere, {}},
    {"shared_ptr", Counts::anywhere, {}},
    {"make_shared", Counts::anywhere, {}},
    // What a locale could change: numbers are read and written the same everywhere.
    {"locale", Counts::anywhere, {}},
    {"setlocale", Counts::anywhere, {}},
    {"imbue", Counts::anywhere, {}},
    {"stringstream", Counts::anywhere, {}},
    {"ostringstream", Counts::anywhere, {}},
    {"strtod", Counts::anywhere, {}},
    {"strtof", Counts::anywhere, {}},
    {"strtold", Counts::anywhere, {}},
    {"atof", Counts::anywhere, {}},
    {"stod", Counts::anywhere, {}},
    {"stof", Counts::anywhere, {}},
    {"stold", Counts::anywhere, {}},
    {"wcwidth", Counts::anywhere, {}},
    // Files are read, written, listed and compared through `Disk`.
    {"ifstream", Counts::anywhere, {}},
    {"ofstream", Counts::anywhere, {}},
    {"fopen", Counts::anywhere, {}},
    {"directory_iterator", Counts::anywhere, {"src/posix/reading.cpp"}},  // what `Disk` lists by
    {"equivalent", Counts::anywhere, {"src/posix/disk.cpp"}},
    // The others ask what a serial port is really called, which is no file with a text.
    {"canonical",
     Counts::anywhere,
     {"src/posix/disk.cpp", "src/posix/port_holder.cpp", "src/posix/serial.cpp"}},
    {"weakly_canonical", Counts::anywhere, {"src/work/target.cpp"}},
};

// Lines of code in main.cpp; includes, comments and blank lines are free.
constexpr std::ptrdiff_t longest_main = 20;

// Lines from the head of a function to its closing brace, and of the file of a verb.
constexpr std::ptrdiff_t longest_function = 60;
constexpr std::ptrdiff_t longest_verb = 200;
constexpr std::string_view verbs_header = "include/spindle/commands/commands.hpp";

// Spelt in halves so that this file does not find itself.
const std::vector<std::string> unfinished = {std::string("TO") + "DO", std::string("FIX") + "ME"};

// Who does it is said: the caller, another program, a reader.
const std::vector<std::string> unclear = {std::string("some") + "body", std::string("any") + "body",
                                          std::string("no") + "body", std::string("who") + "ever",
                                          std::string("can") + " not"};

// ---- reading code ----

bool is_word_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

/// Where the literal that begins at `begin` with a quote ends.
std::size_t end_of_quoted(std::string_view text, std::size_t begin) {
  std::size_t at = begin + 1;
  while (at < text.size() && text[at] != text[begin]) at += text[at] == '\\' ? 2U : 1U;
  return std::min(at + 1, text.size());
}

/// Where the raw string whose quote is at `quote` ends.
std::size_t end_of_raw_string(std::string_view text, std::size_t quote) {
  const std::size_t open = text.find('(', quote);
  if (open == std::string_view::npos) return text.size();
  const std::string close = fmt::format("){}\"", text.substr(quote + 1, open - quote - 1));
  const std::size_t end = text.find(close, open);
  return end == std::string_view::npos ? text.size() : end + close.size();
}

/// Where what begins at `at` and is not code ends: a comment or a literal. `at` itself for code.
std::size_t end_of_other(std::string_view text, std::size_t at) {
  const std::string_view rest = text.substr(at);
  const char before = at == 0 ? '\n' : text[at - 1];
  if (rest.starts_with("//")) return std::min(text.find('\n', at), text.size());
  if (rest.starts_with("/*")) {
    const std::size_t end = text.find("*/", at + 2);
    return end == std::string_view::npos ? text.size() : end + 2;
  }
  if (rest.starts_with("R\"") && !is_word_character(before)) return end_of_raw_string(text, at + 1);
  if (rest.front() == '"') return end_of_quoted(text, at);
  // Behind a word character it separates digits.
  if (rest.front() == '\'' && !is_word_character(before)) return end_of_quoted(text, at);
  return at;
}

/// The text with comments and literals taken out; lines stay where they were.
std::string code_of(std::string_view text) {
  std::string code;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = end_of_other(text, at);
    if (end == at) {
      code += text[at++];
      continue;
    }
    code.append(
        static_cast<std::size_t>(std::count(text.begin() + static_cast<std::ptrdiff_t>(at),
                                            text.begin() + static_cast<std::ptrdiff_t>(end), '\n')),
        '\n');
    if (end < text.size() && text[end] != '\n') code += ' ';
    at = end;
  }
  return code;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
  return text.substr(begin, text.find_last_not_of(" \t\r") + 1 - begin);
}

struct Include {
  std::string name;
  char opening;  ///< '<' or '"'
};

/// The #include lines of a text; `# include` and blanks in front count too.
std::vector<Include> includes_of(const std::string& text) {
  std::vector<Include> includes;
  for (const std::string& line : lines_of(text)) {
    std::string_view rest = trimmed(line);
    if (!rest.starts_with('#')) continue;
    rest = trimmed(rest.substr(1));
    if (!rest.starts_with("include")) continue;
    rest = trimmed(rest.substr(std::string_view("include").size()));
    const std::size_t end = rest.find_first_of(">\"", 1);
    if (rest.empty() || end == std::string_view::npos) continue;
    includes.push_back({.name = std::string(rest.substr(1, end - 1)), .opening = rest.front()});
  }
  return includes;
}

/// The part of the path or include name behind `prefix` up to the next slash.
std::string part_behind(std::string_view path, std::string_view prefix) {
  if (!path.starts_with(prefix)) return {};
  path.remove_prefix(prefix.size());
  const std::size_t slash = path.find('/');
  return slash == std::string_view::npos ? std::string() : std::string(path.substr(0, slash));
}

/// The layer that a file belongs to; empty when it is in none.
std::string layer_of(std::string_view path) {
  if (programs.contains(path)) return "main";
  const std::string public_layer = part_behind(path, "include/spindle/");
  return public_layer.empty() ? part_behind(path, "src/") : public_layer;
}

/// Everything that a layer may see: itself and all that its arrows lead to.
Names visible_from(const std::string& layer) {
  Names seen = {layer};
  for (const std::string& below : arrows.at(layer)) seen.merge(visible_from(below));
  return seen;
}

// ---- the rules ----

void check_layers(const Source& source, Diagnostics& findings) {
  const std::string layer = layer_of(source.path);
  if (!arrows.contains(layer)) {
    findings.push_back(fmt::format("{}: is in no layer", source.path));
    return;
  }
  const Names visible = visible_from(layer);
  for (const Include& include : includes_of(source.text)) {
    const std::string seen = part_behind(include.name, "spindle/");
    if (!seen.empty() && !visible.contains(seen)) {
      findings.push_back(fmt::format("{}: {} must not see {}", source.path, layer, include.name));
    }
  }
}

void check_private_headers(const Source& source, Diagnostics& findings) {
  const std::string own = layer_of(source.path) + "/";
  for (const Include& include : includes_of(source.text)) {
    if (include.opening != '"' || include.name.starts_with("spindle/")) continue;
    const bool is_beside = include.name.find('/') == std::string::npos;
    if (!is_beside && !include.name.starts_with(own)) {
      findings.push_back(
          fmt::format("{}: {} is private to another layer", source.path, include.name));
    }
    if (source.path.starts_with("include/")) {
      findings.push_back(
          fmt::format("{}: a public header shows the private {}", source.path, include.name));
    }
  }
}

void check_homes(const Source& source, Diagnostics& findings) {
  const std::string layer = layer_of(source.path);
  for (const Include& include : includes_of(source.text)) {
    for (const HomeOfHeader& home : homes) {
      if (include.name.starts_with(home.prefix) && !home.areas.contains(layer)) {
        findings.push_back(
            fmt::format("{}: {} is not at home in {}", source.path, include.name, layer));
      }
    }
  }
}

bool is_use(std::string_view code, std::size_t at, const BannedWord& banned) {
  const std::string_view before = code.substr(0, at);
  const std::string_view behind = code.substr(at + banned.word.size());
  if (!before.empty() && is_word_character(before.back())) return false;
  if (!behind.empty() && is_word_character(behind.front())) return false;
  if (banned.counts == Counts::anywhere) return true;
  return trimmed(behind).starts_with('(') && !before.ends_with('.') && !before.ends_with("->");
}

bool uses(std::string_view code, const BannedWord& banned) {
  std::size_t at = code.find(banned.word);
  while (at != std::string_view::npos && !is_use(code, at, banned)) {
    at = code.find(banned.word, at + 1);
  }
  return at != std::string_view::npos;
}

/// The code without preprocessor lines: <new> is a header, not an allocation.
std::string statements_of(const Source& source) {
  std::string statements;
  for (const std::string& line : lines_of(code_of(source.text))) {
    if (!trimmed(line).starts_with('#')) statements += line + '\n';
  }
  return statements;
}

void check_words(const Source& source, Diagnostics& findings) {
  const std::string statements = statements_of(source);
  for (const BannedWord& banned : banned_words) {
    if (!banned.files.contains(source.path) && uses(statements, banned)) {
      findings.push_back(fmt::format("{}: uses {}", source.path, banned.word));
    }
  }
}

void check_english(const Source& source, Diagnostics& findings) {
  std::string text = source.text;
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const std::string& word : unclear) {
    if (text.find(word) != std::string::npos) {
      findings.push_back(fmt::format("{}: says {}", source.path, word));
    }
  }
}

void check_finished(const Source& source, Diagnostics& findings) {
  for (const std::string& mark : unfinished) {
    if (source.text.find(mark) != std::string::npos) {
      findings.push_back(fmt::format("{}: says {}", source.path, mark));
    }
  }
}

/// fmt's 'L' asks the locale for its decimal sign.
void check_formats(const Source& source, Diagnostics& findings) {
  for (std::size_t at = source.text.find('{'); at != std::string::npos;
       at = source.text.find('{', at + 1)) {
    const std::size_t end = source.text.find_first_of("{}\n\"", at + 1);
    if (end == std::string::npos || source.text[end] != '}') continue;
    const std::string_view field = std::string_view(source.text).substr(at, end - at);
    if (field.find(':') == std::string_view::npos || !field.ends_with('L')) continue;
    findings.push_back(fmt::format("{}: formats by locale: {}}}", source.path, field));
  }
}

void check_pragma_once(const Source& source, Diagnostics& findings) {
  if (!source.path.ends_with(".hpp")) return;
  const std::vector<std::string> lines = lines_of(code_of(source.text));
  if (std::find(lines.begin(), lines.end(), "#pragma once") == lines.end()) {
    findings.push_back(fmt::format("{}: lacks #pragma once", source.path));
  }
}

void check_main(const Source& source, Diagnostics& findings) {
  if (!source.path.ends_with("main.cpp") || layer_of(source.path) != "main") return;
  const std::vector<std::string> lines = lines_of(statements_of(source));
  const auto code_lines = std::count_if(
      lines.begin(), lines.end(), [](const std::string& line) { return !trimmed(line).empty(); });
  if (code_lines > longest_main) {
    findings.push_back(fmt::format("{}: has {} lines of code, more than {}", source.path,
                                   code_lines, longest_main));
  }
}

/// How a product is run is asked of its run model: only the loader, the models and what makes them
/// look at the section `run` of a profile.
const std::vector<std::string> run_readers = {
    "src/files/",
    "src/device/run_model.cpp",
    "src/device/start_action.cpp",
    "src/device/command_word.cpp",
    "src/device/command_register.cpp",
    "src/sim/simulated_tool.cpp",
    "src/sim/blv_unit.cpp",
    "src/sim/profile_unit.cpp",
    "src/commands/run.cpp",
    "src/commands/command_register_run.cpp",
};

bool asks_how_it_is_run(const std::string& text) {
  for (const std::string asked :
       {"profile.run", "profile->run", "profile_->run", "profile().run"}) {
    for (auto at = text.find(asked); at != std::string::npos; at = text.find(asked, at + 1)) {
      const auto behind = static_cast<unsigned char>(
          at + asked.size() < text.size() ? text[at + asked.size()] : ' ');
      if (std::isalnum(behind) == 0 && behind != '_') return true;
    }
  }
  return false;
}

void check_run_models(const Source& source, Diagnostics& findings) {
  const bool may = std::any_of(run_readers.begin(), run_readers.end(),
                               [&](const auto& reader) { return source.path.starts_with(reader); });
  if (may || !asks_how_it_is_run(source.text)) return;
  findings.push_back(source.path + ": asks the profile how it is run, instead of the run model");
}

// ---- budgets ----

std::string read(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  REQUIRE_MESSAGE(stream.is_open(), path.string());
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Walks through the braces of a file. A brace whose head has parentheses opens a function, or
/// what looks like one from outside; any other one a space, a class or a table, which may hold
/// functions.
class FunctionWalk {
 public:
  explicit FunctionWalk(const Source& source) : code_(statements_of(source)) {}

  struct Function {
    std::string name;
    std::ptrdiff_t lines;
  };

  std::vector<Function> run() {
    for (; at_ < code_.size(); ++at_) {
      const char c = code_[at_];
      if (c == '(') ++parentheses_;
      if (c == ')') --parentheses_;
      if (parentheses_ == 0 && c == '{' && has_parameters_) end_function();
      if (parentheses_ == 0 && (c == '{' || c == '}' || c == ';')) {
        head_ = std::string::npos;
        has_parameters_ = false;
        continue;
      }
      if (head_ == std::string::npos && std::isspace(static_cast<unsigned char>(c)) == 0)
        head_ = at_;
      has_parameters_ = has_parameters_ || c == ')';
    }
    return std::move(functions_);
  }

 private:
  /// Goes to the brace that ends the function that begins here.
  void end_function() {
    for (const std::string_view label : {"public:", "protected:", "private:"}) {
      if (std::string_view(code_).substr(head_).starts_with(label)) {
        head_ = code_.find_first_not_of(" \n\t", head_ + label.size());
      }
    }
    const std::string head = code_.substr(head_, at_ - head_);
    for (std::size_t depth = 0; at_ < code_.size(); ++at_) {
      if (code_[at_] == '{') ++depth;
      if (code_[at_] == '}' && --depth == 0) break;
    }
    const std::string whole = code_.substr(head_, at_ - head_);
    functions_.push_back({name_of(head), std::count(whole.begin(), whole.end(), '\n') + 1});
  }

  static std::string name_of(const std::string& head) {
    const std::string_view front = trimmed(std::string_view(head).substr(0, head.find('(')));
    const std::size_t blank = front.find_last_of(" \n\t*&");
    return std::string(blank == std::string_view::npos ? front : front.substr(blank + 1));
  }

  std::string code_;
  std::size_t at_ = 0;
  std::size_t head_ = std::string::npos;  ///< where what stands before the next brace begins
  std::ptrdiff_t parentheses_ = 0;
  bool has_parameters_ = false;
  std::vector<Function> functions_ = {};
};

void check_functions(const Source& source, Diagnostics& findings) {
  for (const auto& [name, lines] : FunctionWalk(source).run()) {
    if (lines <= longest_function) continue;
    findings.push_back(fmt::format("{}: {} has {} lines, more than {}", source.path, name, lines,
                                   longest_function));
  }
}

/// What stands at the beginning of a line where a command is declared or defined.
std::vector<std::string> commands_in(const std::string& text) {
  constexpr std::string_view begin = "Result<Outcome> ";
  std::vector<std::string> names;
  for (const std::string& line : lines_of(text)) {
    const std::size_t open = line.find('(');
    if (!line.starts_with(begin) || open == std::string::npos) continue;
    names.push_back(line.substr(begin.size(), open - begin.size()));
  }
  return names;
}

Names verbs() {
  const auto names =
      commands_in(read(std::filesystem::path(SPINDLE_SOURCE_DIR) / std::string(verbs_header)));
  return {names.begin(), names.end()};
}

bool defines_verb(const Source& source) {
  static const Names known = verbs();
  const auto defined = commands_in(source.text);
  return source.path.starts_with("src/commands/") && source.path.ends_with(".cpp") &&
         std::any_of(defined.begin(), defined.end(),
                     [&](const std::string& name) { return known.contains(name); });
}

void check_verbs(const Source& source, Diagnostics& findings) {
  const std::ptrdiff_t lines = std::count(source.text.begin(), source.text.end(), '\n');
  if (lines <= longest_verb || !defines_verb(source)) return;
  findings.push_back(fmt::format("{}: is the file of a verb and has {} lines, more than {}",
                                 source.path, lines, longest_verb));
}

Diagnostics judge(const Source& source) {
  Diagnostics findings;
  for (const auto rule : {check_layers, check_private_headers, check_homes, check_words,
                          check_formats, check_english, check_finished, check_pragma_once,
                          check_main, check_run_models, check_functions, check_verbs}) {
    rule(source, findings);
  }
  return findings;
}

// ---- the tree ----

std::vector<Source> sources_under(const std::string& folder) {
  const std::filesystem::path root(SPINDLE_SOURCE_DIR);
  std::vector<Source> sources;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
    const std::filesystem::path& path = entry.path();
    if (path.extension() != ".cpp" && path.extension() != ".hpp") continue;
    sources.push_back({.path = path.lexically_relative(root).generic_string(), .text = read(path)});
  }
  return sources;
}

std::string joined(const Diagnostics& findings) {
  return fmt::format("{}", fmt::join(findings, "\n"));
}

}  // namespace

TEST_CASE("every source file keeps the law of the house") {
  std::set<std::string> layers_seen;
  for (const std::string folder : {"include", "src"}) {
    for (const Source& source : sources_under(folder)) {
      layers_seen.insert(layer_of(source.path));
      const Diagnostics findings = judge(source);
      CHECK_MESSAGE(findings.empty(), joined(findings));
    }
  }
  CHECK(layers_seen.contains("base"));
  CHECK(layers_seen.contains("main"));
}

/// Names of one family that stand in its profile: its event block, its columns, its lists of
/// alarms.
const std::vector<std::string_view> names_of_a_family = {
    "\"event.",       "\"a3\"",         "\"PRESET\"", "\"ANGLE\"",
    "\"last-event\"", "\"alarm-data\"", "\"alarm.*\""};

TEST_CASE("what a product calls its results stands in its profile") {
  for (const char* layer : {"catalogue", "link", "files", "device", "work", "report", "commands"}) {
    for (const Source& source : sources_under(std::string("src/") + layer)) {
      for (const std::string_view name : names_of_a_family) {
        CAPTURE(source.path);
        CAPTURE(name);
        CHECK(source.text.find(name) == std::string::npos);
      }
    }
  }
}

TEST_CASE("only the peer tests talk to libmodbus") {
  for (const Source& source : sources_under("tests")) {
    if (source.path.starts_with("tests/peer/")) continue;
    for (const Include& include : includes_of(source.text)) {
      const bool is_libmodbus = include.name == "modbus.h" || include.name == "modbus/modbus.h";
      CHECK_MESSAGE(!is_libmodbus, source.path);
    }
  }
}

TEST_CASE("the law has no circles and the arrows lead down") {
  for (const auto& [layer, direct] : arrows) {
    for (const std::string& below : direct) {
      REQUIRE(arrows.contains(below));
      CHECK_FALSE(visible_from(below).contains(layer));
    }
  }
  CHECK(visible_from("report") == Names{"report", "base"});
  CHECK(visible_from("statistics") == Names{"statistics"});
  CHECK(visible_from("posix") == Names{"posix", "link", "sim", "catalogue", "modbus", "base"});
  CHECK_FALSE(visible_from("device").contains("sim"));
  CHECK_FALSE(visible_from("work").contains("report"));
  CHECK_FALSE(visible_from("commands").contains("posix"));
}

TEST_CASE("a file that breaks the law is found") {
  struct Row {
    Source source;
    std::string finding;
  };
  const Row rows[] = {
      {{"src/base/a.cpp", "#include \"spindle/modbus/pdu.hpp\"\n"},
       "src/base/a.cpp: base must not see spindle/modbus/pdu.hpp"},
      {{"src/report/a.cpp", "  #  include <spindle/link/session.hpp>\n"},
       "src/report/a.cpp: report must not see spindle/link/session.hpp"},
      {{"include/spindle/link/a.hpp", "#pragma once\n#include \"spindle/catalogue/value.hpp\"\n"},
       "include/spindle/link/a.hpp: link must not see spindle/catalogue/value.hpp"},
      {{"src/commands/a.cpp", "#include \"spindle/posix/tcp.hpp\"\n"},
       "src/commands/a.cpp: commands must not see spindle/posix/tcp.hpp"},
      {{"src/base/a.cpp", "#include \"spindle/nowhere/a.hpp\"\n"},
       "src/base/a.cpp: base must not see spindle/nowhere/a.hpp"},
      {{"src/attic/a.cpp", ""}, "src/attic/a.cpp: is in no layer"},
      {{"src/a.cpp", ""}, "src/a.cpp: is in no layer"},
      {{"src/cli/a.cpp", "#include \"commands/trace.hpp\"\n"},
       "src/cli/a.cpp: commands/trace.hpp is private to another layer"},
      {{"src/cli/a.cpp", "#include \"../commands/trace.hpp\"\n"},
       "src/cli/a.cpp: ../commands/trace.hpp is private to another layer"},
      {{"include/spindle/posix/a.hpp", "#pragma once\n#include \"posix/wait.hpp\"\n"},
       "include/spindle/posix/a.hpp: a public header shows the private posix/wait.hpp"},
      {{"src/commands/a.cpp", "#include <CLI/CLI.hpp>\n"},
       "src/commands/a.cpp: CLI/CLI.hpp is not at home in commands"},
      {{"src/catalogue/a.cpp", "#include <yaml.h>\n"},
       "src/catalogue/a.cpp: yaml.h is not at home in catalogue"},
      {{"src/cli/a.cpp", "#include <nlohmann/json.hpp>\n"},
       "src/cli/a.cpp: nlohmann/json.hpp is not at home in cli"},
      {{"src/link/a.cpp", "#include <modbus/modbus.h>\n"},
       "src/link/a.cpp: modbus/modbus.h is not at home in link"},
      {{"src/main.cpp", "#include <modbus.h>\n"}, "src/main.cpp: modbus.h is not at home in main"},
      {{"src/work/a.cpp", "#include \"spindle/report/renderer.hpp\"\n"},
       "src/work/a.cpp: work must not see spindle/report/renderer.hpp"},
      {{"src/report/a.cpp", "#include <iostream>\n"},
       "src/report/a.cpp: iostream is not at home in report"},
      {{"src/cli/a.cpp", "#include <cstdio>\n"}, "src/cli/a.cpp: cstdio is not at home in cli"},
      {{"src/cli/a.cpp", "#include <stdio.h>\n"}, "src/cli/a.cpp: stdio.h is not at home in cli"},
      {{"src/cli/a.cpp", "void f() { std::exit(2); }\n"}, "src/cli/a.cpp: uses exit"},
      {{"src/cli/a.cpp", "void f() { exit (2); }\n"}, "src/cli/a.cpp: uses exit"},
      {{"src/posix/a.cpp", "void f() { ::sleep(1); }\n"}, "src/posix/a.cpp: uses sleep"},
      {{"src/posix/a.cpp", "void f() { usleep(1); }\n"}, "src/posix/a.cpp: uses usleep"},
      {{"src/sim/a.cpp", "using std::chrono::x; auto f = sleep_for<int>;\n"},
       "src/sim/a.cpp: uses sleep_for"},
      {{"src/link/a.cpp", "void f() { clock_nanosleep(0, 0, p, p); }\n"},
       "src/link/a.cpp: uses clock_nanosleep"},
      {{"src/link/a.cpp", "int f() { return rand(); }\n"}, "src/link/a.cpp: uses rand"},
      {{"src/link/a.cpp", "int* f() { return new int(3); }\n"}, "src/link/a.cpp: uses new"},
      {{"src/link/a.cpp", "std::shared_ptr<int> p;\n"}, "src/link/a.cpp: uses shared_ptr"},
      {{"src/link/a.cpp", "auto separated = 1'000; int* p = new int; auto c = 'x';\n"},
       "src/link/a.cpp: uses new"},
      {{"src/report/a.cpp", "auto t = fmt::format(\"{:.2L} N.m\", 2.71);\n"},
       "src/report/a.cpp: formats by locale: {:.2L}"},
      {{"src/report/a.cpp", "double d = std::strtod(text, nullptr);\n"},
       "src/report/a.cpp: uses strtod"},
      {{"src/work/a.cpp", "std::ofstream log(path);\n"}, "src/work/a.cpp: uses ofstream"},
      {{"src/report/a.cpp", "std::ostringstream s;\n"}, "src/report/a.cpp: uses ostringstream"},
      {{"src/commands/a.cpp", "bool f() { return profile.run.has_value(); }\n"},
       "src/commands/a.cpp: asks the profile how it is run, instead of the run model"},
      {{"src/sim/a.cpp", "auto f = tool.profile->run;\n"},
       "src/sim/a.cpp: asks the profile how it is run, instead of the run model"},
      {{"src/device/a.cpp", "auto f = device.profile().run;\n"},
       "src/device/a.cpp: asks the profile how it is run, instead of the run model"},
      {{"src/link/a.hpp", "// #pragma once\n"}, "src/link/a.hpp: lacks #pragma once"},
      {{"src/link/a.cpp", "// " + unfinished.front() + ": later\n"},
       "src/link/a.cpp: says " + unfinished.front()},
      {{"src/link/a.cpp", "// For the next one, w" + unclear[3].substr(1) + " it is.\n"},
       "src/link/a.cpp: says " + unclear[3]},
  };
  for (const Row& row : rows) CHECK(joined(judge(row.source)) == row.finding);
}

TEST_CASE("a main that grew too long is found") {
  std::string lines = "// a comment does not count\n\n#include <neither>\n";
  for (std::ptrdiff_t line = 0; line < longest_main; ++line) lines += "call();\n";
  CHECK(judge({.path = "src/main.cpp", .text = lines}).empty());
  CHECK(joined(judge({.path = "src/main.cpp", .text = lines + "call();\n"})) ==
        fmt::format("src/main.cpp: has {} lines of code, more than {}", longest_main + 1,
                    longest_main));
}

namespace {

std::string repeated(std::string_view line, std::ptrdiff_t times) {
  std::string lines;
  for (std::ptrdiff_t at = 0; at < times; ++at) lines += line;
  return lines;
}

}  // namespace

TEST_CASE("a function that grew too long is found, wherever it stands") {
  struct Row {
    const char* what;
    std::string before;  ///< with the head
    std::string behind;  ///< the closing brace
    std::ptrdiff_t lines = 2;
  };
  const Row rows[] = {
      {"a function", "void f() {\n", "}\n"},
      {"of a namespace", "namespace a {\nnamespace {\nvoid f() {\n", "}\n}\n}\n"},
      {"of a class", "class A final : public B {\n public:\n  void f() const override {\n",
       "  }\n};\n"},
      {"its head counts",
       "template <typename T>\nauto A<T>::f(int a,\n  int b) const -> Result<T> {\n", "}\n", 4},
      {"behind defaults in braces", "void f(Options options = {},\n  int b = 1) {\n", "}\n", 3},
      {"behind a table", "const int table[] = {1, 2};\nvoid f() {\n", "}\n"},
      {"behind parentheses and braces that are none",
       "const char a = '{';\nauto b = \"}) {\";\n// ) {\nvoid f() {\n", "}\n"},
      {"with braces in it", "void f() {\n  if (a) {\n  } else {\n  }\n", "}\n", 5},
      {"with members in its head", "A::f(int a) : b_(a) {\n", "}\n"},
  };
  for (const Row& row : rows) {
    CAPTURE(row.what);
    const auto source = [&](std::ptrdiff_t more) -> Source {
      const std::string body = repeated("  call();\n", longest_function - row.lines + more);
      return {.path = "src/base/a.cpp", .text = row.before + body + row.behind};
    };
    CHECK(joined(judge(source(0))).empty());
    const std::string found = joined(judge(source(1)));
    CHECK_MESSAGE(found.ends_with(fmt::format("f has {} lines, more than {}", longest_function + 1,
                                              longest_function)),
                  found);
  }
}

TEST_CASE("a class or a table may be longer than a function") {
  for (const char* head : {"class A {\n", "const Row rows[] = {\n", "namespace a {\n"}) {
    CAPTURE(head);
    const std::string text = head + repeated("  {1, 2},\n", 2 * longest_function) + "};\n";
    CHECK(judge({.path = "src/base/a.cpp", .text = text}).empty());
  }
}

TEST_CASE("a verb that grew too long is found, and every verb is known") {
  const std::string verb = "Result<Outcome> get(const GetOptions& options, Context& context) {}\n";
  const std::string filled = verb + repeated("\n", longest_verb - 1);
  CHECK(judge({.path = "src/commands/get.cpp", .text = filled}).empty());
  CHECK(joined(judge({.path = "src/commands/a.cpp", .text = filled + "\n"})) ==
        fmt::format("src/commands/a.cpp: is the file of a verb and has {} lines, more than {}",
                    longest_verb + 1, longest_verb));
  CHECK(judge({.path = "src/commands/a.cpp",
               .text = "Result<Outcome> help() {}\n" + repeated("\n", longest_verb)})
            .empty());
  Names defined;
  for (const Source& source : sources_under("src/commands")) {
    if (!defines_verb(source)) continue;
    for (const std::string& name : commands_in(source.text)) defined.insert(name);
  }
  for (const std::string& name : verbs()) {
    CAPTURE(name);
    CHECK(defined.contains(name));
  }
  CHECK(verbs().size() >= 20);
}

TEST_CASE("a file that keeps the law is left alone") {
  const Source rows[] = {
      {"src/cli/a.cpp",
       "#include <CLI/CLI.hpp>\n#include <new>\n#include \"spindle/base/error.hpp\"\n"
       "#include \"cli/grammar.hpp\"\n#include \"beside.hpp\"\nint f() { return app.exit(e); }\n"},
      {"src/posix/a.cpp",
       "#include <cstdio>\n#include <modbus/modbus.h>\nvoid f() { ::_exit(130); }\n"},
      {"src/main.cpp", "#include <iostream>\n#include \"spindle/base/error.hpp\"\n"},
      {"src/posix/clock.cpp", "void f() { ::clock_nanosleep(0, 1, &t, nullptr); }\n"},
      {"src/device/a.cpp", "void f() { clock.sleep_until(t); int renew; operand(1); }\n"},
      {"src/files/a.cpp",
       "// a new file, exit(1), sleep(2)\n/* rand(\n) */ auto a = \"new \\\" rand()\";\n"
       "auto b = R\"(say \"new\" exit(1))\"; auto c = '\"'; auto d = \" exit(1)\";\n"},
      {"include/spindle/sim/a.hpp",
       "/// Simulated.\n#pragma once\n#include \"spindle/link/a.hpp\"\n"},
  };
  for (const Source& source : rows) CHECK(joined(judge(source)).empty());
}
